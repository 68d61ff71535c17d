"""The button that shows the baked light in a viewport, and takes the viewport back."""

from collections.abc import Callable
from contextlib import suppress

import bpy

#: what viewports looked like before, by their area
_before: dict[int, dict[str, str]] = {}


class DETP_OT_show(bpy.types.Operator):
    """Show the active colour attributes as they are in this viewport; press again to go back"""

    bl_idname = "detp.show"
    bl_label = "Show Baked Light"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        """Only in a 3D View."""
        return context.space_data is not None and context.space_data.type == "VIEW_3D"

    def execute(self, context):
        """Solid shading, vertex colours, flat light, or back to what it was before."""
        _switch(context.area)
        return {"FINISHED"}


def show_while(context) -> Callable[[], None]:
    """Show the light in the viewport of ``context`` while it is baked; returns what takes the viewport back."""
    area = context.area
    if area is None or area.type != "VIEW_3D" or shows_light(area.spaces.active.shading):
        return lambda: None
    _switch(area)

    def take_back() -> None:
        with suppress(ReferenceError):
            if area.type == "VIEW_3D" and shows_light(area.spaces.active.shading):
                _switch(area)

    return take_back


def _switch(area: bpy.types.Area) -> None:
    shading = area.spaces.active.shading
    key = area.as_pointer()
    if shows_light(shading):
        wanted = _before.pop(key, {"color_type": "MATERIAL", "light": "STUDIO"})
    else:
        _before[key] = {name: getattr(shading, name) for name in ("color_type", "light", "type")}
        wanted = {"type": "SOLID", "color_type": "VERTEX", "light": "FLAT"}
    for name, value in wanted.items():
        setattr(shading, name, value)


def shows_light(shading: bpy.types.View3DShading) -> bool:
    """Whether a viewport shows the colour attributes unlit."""
    return (shading.type, shading.color_type, shading.light) == ("SOLID", "VERTEX", "FLAT")


CLASSES = (DETP_OT_show,)
