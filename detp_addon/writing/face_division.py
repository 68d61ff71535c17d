"""Divides faces over which light changes more than their vertices can show, and selects them."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np

from ..chosen_objects import objects_by_name
from ..reading.edit_mode import leave_edit_mode
from ..wording import counted, percent
from .lossy_faces import FacesByObject, LossyFaces

#: A division adds at most so many vertices for each that the objects have, but so many in any case.
MORE_VERTICES, LEAST_MORE = 3.0, 10_000

#: about how many vertices a face that is halved along each edge gets, which it shares with its neighbours
_NEW = 4


def divide_faces(lossy: LossyFaces) -> tuple[int, int]:
    """Halve the edges of faces, those first that show most light wrong, and return of how many faces and objects.

    Each becomes four; its neighbours get the new vertices into their edges and stay whole, so that no gap opens. UV
    maps, materials and other layers are kept. Objects that cannot be changed here are left out: those from libraries,
    and those that share a mesh.
    """
    have = sum(len(obj.data.vertices) for obj in _objects(lossy.by_object()))
    chosen = _objects(lossy.by_object(int(max(MORE_VERTICES * have, LEAST_MORE) / _NEW)))
    chosen = {obj: rows for obj, rows in chosen.items() if _changeable(obj)}
    leave_edit_mode(chosen)
    for obj, rows in chosen.items():
        _divide(obj.data, rows)
    return sum(map(len, chosen.values())), len(chosen)


def select_faces(faces: FacesByObject, context: bpy.types.Context) -> int:
    """Select these ``faces`` and their objects, and nothing else, ready for Edit Mode; returns how many faces."""
    leave_edit_mode(bpy.data.objects)
    chosen = {obj: rows for obj, rows in _objects(faces).items() if obj.name in context.view_layer.objects}
    for obj in context.view_layer.objects:
        obj.select_set(obj in chosen)
    count = 0
    for obj, rows in chosen.items():
        mesh, picked = obj.data, np.zeros(len(obj.data.polygons), bool)
        picked[rows[rows < len(picked)]] = True
        for elements in (mesh.vertices, mesh.edges):
            elements.foreach_set("select", np.zeros(len(elements), bool))
        mesh.polygons.foreach_set("select", picked)
        mesh.update()
        context.view_layer.objects.active = obj
        count += int(picked.sum())
    context.scene.tool_settings.mesh_select_mode = (False, False, True)
    return count


def division_note(divided: int, objects: int, before: float, after: float) -> str:
    """A sentence on what a division brought: the share of light that faces showed wrong ``before`` and ``after``."""
    return (
        f"{counted(divided, 'face')} of {counted(objects, 'object')} were divided where light changes: "
        f"faces show {percent(after)} of their light wrong, {percent(before)} before."
    )


def _objects(faces: FacesByObject) -> dict[bpy.types.Object, np.ndarray]:
    objects = objects_by_name()
    found = {objects.get(key): rows for key, rows in faces.items()}
    return {obj: rows for obj, rows in found.items() if obj is not None and obj.type == "MESH"}


def _changeable(obj: bpy.types.Object) -> bool:
    mesh = obj.data
    return mesh.users == 1 and not (obj.library or mesh.library or mesh.override_library)


def _divide(mesh: bpy.types.Mesh, rows: np.ndarray) -> None:
    work = bmesh.new()
    try:
        work.from_mesh(mesh)
        work.faces.ensure_lookup_table()
        edges = {edge for row in rows.tolist() if row < len(work.faces) for edge in work.faces[row].edges}
        bmesh.ops.subdivide_edges(work, edges=list(edges), cuts=1, use_grid_fill=True)
        work.to_mesh(mesh)
    finally:
        work.free()
    mesh.update()
