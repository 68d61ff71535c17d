"""Writes colours into colour attributes: all the objects it is given, or, when it fails, none of them."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...core.errors import AttributeNameTakenError, DetpError, EditModeError, InvalidSettingError, UnwritableFileError
from ..reading.read_attributes import face_sizes
from ..reading.read_meshes import corner_vertex_indices, vertex_positions
from ..wording import some
from .baked_layers import LOOK, colour_layers, just_baked, leave_mark, light_of, look_of, put_mark, stored_colours
from .element_values import Faces

#: the brightest colour that an attribute holds
_LARGEST = float(np.finfo(np.float32).max)

#: names longer than this do not fit an attribute of Blender 4.2 to 4.5
LONGEST_NAME = 63


@dataclass(frozen=True)
class MeshColours:
    """What to write on one mesh object: for each attribute's name its rgb (M, 3), one row per element of the domain.

    light  what the rgb mean, as baked_layers.PLAIN_LIGHT
    type   of the attributes; into bytes Blender itself encodes linear colours as sRGB
    look   rgb (M, 3) for a layer of bytes beside the first that the viewport shows in its place, and look_scale, by
           which they were multiplied; None for no such layer
    groups what the layers of light groups hold, as group_mark says it; the first of all layers is their mixture
    """

    object: bpy.types.Object
    layers: dict[str, np.ndarray]
    light: dict = field(default_factory=dict)
    type: str = "FLOAT_COLOR"
    look: np.ndarray | None = None
    look_scale: float = 1.0
    groups: dict[str, dict] = field(default_factory=dict)


def check_attribute_name(name: str) -> None:
    """Raise InvalidSettingError when Blender could not keep ``name`` as it is."""
    if not name.strip():
        raise InvalidSettingError("The attribute needs a name.")
    if name.startswith("."):
        raise InvalidSettingError(f"The attribute name '{name}' starts with a dot, which Blender keeps for itself.")
    if len(name.encode()) > LONGEST_NAME:
        raise InvalidSettingError(f"The attribute name '{name}' is longer than {LONGEST_NAME} bytes.")


def obstacle(obj: bpy.types.Object, attribute: str, domain: str, kind: str = "FLOAT_COLOR") -> DetpError | None:
    """Why the ``attribute`` of this mesh object cannot be written as ``kind``, or None when it can."""
    mesh = obj.data
    if obj.library or mesh.library or mesh.override_library:
        source = (obj.library or mesh.library or mesh.override_library.reference.library).filepath
        return UnwritableFileError(
            f"'{obj.name}' is linked from the library '{source}', so its colours cannot be written here: "
            f"make it local, or bake it in its own file."
        )
    if mesh.is_editmode:
        return EditModeError(f"'{obj.name}' is open in Edit Mode: leave Edit Mode and bake again.")
    taken = mesh.attributes.get(attribute)
    other = taken is not None and (taken.data_type, taken.domain) != (kind, domain)
    if other and not just_baked(mesh, attribute):
        return AttributeNameTakenError(
            f"'{obj.name}' already has an attribute named '{attribute}' of the type {taken.data_type} on "
            f"{taken.domain}, and {kind} on {domain} cannot replace it: choose another attribute name, or remove it."
        )
    if taken is None and attribute in obj.vertex_groups:
        return AttributeNameTakenError(
            f"'{obj.name}' has a vertex group named '{attribute}', and an attribute cannot have the same name: "
            f"choose another attribute name."
        )
    return None


def element_count(mesh: bpy.types.Mesh, domain: str) -> int:
    """How many elements of the domain (CORNER or POINT) the mesh has."""
    return len(mesh.loops) if domain == "CORNER" else len(mesh.vertices)


def corner_faces(mesh: bpy.types.Mesh) -> np.ndarray:
    """The face (C,) of each corner of a mesh outside Edit Mode."""
    sizes = face_sizes(mesh)
    return np.repeat(np.arange(len(sizes)), sizes)


def faces_of(mesh: bpy.types.Mesh, domain: str) -> Faces:
    """The faces of a mesh outside Edit Mode, whose corners or vertices have the colours of the domain."""
    positions = vertex_positions(mesh)
    places = np.where(np.isfinite(positions), positions, 0.0)
    return Faces(corner_faces(mesh), corner_vertex_indices(mesh), places, domain == "POINT")


def write_colours(
    colours: list[MeshColours],
    domain: str,
    shown: str | None = None,
    more: Callable[[ExitStack], None] | None = None,
) -> list[str]:
    """Write every entry's colours to its object's attributes and return notes for the user.

    An attribute is made when missing; an existing one of the same type and domain is overwritten but keeps its
    alpha, and a bake of another type or domain is replaced. The attribute ``shown`` becomes the colour that the
    viewport and render show; other layers stay as they are.
    An object whose mesh has other users gets a copy of its own, so that each holds its own light; the mesh stays
    with the first of them when all are written. ``more`` writes what belongs to them, and lets the stack that it gets
    take it back. Objects with an :func:`obstacle` must not be passed.

    Raises AttributeNameTakenError or whatever Blender raises; everything written before is then taken back.
    """
    with ExitStack() as undo:
        copied = _separate_meshes([entry.object for entry in colours], undo)
        for entry in colours:
            write_layers(entry, domain, shown, undo)
        if more is not None:
            more(undo)
        undo.pop_all()
    notes = []
    if len(copied) == 1:
        notes.append(
            f"The object '{copied[0]}' shared its mesh and was given a copy, to hold the light of its own place."
        )
    elif copied:
        notes.append(
            f"{len(copied)} objects shared a mesh and were given copies, to hold the light of their places: "
            f"{some(copied)}."
        )
    too_bright = [
        entry.object.name for entry in colours if any((abs(c) > _LARGEST).any() for c in entry.layers.values())
    ]
    if too_bright:
        notes.append(f"The light is brighter than a colour can hold, and was cut there, on {some(too_bright)}.")
    return notes


def write_layers(entry: MeshColours, domain: str, shown: str | None, undo: ExitStack) -> None:
    """Write the colours of one entry to its object's own mesh; closing ``undo`` takes back what has been written."""
    mesh = entry.object.data
    look = _look_name(entry, domain)
    written = (*entry.layers, look) if look else tuple(entry.layers)
    paint = colour_layers(mesh, written).paint
    for name, rgb in entry.layers.items():
        _write(entry.object, name, rgb, (entry.type, domain), undo)
    light = dict.fromkeys(entry.layers, entry.light)
    if entry.groups:
        light[next(iter(light))] = entry.light | {"groups": entry.groups}
    if look:
        _write(entry.object, look, entry.look, ("BYTE_COLOR", domain), undo)
        light[look] = {"quantity": LOOK, "scale": entry.look_scale}
    undo.callback(put_mark, mesh, leave_mark(mesh, paint, light))
    if shown is not None:
        _show(mesh, look or shown, shown)


