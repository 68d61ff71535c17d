"""Leaves Edit Mode, in which Blender keeps the data of objects where neither a bake nor a script can reach them."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress

import bpy

from ..wording import counted, some


def leave_edit_mode(objects: Iterable[bpy.types.Object]) -> list[str]:
    """Take the ``objects`` out of Edit Mode, with all that was edited; returns the names of those that were in it."""
    editing = [obj for obj in objects if obj.mode == "EDIT"]
    for obj in editing:
        # Those of another scene cannot leave it from here; they are not baked either.
        with suppress(RuntimeError), bpy.context.temp_override(object=obj, active_object=obj):
            bpy.ops.object.mode_set(mode="OBJECT")
    return [obj.name for obj in editing]


def opened_from_edit_mode() -> list[str]:
    """Take everything in a file just opened out of Edit Mode; returns a note on it, if there was something."""
    names = leave_edit_mode(bpy.data.objects)
    if not names:
        return []
    many, shown = counted(len(names), "object"), some(names, "")
    return [f"The file was saved in Edit Mode of {many} ({shown}), which was left for the bake."]
