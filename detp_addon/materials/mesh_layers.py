"""Layers of the meshes whose materials use baked light: some are missing, and some stand in the way."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack

import bpy
import numpy as np

from ..wording import counted, some
from ..writing.baked_layers import LOOK, WHITE, light_of, look_of, remove_layer
from ..writing.write_attributes import MeshColours, element_count, obstacle, write_layers


def whiten(materials: set[str], attribute: str, domain: str) -> list[str]:
    """Give white light to other meshes with the same materials, which would be black without any; notes on it."""
    lit, dark, seen = [], [], set()
    for obj in bpy.data.objects:
        if obj.type != "MESH" or obj.data in seen or attribute in obj.data.color_attributes:
            continue
        if not any(material.name in materials for material in materials_of(obj)):
            continue
        seen.add(obj.data)
        (dark if obstacle(obj, attribute, domain) else lit).append(obj)
    with ExitStack() as undo:
        for obj in lit:
            white = np.ones((element_count(obj.data, domain), 3))
            write_layers(MeshColours(obj, {attribute: white}, {"quantity": WHITE}), domain, None, undo)
        undo.pop_all()
    notes = []
    if lit:
        notes.append(
            f"{counted(len(lit), 'object')} with the same materials but without baked light got white light, so that "
            f"they are not black: {some([obj.name for obj in lit])}."
        )
    if dark:
        notes.append(
            f"{counted(len(dark), 'object')} with the same materials can hold no light and turn black: "
            f"{some([obj.name for obj in dark])}."
        )
    return notes


def drop_looks(objects: Sequence[bpy.types.Object], attribute: str) -> None:
    """Materials show the look by themselves, and a layer less goes into exports."""
    look = look_of(attribute)
    for obj in objects:
        mesh, layers = obj.data, obj.data.attributes
        if (
            mesh.library is None
            and not mesh.is_editmode
            and look in layers
            and light_of(mesh, look)["quantity"] == LOOK
        ):
            shown = [
                attribute if name == look else name for name in (layers.active_color_name, layers.default_color_name)
            ]
            remove_layer(mesh, look)
            layers.active_color_name, layers.default_color_name = shown


def materials_of(obj: bpy.types.Object) -> list[bpy.types.Material]:
    """The materials in an object's slots."""
    return [slot.material for slot in obj.material_slots if slot.material is not None]


def modifiers_materials(objects: Sequence[bpy.types.Object]) -> list[str]:
    """The names of those of the ``objects`` to which geometry nodes give materials that are in none of their slots."""
    objects = [obj for obj in objects if any(modifier.type == "NODES" for modifier in obj.modifiers)]
    graph = bpy.context.evaluated_depsgraph_get() if objects else None
    return [
        obj.name
        for obj in objects
        if {each.original for each in obj.evaluated_get(graph).data.materials if each is not None}
        - set(materials_of(obj))
    ]