def _look_name(entry: MeshColours, domain: str) -> str:
    """The name of the layer for the look, "" when there is none, or where it is taken by something else."""
    mesh, name = entry.object.data, look_of(next(iter(entry.layers)))
    if entry.look is None or len(name.encode()) > LONGEST_NAME or obstacle(entry.object, name, domain, "BYTE_COLOR"):
        return ""
    return name if name not in mesh.attributes or light_of(mesh, name)["quantity"] == LOOK else ""


def _separate_meshes(objects: list[bpy.types.Object], undo: ExitStack) -> list[str]:
    """Give every object a mesh of its own, and return the names of those that needed a copy."""
    users = {}
    for obj in bpy.data.objects:
        if obj.type == "MESH" and obj.data is not None:
            users.setdefault(obj.data, []).append(obj)
    written = set(objects)
    kept = {mesh for mesh, sharing in users.items() if not written.issuperset(sharing)}
    copied = []
    for obj in objects:
        mesh = obj.data
        if len(users[mesh]) == 1:
            continue
        if mesh not in kept:
            kept.add(mesh)
            continue
        copy = mesh.copy()
        undo.callback(_put_back, obj, mesh, copy)
        obj.data = copy
        copied.append((f"{mesh.name}.{obj.name}", obj))
    # Blender keeps meshes in the order of their names, and looks for the place of each from the end on.
    for name, obj in sorted(copied, key=lambda pair: pair[0].lower()):
        obj.data.name = name
    return [obj.name for _, obj in copied]


def _put_back(obj: bpy.types.Object, mesh: bpy.types.Mesh, copy: bpy.types.Mesh) -> None:
    obj.data = mesh
    bpy.data.meshes.remove(copy)


def _write(obj: bpy.types.Object, attribute: str, rgb: np.ndarray, kind: tuple[str, str], undo: ExitStack) -> None:
    """Write to the attribute, whose ``kind`` is its type and domain."""
    mesh = obj.data
    layers = mesh.attributes
    shown = (layers.active_color_name, layers.default_color_name)
    undo.callback(_show, mesh, *shown)
    layer = layers.get(attribute)
    rgba = np.ones((len(rgb), 4), np.float32)
    if layer is not None and (layer.data_type, layer.domain) != kind:
        undo.callback(_make, mesh, attribute, (layer.data_type, layer.domain), stored_colours(layer))
        layers.remove(layer)
        layer = None
    if layer is None:
        layer = layers.new(attribute, *kind)
        name = layer.name if layer else None
        if name is not None:
            undo.callback(remove_attribute, mesh, name)
        if name != attribute:
            raise AttributeNameTakenError(
                f"'{obj.name}' does not accept an attribute named '{attribute}': choose another attribute name."
            )
    else:
        layer.data.foreach_get("color", rgba.ravel())
        undo.callback(_fill, mesh, attribute, rgba.copy())
    rgba[:, :3] = np.clip(rgb, -_LARGEST, _LARGEST)
    _fill(mesh, attribute, rgba)
    _show(mesh, *shown)


def _make(mesh: bpy.types.Mesh, name: str, kind: tuple[str, str], rgba: np.ndarray) -> None:
    mesh.attributes.new(name, *kind)
    _fill(mesh, name, rgba)


def _fill(mesh: bpy.types.Mesh, name: str, rgba: np.ndarray) -> None:
    mesh.attributes[name].data.foreach_set("color", rgba.ravel())
    mesh.update_tag()


def _show(mesh: bpy.types.Mesh, viewport: str, render: str) -> None:
    """Choose the colour layers that the viewport and the render show, by name: indices shift with the layers."""
    mesh.attributes.active_color_name = viewport
    mesh.attributes.default_color_name = render


def remove_attribute(mesh: bpy.types.Mesh, name: str) -> None:
    """Remove the attribute of that name, which the mesh has."""
    mesh.attributes.remove(mesh.attributes[name])
    mesh.update_tag()
