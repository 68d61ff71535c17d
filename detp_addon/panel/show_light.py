"""The button that shows the baked light in a viewport, and takes the viewport back."""

from collections.abc import Callable, Iterator
from contextlib import suppress

import bpy

from ..writing.baked_layers import holds_light, look_of
from .properties import attribute_name

#: what viewports looked like before, by their area; and those whose light an undo has taken away
_before: dict[int, dict[str, str]] = {}
_undone: set[int] = set()


class DETP_OT_show(bpy.types.Operator):
    """Show the baked light in this viewport as flat colors; press again to go back"""

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
        """Solid shading, vertex colours, flat light, or back to what it was before."""
        if not shows_light(context.area):
            _choose_layers(context.scene)
        _switch(context.area)
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
    if area is None or shows_light(area):
        return lambda: None
    _switch(area)

    def take_back() -> None:
        with suppress(ReferenceError):
            if area.type == "VIEW_3D" and shows_light(area):
                _switch(area)

    return take_back


def follow_undo() -> None:
    """Viewports that showed light which an undo has taken away go back, and show it again when it is back."""
    scene = bpy.context.scene
    if scene is None or not hasattr(scene, "detp"):
        return
    lit = has_light(scene)
    for area in (area for window in bpy.context.window_manager.windows for area in window.screen.areas):
        key = area.as_pointer()
        if area.type == "VIEW_3D" and not lit and key in _before and shows_light(area):
            _undone.add(key)
            _switch(area)
        elif area.type == "VIEW_3D" and lit and key in _undone:
            _undone.discard(key)
            if not shows_light(area):
                _switch(area)


def shows_light(area: bpy.types.Area) -> bool:
    """Whether a viewport shows the colour attributes unlit."""
    shading = area.spaces.active.shading
    return (shading.type, shading.color_type, shading.light) == ("SOLID", "VERTEX", "FLAT")


def draw_in_shading(self, context) -> None:
    """The button in the viewport's shading menu, where there is light."""
    if context.space_data is not None and context.space_data.type == "VIEW_3D" and has_light(context.scene):
        draw_show(self.layout, context)


def draw_show(layout: bpy.types.UILayout, context) -> None:
    """The button itself, pressed while the light is shown."""
    layout.operator("detp.show", icon="SHADING_SOLID", depress=shows_light(context.area))


def _switch(area: bpy.types.Area) -> None:
    shading = area.spaces.active.shading
    key = area.as_pointer()
    if shows_light(area):
        wanted = _before.pop(key, {"color_type": "MATERIAL", "light": "STUDIO"})
    else:
        _before[key] = {name: getattr(shading, name) for name in ("color_type", "light", "type")}
        wanted = {"type": "SOLID", "color_type": "VERTEX", "light": "FLAT"}
    for name, value in wanted.items():
        setattr(shading, name, value)


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
