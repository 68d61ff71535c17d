"""Divides faces over which light changes more than their vertices can show, and selects them."""

from __future__ import annotations

import math
from collections.abc import Iterable

import bmesh
import bpy
import numpy as np

from ..chosen_objects import objects_by_name
from ..reading.edit_mode import leave_edit_mode
from ..wording import counted, percent
from .lossy_faces import FacesByObject, LossyFaces

#: All divisions of a bake add at most so many vertices for each that the objects have, but so many in any case.
MORE_VERTICES, LEAST_MORE = 3.0, 10_000

#: about how many vertices a face that is halved along each edge gets, which it shares with its neighbours
_NEW = 4

#: A border that turns by less than so many radians goes straight on, and what lies so near to the middle of a side, as
#: a share of its length, is its middle.
STRAIGHT, NEARLY = 0.01, 0.1


def most_vertices(lossy: LossyFaces) -> int:
    """How many vertices divisions of these faces, and of what comes of them, may add."""
    return int(max(MORE_VERTICES * _vertices(_objects(lossy.by_object())), LEAST_MORE))


def divide_faces(lossy: LossyFaces, most: int) -> tuple[int, int, int]:
    """Halve the edges of faces, those first that show most light wrong, with about ``most`` vertices that are added.

    Each becomes four, or two if it is more than twice as long as wide, and so does each triangle of one that is no
    triangle or convex quad. Neighbours get the new vertices into their edges, so that no gap opens; triangles among
    them become two or more, others stay whole. UV maps, materials and other layers are kept.
    Objects that cannot be changed here are left out: those from libraries, and those that share a mesh. Returns how
    many faces of how many objects were divided, and how many vertices that added.
    """
    changeable = {key for key, obj in objects_by_name().items() if obj.type == "MESH" and _changeable(obj)}
    chosen = _objects(lossy.of_objects(changeable).by_object(most // _NEW))
    leave_edit_mode(chosen)
    before = _vertices(chosen)
    for obj, rows in chosen.items():
        _divide(obj.data, rows)
    return sum(map(len, chosen.values())), len(chosen), _vertices(chosen) - before


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
        f"Divided {counted(divided, 'face')} of {counted(objects, 'object')} where light changes: "
        f"faces show {percent(after)} of their light wrong, {percent(before)} before."
    )


def _vertices(objects: Iterable[bpy.types.Object]) -> int:
    return sum(len(obj.data.vertices) for obj in objects)


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
        faces = [work.faces[row] for row in rows.tolist() if row < len(work.faces)]
        odd = dict.fromkeys(face for face in faces if not _simple(face))
        whole, middles = [face for face in faces if face not in odd], []
        for face in whole + bmesh.ops.triangulate(work, faces=[*odd])["faces"]:
            middles += _parted(face)
        for face in dict.fromkeys(face for middle in middles for face in middle.link_faces):
            _without_line(face)
        work.to_mesh(mesh)
    finally:
        work.free()
    mesh.update()


def _corners(face: bmesh.types.BMFace) -> list[bmesh.types.BMLoop]:
    """Where the border of a face bends: at its other vertices it was a neighbour that was divided."""
    return [loop for loop in face.loops if loop.calc_angle() < math.pi - STRAIGHT]


def _simple(face: bmesh.types.BMFace) -> bool:
    """Whether a face is a triangle or a convex quad, however many vertices its sides have."""
    corners = _corners(face)
    return len(corners) == 3 or (len(corners) == 4 and all(loop.is_convex for loop in corners))


def _parted(face: bmesh.types.BMFace) -> list[bmesh.types.BMVert]:
    """Make four faces of a triangle or a quad, two of a long one, and return what lies in the middle of its sides."""
    corners = [loop.vert for loop in _corners(face)]
    if len(corners) not in (3, 4):  # a triangle that is a line
        return []
    sides = [*zip(corners, corners[1:] + corners[:1], strict=True)]
    lengths = [(end.co - start.co).length for start, end in sides]
    long = [length > 0.5 * max(lengths) for length in lengths]
    across = sum(long) == 2 and (len(sides) == 3 or long[0] == long[2])
    middles = [_halfway(face, *side) for side, counts in zip(sides, long, strict=True) if counts or not across]
    parts = [face]
    if across:
        ends = [middles]
    elif len(sides) == 3:
        ends = zip(middles, middles[1:] + middles[:1], strict=True)
    else:
        middle = _cut(parts, middles[0], middles[2])
        _, centre = bmesh.utils.edge_split(middle, middles[0], 0.5)
        ends = [(middles[1], centre), (centre, middles[3])]
    for one, other in ends:
        _cut(parts, one, other)
    return middles


def _without_line(face: bmesh.types.BMFace) -> None:
    """Make two triangles of one that has a fourth vertex on a side: Blender may show it as one and a line."""
    corners = _corners(face)
    if len(corners) == 3 and len(face.verts) == 4:
        lies = next(loop for loop in face.loops if loop not in corners)
        bmesh.utils.face_split(face, lies.vert, lies.link_loop_next.link_loop_next.vert)


def _halfway(face: bmesh.types.BMFace, start: bmesh.types.BMVert, end: bmesh.types.BMVert) -> bmesh.types.BMVert:
    """The vertex in the middle of the side of a face from one corner to the next, made if there is none."""
    loop = next(loop for loop in face.loops if loop.vert == start)
    length, before = max((end.co - start.co).length, 1e-30), 0.0
    while True:
        after = loop.link_loop_next
        passed = (after.vert.co - start.co).length / length
        if passed >= 0.5 - NEARLY or after.vert == end:
            break
        loop, before = after, passed
    if passed <= 0.5 + NEARLY and after.vert != end:
        return after.vert
    share = (0.5 - before) / (passed - before) if passed > before else 0.5
    return bmesh.utils.edge_split(loop.edge, loop.vert, share)[1]


def _cut(parts: list[bmesh.types.BMFace], one: bmesh.types.BMVert, other: bmesh.types.BMVert) -> bmesh.types.BMEdge:
    """A new edge between two vertices through that one of the ``parts`` of a face that has both."""
    part = next(part for part in parts if one in part.verts and other in part.verts)
    new, loop = bmesh.utils.face_split(part, one, other)
    parts.append(new)
    return loop.edge
