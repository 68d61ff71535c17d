"""Mixes light that was baked by groups: no photon is traced and no ray is cast."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import bpy
import numpy as np

from ...core.errors import EditModeError, InvalidSettingError, LightGroupNotFoundError, NotBakedError
from ..materials.mesh_layers import drop_looks
from ..wording import alike
from ..writing.baked_layers import LAYERS_MARK, groups_of, note_mixture, stored_colours

#: by group, the RGB by which its light is multiplied
Gains = dict[str, tuple[float, float, float]]


def gains_of(objects: Iterable[bpy.types.Object], attribute: str) -> Gains:
    """What the light in ``attribute`` is mixed of, and how; empty when it was not baked by light."""
    return _gains(groups for _, groups in _mixtures(objects, attribute))


def has_mixture(objects: Iterable[bpy.types.Object], attribute: str) -> bool:
    """Whether the light in ``attribute`` of any of the ``objects`` is a mixture of groups."""
    return any(True for _ in _mixtures(objects, attribute))


def mix(objects: Iterable[bpy.types.Object], attribute: str, gains: Gains) -> Gains:
    """Mix the light in ``attribute`` anew and return how all groups count; those without a new gain keep theirs.

    Raises NotBakedError when there is nothing to mix or a layer is missing, LightGroupNotFoundError, EditModeError, and
    InvalidSettingError on gains that are negative or not finite. Nothing has then been changed.
    """
    mixtures = list(_mixtures(objects, attribute))
    if not mixtures:
        raise NotBakedError(f"No mesh has light by groups in '{attribute}': bake it by light first.")
    known = _gains(groups for _, groups in mixtures)
    _check_gains(gains, known, attribute)
    _check_layers(mixtures)
    for mesh, groups in {obj.data: groups for obj, groups in mixtures}.items():
        _mix(mesh, attribute, groups, gains)
    # What surfaces look like in light that is no more is of no use.
    drop_looks([obj for obj, _ in mixtures], attribute)
    return known | gains


def remix(objects: Iterable[bpy.types.Object], attribute: str, gains: Gains) -> None:
    """Mix light that was written anew as it was before, as far as its groups are still there."""
    known = gains_of(objects, attribute)
    changed = {name: gain for name, gain in gains.items() if known.get(name, gain) != gain}
    if changed:
        mix(objects, attribute, changed)


def _mixtures(
    objects: Iterable[bpy.types.Object], attribute: str
) -> Iterator[tuple[bpy.types.Object, dict[str, dict]]]:
    """Those of the ``objects`` whose light is a mixture that can be changed here, and the marks of its layers."""
    for obj in objects:
        groups = groups_of(obj.data, attribute) if obj.type == "MESH" and not obj.data.library else {}
        if groups:
            yield obj, groups


def _gains(mixtures: Iterable[dict[str, dict]]) -> Gains:
    found: Gains = {}
    for groups in mixtures:
        for mark in groups.values():
            found.setdefault(mark["name"], tuple(mark["gain"]))
    return found


def _check_gains(gains: Gains, known: Gains, attribute: str) -> None:
    for name, gain in gains.items():
        if name not in known:
            there = alike(name, known)
            raise LightGroupNotFoundError(f"No light group '{name}' is in '{attribute}': did you mean {there}?")
        if not all(math.isfinite(channel) and channel >= 0 for channel in gain):
            raise InvalidSettingError(f"Light of '{name}' cannot be multiplied by {gain}: choose 0 or more.")


def _check_layers(mixtures: list[tuple[bpy.types.Object, dict[str, dict]]]) -> None:
    for obj, groups in mixtures:
        if obj.data.is_editmode:
            raise EditModeError(f"'{obj.name}' is open in Edit Mode, where no light can be mixed: leave it first.")
        missing = [name for name in groups if name not in obj.data.attributes]
        if missing:
            raise NotBakedError(f"'{obj.name}' has lost the layer '{missing[0]}': bake by light again.")


def _mix(mesh: bpy.types.Mesh, attribute: str, groups: dict[str, dict], gains: Gains) -> None:
    layer = mesh.attributes[attribute]
    mixed = stored_colours(layer)  # whose alpha stays
    mixed[:, :3] = 0.0
    for name, mark in groups.items():
        mark["gain"] = [float(channel) for channel in gains.get(mark["name"], mark["gain"])]
        if any(mark["gain"]):
            mixed += stored_colours(mesh.attributes[name]) * np.array([*mark["gain"], 0.0], np.float32)
    np.minimum(mixed[:, :3], mesh[LAYERS_MARK]["light"][attribute].get("limit", np.inf), out=mixed[:, :3])
    layer.data.foreach_set("color", mixed.ravel())
    note_mixture(mesh, attribute, groups)
    mesh.update_tag()
