"""From what the user asked to bake to Blender's objects."""

from __future__ import annotations

import difflib

import bpy

from ..core.errors import NothingSelectedError, ObjectNotFoundError


def chosen_objects(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, targets: str | tuple[str, ...]
) -> list[bpy.types.Object] | None:
    """The mesh objects that a request's ``targets`` mean, None for all that a render shows.

    Raises NothingSelectedError or ObjectNotFoundError.
    """
    if targets == "visible":
        return None
    if targets == "selected":
        chosen = [obj for obj in view_layer.objects if obj.type == "MESH" and obj.select_get(view_layer=view_layer)]
        if not chosen:
            raise NothingSelectedError("No mesh object is selected: select at least one, or bake all visible ones.")
        return chosen
    found = {obj.name: obj for obj in sorted(scene.objects, key=lambda obj: obj.library is None)}
    missing = [name for name in targets if name not in found]
    if missing:
        raise ObjectNotFoundError(" ".join(_not_found(name, found, scene) for name in missing))
    for name in targets:
        if found[name].type != "MESH":
            raise ObjectNotFoundError(f"The object '{name}' is not a mesh but a {found[name].type.lower()}.")
    return [found[name] for name in dict.fromkeys(targets)]


def targets_in(scene: bpy.types.Scene, targets: str | tuple[str, ...]) -> str | tuple[str, ...]:
    """The ``targets`` for one of several scenes, in which not all that are named need be."""
    if isinstance(targets, str):
        return targets
    return tuple(name for name in targets if name in scene.objects) or targets


def _not_found(name: str, found: dict, scene: bpy.types.Scene) -> str:
    close = difflib.get_close_matches(name, [name for name, obj in found.items() if obj.type == "MESH"])
    lower = [other for other in found if other.lower() == name.lower() and other not in close]
    hint = " or ".join(f"'{other}'" for other in (*lower, *close))
    return f"No object is named '{name}' in the scene '{scene.name}'" + (f": did you mean {hint}?" if hint else ".")


def name_of(obj: bpy.types.Object) -> tuple[str, str | None]:
    """The object's name and library, which tell it from all others."""
    return obj.name, obj.library.filepath if obj.library else None


def objects_by_name() -> dict[tuple[str, str | None], bpy.types.Object]:
    """All objects by name and library, asked for each time: references do not survive an undo during the bake.

    Blender itself would look through all of them for each name.
    """
    return {name_of(obj): obj for obj in bpy.data.objects}
