"""Knows which colour layers of a mesh hold baked light, so that no bake takes the light of another for paint.

Each bake leaves a custom property on the mesh: its layers, and which layer rendered before the first of them did.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

#: the custom property: {"paint": name, "layers": {name: checksum of its colours}, "light": {name: what it means}}
LAYERS_MARK = "detp_bakes"

#: what a layer means: the quantity, and by what the light was multiplied for it, which an engine divides by; where that
#: is known also "error", by which half of the light was likely to be off at most
PLAIN_LIGHT = {"quantity": "lighting", "scale": 1.0}

#: the quantity of layers that hold no light and only keep a material from being black
WHITE = "white"

#: the quantity of layers that hold what surfaces look like in this light, for the viewport
LOOK = "look"


def parts_of(name: str) -> tuple[str, str]:
    """The names of the layers with the direct and the indirect part of the light of the layer ``name``."""
    return f"{name}_direct", f"{name}_indirect"


#: what bakes were named before they left a mark, unless they were asked for another name
UNMARKED = ("irradiance", *parts_of("irradiance"))


@dataclass(frozen=True)
class ColourLayers:
    """Of one mesh: the names of the layers that are ``baked``, and the one that renders without them, "" for none.

    unsure  whether the layer that renders may be a bake of an earlier version
    """

    baked: frozenset[str]
    paint: str
    unsure: bool = False


NO_LAYERS = ColourLayers(frozenset(), "")


def baked_names() -> frozenset[str]:
    """What layers with light are named on any mesh of the file."""
    return frozenset(name for mesh in bpy.data.meshes for name in _mark(mesh)["layers"])


def colour_layers(
    mesh: bpy.types.Mesh, written: Sequence[str] = (), elsewhere: frozenset[str] = frozenset()
) -> ColourLayers:
    """The layers of a mesh, in front of a bake that will write the layers of these names.

    Layers that modifiers bring along hold light when they have the name of one ``elsewhere``.
    """
    mark = _mark(mesh)
    sums = set(mark["layers"].values())
    colours = [layer for layer in mesh.attributes if layer.data_type in ("FLOAT_COLOR", "BYTE_COLOR")]
    floats = [layer for layer in colours if layer.data_type == "FLOAT_COLOR"]
    # The only colours that a mesh has are paint, even where they are about to be overwritten.
    named = {*mark["layers"], *UNMARKED, *(written if len(colours) > 1 else ())}
    # Renaming a layer does not make it paint, and only a bake with a mark has written bytes.
    baked = {layer.name for layer in floats if layer.name in named}
    baked |= {layer.name for layer in colours if layer.name in mark["layers"] or (sums and _checksum(layer) in sums)}
    default = mesh.attributes.default_color_name
    others = [layer.name for layer in colours if layer.name not in baked]
    if default in baked:
        paint = mark["paint"] if mark["paint"] in others else next(iter(others), "")
    else:
        paint = default
    # A layer of floats beside another one is what earlier versions left when they were asked for a name.
    corners = any(layer.name == paint and layer.domain == "CORNER" for layer in floats)
    brought = {name for name in elsewhere if name not in mesh.attributes}
    unsure = corners and LAYERS_MARK not in mesh and (len(others) > 1 or paint in written)
    return ColourLayers(frozenset(baked | brought), paint, unsure)


def look_of(name: str) -> str:
    """The name of the layer that shows the viewport what surfaces look like in the light of the layer ``name``."""
    return f"{name}_look"


def leave_mark(mesh: bpy.types.Mesh, paint: str, light: dict[str, dict]) -> dict | None:
    """Note what ``light`` layers hold, by their names, and that ``paint`` rendered before; returns the mark until now.

    Each has what differs from PLAIN_LIGHT.
    """
    before, mark = mesh[LAYERS_MARK].to_dict() if LAYERS_MARK in mesh else None, _mark(mesh)
    kept, meanings = (
        {name: value for name, value in mark[part].items() if name in mesh.attributes} for part in ("layers", "light")
    )
    sums = {name: _checksum(mesh.attributes[name]) for name in light}
    meanings |= {name: PLAIN_LIGHT | meaning for name, meaning in light.items()}
    mesh[LAYERS_MARK] = {"paint": paint, "layers": kept | sums, "light": meanings}
    return before


def light_of(mesh: bpy.types.Mesh, name: str) -> dict:
    """What the layer of that name means, see PLAIN_LIGHT."""
    found = _mark(mesh)["light"].get(name)
    return PLAIN_LIGHT | (found if isinstance(found, dict) else {})


def error_there(meshes: Iterable[bpy.types.Mesh], name: str) -> float | None:
    """The error of the light that half of ``meshes`` have in the layer of that name; None where it is not known."""
    known = sorted(error for mesh in set(meshes) if (error := _noted(mesh, name, "error")) is not None)
    return known[len(known) // 2] if known else None


def group_mark(name: str) -> dict:
    """What is noted of the layer of a light group: its name, and the RGB by which the whole has it multiplied."""
    return {"name": name, "gain": [1.0, 1.0, 1.0]}


def groups_of(mesh: bpy.types.Mesh, name: str) -> dict[str, dict]:
    """The layers of light groups that the light in the layer of that ``name`` is mixed of, and the mark of each."""
    groups = _noted(mesh, name, "groups")
    return groups.to_dict() if hasattr(groups, "to_dict") else {}


def note_mixture(mesh: bpy.types.Mesh, name: str, groups: dict[str, dict]) -> None:
    """Note that the layer of that ``name`` now holds this mixture of ``groups``."""
    mark = mesh[LAYERS_MARK]
    mark["layers"][name], mark["light"][name]["groups"] = _checksum(mesh.attributes[name]), groups


def holds_light(mesh: bpy.types.Mesh, name: str) -> bool:
    """Whether a bake that left its mark has written the colour layer of that name."""
    marked = name in mesh.color_attributes and name in _mark(mesh)["layers"]
    return marked and light_of(mesh, name)["quantity"] != WHITE


def just_baked(mesh: bpy.types.Mesh, name: str) -> bool:
    """Whether the layer of that name is still what a bake that left its mark has written."""
    return name in mesh.color_attributes and _mark(mesh)["layers"].get(name) == _checksum(mesh.attributes[name])


def remove_layer(mesh: bpy.types.Mesh, name: str) -> None:
    """Remove the layer of that name from the mesh and its mark."""
    mesh.attributes.remove(mesh.attributes[name])
    mark = _mark(mesh)
    mesh[LAYERS_MARK] = mark | {
        part: {other: value for other, value in mark[part].items() if other != name} for part in ("layers", "light")
    }


def put_mark(owner: bpy.types.ID, mark: dict | str | None, name: str = LAYERS_MARK) -> None:
    """Let the custom property of that ``name`` be ``mark``, such as :func:`leave_mark` returns; None for none."""
    if mark is not None:
        owner[name] = mark
    elif name in owner:
        del owner[name]


def _noted(mesh: bpy.types.Mesh, name: str, what: str):
    """What is noted of the layer of that ``name``, None for nothing.

    A slider asks this of all meshes, so the rest of their marks is not looked at.
    """
    try:
        return mesh[LAYERS_MARK]["light"][name][what] if name in mesh.attributes else None
    except (KeyError, TypeError, AttributeError):
        return None


def _mark(mesh: bpy.types.Mesh) -> dict:
    """The mark of a mesh, an empty one where there is none or something else has its name."""
    found = mesh.get(LAYERS_MARK)
    found = found.to_dict() if hasattr(found, "to_dict") else {}
    parts = {part: found.get(part) for part in ("layers", "light")}
    return {
        "paint": str(found.get("paint", "")),
        **{part: value if isinstance(value, dict) else {} for part, value in parts.items()},
    }


def stored_colours(layer: bpy.types.Attribute) -> np.ndarray:
    """The RGBA (elements, 4) of a colour layer, float32, linear."""
    rgba = np.empty((len(layer.data), 4), np.float32)
    layer.data.foreach_get("color", rgba.ravel())
    return rgba


def _checksum(layer: bpy.types.Attribute) -> int:
    return zlib.crc32(stored_colours(layer)) & 0x7FFFFFFF  # custom properties hold 31 bits and a sign
