"""The button that shows the baked light in a viewport, and takes the viewport back."""

from collections.abc import Callable, Iterator
from contextlib import suppress

import bpy

from ..materials.light_in_materials import materials_with_light
from ..writing.baked_layers import holds_light, look_of
from .properties import attribute_name

#: what viewports looked like before, by their area; and those whose light an undo has taken away
_before: dict[int, dict[str, str]] = {}
_undone: set[int] = set()

#: how a viewport shows light: as flat colours, or by the materials that use it
_FLAT = {"type": "SOLID", "color_type": "VERTEX", "light": "FLAT"}
_MATERIAL = {"type": "MATERIAL"}


class DETP_OT_show(bpy.types.Operator):
    """Show the baked light in this viewport, by the materials that use it or as flat colors; press again to go back"""

    bl_idname = "detp.show"
    bl_label = "Show Baked Light"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        """Only in a 3D View of a scene that has light."""
        if context.space_data is None or context.space_data.type != "VIEW_3D":
            return False
        if not has_light(context.scene):
            cls.poll_message_set("No mesh has colors in the attribute of the panel: bake it first")
            return False
        return True

    def execute(self, context):
        """Change the shading, or put back what it was before."""
        if shows_light(context.area, context.scene):
            _go_back(context.area)
        else:
            _choose_layers(context.scene)
            _show(context.area, context.scene)
        return {"FINISHED"}


def has_light(scene: bpy.types.Scene) -> bool:
    """Whether any mesh of the scene has the colours of the panel's attribute."""
    return any(True for _ in _lit_meshes(scene))


def show_while(context) -> Callable[[], None]:
    """Show the light in a viewport while it is baked: that of ``context``, or the largest of its window.

    Returns what takes the viewport back.
    """
    views = [area for area in context.window.screen.areas if area.type == "VIEW_3D"]
    area = (
        context.area if context.area in views else max(views, key=lambda view: view.width * view.height, default=None)
    )
    scene = context.scene
    if area is None or shows_light(area, scene):
        return lambda: None
    _show(area, scene)

    def take_back() -> None:
        with suppress(ReferenceError):
            if area.type == "VIEW_3D" and shows_light(area, scene):
                _go_back(area)

    return take_back


def follow_light() -> None:
    """After an undo, or when materials have changed: viewports that show light show it in the way that fits now.

    Those whose light an undo has taken away go back, and show it again when it is back.
    """
    scene = bpy.context.scene
    if scene is None or not hasattr(scene, "detp"):
        return
    lit = has_light(scene)
    for area in (area for window in bpy.context.window_manager.windows for area in window.screen.areas):
        key = area.as_pointer()
        if area.type != "VIEW_3D":
            continue
        if key in _before and (_looks_like(area, _FLAT) or _looks_like(area, _MATERIAL)):
            if lit:
                _show(area, scene)
            else:
                _undone.add(key)
                _go_back(area)
        elif lit and key in _undone:
            _undone.discard(key)
            _show(area, scene)


def shows_light(area: bpy.types.Area, scene: bpy.types.Scene) -> bool:
    """Whether a viewport shows the light of the scene."""
    return _looks_like(area, _way(scene))


def draw_in_shading(self, context) -> None:
    """The button in the viewport's shading menu, where there is light."""
    if context.space_data is not None and context.space_data.type == "VIEW_3D" and has_light(context.scene):
        draw_show(self.layout, context)


def draw_show(layout: bpy.types.UILayout, context) -> None:
    """The button itself, pressed while the light is shown."""
    layout.operator("detp.show", icon="SHADING_SOLID", depress=shows_light(context.area, context.scene))


def _show(area: bpy.types.Area, scene: bpy.types.Scene) -> None:
    shading = area.spaces.active.shading
    _before.setdefault(area.as_pointer(), {name: getattr(shading, name) for name in ("color_type", "light", "type")})
    for name, value in _way(scene).items():
        setattr(shading, name, value)


def _go_back(area: bpy.types.Area) -> None:
    shading = area.spaces.active.shading
    before = _before.pop(area.as_pointer(), {"color_type": "MATERIAL", "light": "STUDIO", "type": "SOLID"})
    # Colours and light are settings of solid shading.
    shading.type = "SOLID"
    for name, value in before.items():
        setattr(shading, name, value)


def _way(scene: bpy.types.Scene) -> dict[str, str]:
    return _MATERIAL if any(True for _ in materials_with_light(scene.objects)) else _FLAT


def _looks_like(area: bpy.types.Area, way: dict[str, str]) -> bool:
    shading = area.spaces.active.shading
    return all(getattr(shading, name) == value for name, value in way.items())


def _lit_meshes(scene: bpy.types.Scene) -> Iterator[bpy.types.Mesh]:
    name = attribute_name(scene.detp)
    return (obj.data for obj in scene.objects if obj.type == "MESH" and name in obj.data.color_attributes)


def _choose_layers(scene: bpy.types.Scene) -> None:
    """Let viewports show the light of meshes that show something else, such as after a bake with --activate off."""
    name = attribute_name(scene.detp)
    look = look_of(name)
    for mesh in _lit_meshes(scene):
        if mesh.library is None and mesh.attributes.active_color_name not in (name, look):
            mesh.attributes.active_color_name = look if holds_light(mesh, look) else name


CLASSES = (DETP_OT_show,)
