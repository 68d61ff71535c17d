"""What a glTF export of meshes with baked light would lose, for Blender's own exporter."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from ..reading.read_node_graph import trees_within
from ..wording import counted, some
from .marked_nodes import NODE_MARK
from .mesh_layers import materials_of

_PAINT = ("ShaderNodeVertexColor", "ShaderNodeAttribute")


def gltf_notes(baked: Sequence[bpy.types.Object], painted: Sequence[str]) -> list[str]:
    """Notes on the ``baked`` objects, and on the ``painted`` materials, by name, whose paint light replaces."""
    notes = []
    if painted:
        notes.append(
            f"A glTF file has room for the light or the paint of a material, not for both: {some(painted)}. "
            f"Bake 'shaded' to have both in one."
        )
    bare = [obj.name for obj in baked if not materials_of(obj)]
    if bare:
        notes.append(
            f"{counted(len(bare), 'object')} without material: {some(bare)}. A glTF file has their light, cut at 1."
        )
    gaps = [obj.name for obj in baked if obj.name not in bare and _faces_without_material(obj)]
    if gaps:
        notes.append(
            f"{counted(len(gaps), 'object')} with some faces without material: {some(gaps)}. Give them one: renders do "
            f"not show their light, and glTF files of newer Blenders lack it."
        )
    return notes + _spoilt_exports(baked)


def has_paint(material: bpy.types.Material) -> bool:
    """Whether nodes of the material itself ask for colours of the mesh."""
    return any(
        node.bl_idname in _PAINT and NODE_MARK not in node
        for tree in trees_within(material.node_tree)
        for node in tree.nodes
    )


def _faces_without_material(obj: bpy.types.Object) -> bool:
    """Whether faces lie in an empty material slot; numbers above the last slot mean the last."""
    empty = [number for number, slot in enumerate(obj.material_slots) if slot.material is None]
    if not empty:
        return False
    numbers = np.empty(len(obj.data.polygons), np.int32)
    obj.data.polygons.foreach_get("material_index", numbers)
    return bool(np.isin(np.clip(numbers, 0, len(obj.material_slots) - 1), empty).any())


def _spoilt_exports(objects: Sequence[bpy.types.Object]) -> list[str]:
    """A note where this Blender's glTF exporter turns light white: 5.2.2 does on meshes with another colour layer."""
    if not (5, 2, 0) <= bpy.app.version <= (5, 2, 2):
        return []
    names = [obj.name for obj in objects if len(obj.data.color_attributes) > 1 and obj.material_slots]
    if not names:
        return []
    return [
        f"The glTF exporter of Blender 5.2.0 to 5.2.2 turns the light white on {counted(len(names), 'object')} with "
        f"more than one colour layer ({some(names)}): switch off its 'Export All Vertex Colors', or take a later one."
    ]
