"""The button that shows the baked light in a viewport, and takes the viewport back."""

from collections.abc import Callable, Iterator
from contextlib import suppress

import bpy

from ..materials.use_light import materials_with_light
from ..writing.baked_layers import holds_light, look_of
from .properties import attribute_name

#: what viewports looked like before, by their area; and those whose light an undo has taken away
_before: dict[int, dict[str, str]] = {}
_undone: set[int] = set()

#: light alone, and light in materials
_FLAT = {"type": "SOLID", "color_type": "VERTEX", "light": "FLAT"}
_MATERIAL = {"type": "MATERIAL"}


class DETP_OT_show(bpy.types.Operator):
    """Show the baked light in this viewport: in the materials that use it, else flat colours; press again to go back"""

    bl_idname = "detp.show"
    bl_label = "Show Baked Light"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        """Only in a 3D View of a scene that has light."""
        if context.space_data is None or context.space_data.type != "VIEW_3D":
            return False
        if not has_light(context.scene):
            cls.poll_message_set("No mesh has baked light in the attribute of the panel: bake it first")
            return False
        return True

    def execute(self, context):
        """Change the shading, or put back what it was before."""
        if not is_shown(context.area, context.scene):
            _choose_layers(context.scene)
        switch(context.area, context.scene)
        return {"FINISHED"}


def has_light(scene: bpy.types.Scene) -> bool:
    """Whether any mesh of the scene has the colours of the panel's attribute."""
    return any(True for _ in _lit_meshes(scene))


def show_while(context) -> Callable[[], None]:
    """Show the light in the viewport of ``context`` while it is baked; returns what takes the viewport back."""
    area, scene = context.area, context.scene
    if area is None or area.type != "VIEW_3D" or is_shown(area, scene):
        return lambda: None
    switch(area, scene)

    def take_back() -> None:
        with suppress(ReferenceError):
            if area.type == "VIEW_3D" and area.as_pointer() in _before:
                switch(area, scene)

    return take_back


def switch(area: bpy.types.Area, scene: bpy.types.Scene) -> None:
    """Show the light in a viewport, or put back what it showed before."""
    key, shading = area.as_pointer(), area.spaces.active.shading
    if is_shown(area, scene):
        wanted = _before.pop(key, {"color_type": "MATERIAL", "light": "STUDIO"})
    else:
        _before.setdefault(key, {name: getattr(shading, name) for name in ("color_type", "light", "type")})
        wanted = _wanted(scene)
    # Colours and light belong to the type that is shown.
    for name in sorted(wanted, key="type".__ne__):
        with suppress(TypeError):
            setattr(shading, name, wanted[name])


def is_shown(area: bpy.types.Area, scene: bpy.types.Scene) -> bool:
    """Whether a viewport shows the light of the scene."""
    shading = area.spaces.active.shading
    return all(getattr(shading, name) == value for name, value in _wanted(scene).items())


def follow_undo() -> None:
    """Viewports that showed light which an undo has taken away go back, and show it again when it is back."""
    scene = bpy.context.scene
    if scene is None or not hasattr(scene, "detp"):
        return
    lit = has_light(scene)
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            key = area.as_pointer()
            if area.type != "VIEW_3D":
                continue
            if not lit and key in _before and is_shown(area, scene):
                _undone.add(key)
                switch(area, scene)
            elif lit and key in _undone:
                _undone.discard(key)
                if not is_shown(area, scene):
                    switch(area, scene)


def draw_in_shading(self, context) -> None:
    """The button in the viewport's shading menu, where there is light."""
    if context.space_data is not None and context.space_data.type == "VIEW_3D" and has_light(context.scene):
        draw_show(self.layout, context)


def draw_show(layout: bpy.types.UILayout, context) -> None:
    """The button itself, pressed while the light is shown."""
    layout.operator("detp.show", icon="SHADING_SOLID", depress=is_shown(context.area, context.scene))


def _wanted(scene: bpy.types.Scene) -> dict[str, str]:
    return _MATERIAL if any(True for _ in materials_with_light(scene.objects)) else _FLAT


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
