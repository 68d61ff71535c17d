"""Mixes light that was baked by groups: no photon is traced and no ray is cast."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Iterator

import bpy
import numpy as np

from ...core.errors import EditModeError, InvalidSettingError, LightGroupNotFoundError, NotBakedError
from ..materials.mesh_layers import drop_looks
from ..writing.baked_layers import group_mark, groups_of, light_of, note_mixture, stored_colours

#: by group, the RGB by which its light is multiplied
Gains = dict[str, tuple[float, float, float]]


def gains_of(objects: Iterable[bpy.types.Object], attribute: str) -> Gains:
    """What the light in ``attribute`` is mixed of, and how; empty when it was not baked by light."""
    found: Gains = {}
    for obj in mixed_objects(objects, attribute):
        for mark in groups_of(obj.data, attribute).values():
            found.setdefault(mark["name"], tuple(mark["gain"]))
    return found


def mixed_objects(objects: Iterable[bpy.types.Object], attribute: str) -> Iterator[bpy.types.Object]:
    """Those of the ``objects`` whose light in ``attribute`` is a mixture of groups that can be changed here."""
    for obj in objects:
        if obj.type == "MESH" and not obj.data.library and groups_of(obj.data, attribute):
            yield obj


def mix(objects: Iterable[bpy.types.Object], attribute: str, gains: Gains) -> Gains:
    """Mix the light in ``attribute`` anew and return how all groups count; those without a new gain keep theirs.

    Raises NotBakedError when there is nothing to mix or a layer is missing, LightGroupNotFoundError, EditModeError, and
    InvalidSettingError on gains that are negative or not finite. Nothing has then been changed.
    """
    chosen = list(mixed_objects(objects, attribute))
    if not chosen:
        raise NotBakedError(f"No mesh has light by groups in '{attribute}': bake it by light first.")
    _check(chosen, attribute, gains)
    for mesh in dict.fromkeys(obj.data for obj in chosen):
        _mix(mesh, attribute, gains)
    # What surfaces look like in light that is no more is of no use.
    drop_looks(chosen, attribute)
    return gains_of(chosen, attribute)


def _check(objects: list[bpy.types.Object], attribute: str, gains: Gains) -> None:
    known = gains_of(objects, attribute)
    for name, gain in gains.items():
        if name not in known:
            close = difflib.get_close_matches(name, known) or list(known)[:3]
            there = " or ".join(f"'{other}'" for other in close)
            raise LightGroupNotFoundError(f"No light group '{name}' is in '{attribute}': did you mean {there}?")
        if not all(math.isfinite(channel) and channel >= 0 for channel in gain):
            raise InvalidSettingError(f"Light of '{name}' cannot be multiplied by {gain}: choose 0 or more.")
    for obj in objects:
        if obj.data.is_editmode:
            raise EditModeError(f"'{obj.name}' is open in Edit Mode, where no light can be mixed: leave it first.")
        missing = [name for name in groups_of(obj.data, attribute) if name not in obj.data.color_attributes]
        if missing:
            raise NotBakedError(f"'{obj.name}' has lost the layer '{missing[0]}': bake by light again.")


def _mix(mesh: bpy.types.Mesh, attribute: str, gains: Gains) -> None:
    groups, layer = groups_of(mesh, attribute), mesh.attributes[attribute]
    mixed = stored_colours(layer)  # whose alpha stays
    mixed[:, :3] = 0.0
    for name, mark in groups.items():
        mark["gain"] = list(gains.get(mark["name"], mark["gain"]))
        if any(mark["gain"]):
            mixed += stored_colours(mesh.attributes[name]) * np.array([*mark["gain"], 0.0], np.float32)
    np.minimum(mixed[:, :3], light_of(mesh, attribute).get("limit", np.inf), out=mixed[:, :3])
    layer.data.foreach_set("color", mixed.ravel())
    note_mixture(mesh, attribute, {name: group_mark(**mark) for name, mark in groups.items()})
    mesh.update_tag()
