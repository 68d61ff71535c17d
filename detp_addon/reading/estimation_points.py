"""Places the estimation points: where irradiance is wanted for each face corner of a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import bpy
import numpy as np

from ...core.triangles import dots
from .joined_rows import batches, numbered, starts_of
from .nearest_surface import nearest_places
from .read_attributes import face_sizes, stored_normals
from .read_meshes import MeshSurface, corner_triangles, corner_vertex_indices, vertex_positions
from .recalled import recalled_each
from .surface_normals import corner_normals, face_directions
from .triangle_geometry import normal_matrices, safe_unit, weights_within

#: steps into which a normal's components are cut when corners with equal normals are put together
_STEPS = 1 << 19

#: modifiers that keep the vertices they are given as the first ones of their result
_KEEPS_VERTICES = {
    *("SUBSURF", "MULTIRES", "SOLIDIFY", "ARRAY", "MIRROR", "EDGE_SPLIT", "TRIANGULATE"),
    *("WEIGHTED_NORMAL", "NORMAL_EDIT", "DATA_TRANSFER", "UV_PROJECT", "UV_WARP"),
}

#: modifiers that only move vertices
_MOVES_VERTICES = {
    *("ARMATURE", "CAST", "CURVE", "DISPLACE", "HOOK", "LAPLACIANDEFORM", "LATTICE", "MESH_DEFORM", "SHRINKWRAP"),
    *("SIMPLE_DEFORM", "SMOOTH", "CORRECTIVE_SMOOTH", "LAPLACIANSMOOTH", "SURFACE_DEFORM", "WARP", "WAVE", "CLOTH"),
}


@dataclass(frozen=True)
class CornerPoints:
    """The estimation points of one mesh object, in world space; corners of one vertex and one normal share a point.

    vertices   (C,) the vertex of each face corner of the original mesh
    rows       (C,) the point of each corner, -1 for none
    centres    (N, 3) metres; normals (N, 3) unit
    corners    (P,) and triangles (P,): which triangles of the evaluated surface show the colour of which corner
    faces      (F, 3) the corners of each triangle of the original mesh
    matrix     (4, 4) takes the surface to the world
    nearest    whether modifiers changed the mesh, so that points are the nearest ones of the surface
    """

    vertices: np.ndarray
    rows: np.ndarray
    centres: np.ndarray
    normals: np.ndarray
    corners: np.ndarray
    triangles: np.ndarray
    faces: np.ndarray
    matrix: np.ndarray
    nearest: bool


@dataclass(frozen=True)
class PlacedMesh:
    """An object, its mesh ``evaluated`` after modifiers, the row of its surface, and what takes that to the world."""

    object: bpy.types.Object
    evaluated: bpy.types.Mesh
    surface: int
    matrix: np.ndarray


def place_points(objects: list[PlacedMesh], surfaces: list[MeshSurface]) -> list[CornerPoints]:
    """Points for the face corners of the original mesh of each of ``objects``, whose evaluated ones are ``surfaces``.

    A corner of a mesh whose corners modifiers kept is where they put it; otherwise it is the nearest place of the
    surface. Corners without a direction (faces without area) have no point.
    """
    found = []
    for some in batches([len(placed.object.data.loops) for placed in objects]):
        found += _placed(objects[some], surfaces)
    return found


def _placed(objects: list[PlacedMesh], surfaces: list[MeshSurface]) -> list[CornerPoints]:
    """The same of a few objects, all at once."""
    own = _own_corners(objects, surfaces)

    def find(numbers: list[int]) -> list[CornerPoints]:
        return _found([objects[number] for number in numbers], [own[number] for number in numbers], surfaces)

    tell = [partial(_given, placed, surfaces[placed.surface], *each) for placed, each in zip(objects, own, strict=True)]
    return recalled_each(find, tell)


def _given(placed: PlacedMesh, surface: MeshSurface, vertices: np.ndarray, same: bool) -> tuple | None:
    """All that the points of an object follow from whose corners, of these ``vertices`` (C,), modifiers kept; else
    None."""
    if not same:
        return None
    mesh, faces = placed.evaluated, (surface.vertices, surface.at_corners, surface.triangles, surface.corners)
    normals = stored_normals(mesh) if surface.normals is None else surface.normals
    return "points", placed.matrix, vertices, *faces, surface.kept, normals, face_sizes(mesh), mesh.has_custom_normals


def _found(
    objects: list[PlacedMesh], own: list[tuple[np.ndarray, bool]], surfaces: list[MeshSurface]
) -> list[CornerPoints]:
    """The same of objects whose corners are their ``own`` ones."""
    facing = _facing([placed for placed, (_, same) in zip(objects, own, strict=True) if same], surfaces)
    turns = normal_matrices(np.stack([placed.matrix for placed in objects]))
    centres, normals, valid, shown = [], [], [], []
    for placed, (vertices, same), turn in zip(objects, own, turns, strict=True):
        if same:
            positions = surfaces[placed.surface].vertices[surfaces[placed.surface].at_corners]
            directions, known, corners, triangles = facing[placed.surface]
            faces = surfaces[placed.surface].corners[surfaces[placed.surface].kept]
        else:
            positions, directions, triangles = _on_changed_surface(placed, surfaces[placed.surface], vertices)
            known = triangles >= 0
            corners, triangles = np.flatnonzero(known), triangles[known]
            faces = corner_triangles(placed.object.data)
        centres.append(positions @ placed.matrix[:3, :3].T + placed.matrix[:3, 3])
        normals.append(directions @ turn.T)
        valid.append(known)
        shown.append((corners, triangles, faces, placed.matrix, not same))
    centres, (normals, directed) = np.concatenate(centres), safe_unit(np.concatenate(normals))
    valid = np.concatenate(valid) & directed & np.isfinite(centres).all(axis=1)
    firsts = starts_of([len(placed.object.data.vertices) for placed in objects])
    rows, first = _shared(numbered([vertices for vertices, _ in own], firsts), normals, valid)
    # Points are sorted by vertex, and so by object.
    corners = starts_of([len(vertices) for vertices, _ in own])
    owners = np.searchsorted(corners, first, side="right") - 1
    points = np.searchsorted(owners, np.arange(len(objects) + 1))
    centres, normals = centres[first], normals[first]
    result = []
    for number, ((vertices, _), parts) in enumerate(zip(own, shown, strict=True)):
        mine, here = rows[corners[number] : corners[number + 1]], slice(points[number], points[number + 1])
        mine = np.where(mine >= 0, mine - here.start, -1)
        result.append(CornerPoints(vertices, mine, centres[here], normals[here], *parts))
    return result


def _own_corners(objects: list[PlacedMesh], surfaces: list[MeshSurface]) -> list[tuple[np.ndarray, bool]]:
    """The vertices (C,) of the face corners of each original mesh, and whether modifiers kept these."""
    known = {}
    for placed in objects:
        key = placed.object.data, placed.surface
        if key not in known:
            original, surface = placed.object.data, surfaces[placed.surface]
            vertices = corner_vertex_indices(original)
            known[key] = vertices, _same_corners(original, vertices, placed.evaluated, surface)
    return [known[placed.object.data, placed.surface] for placed in objects]


def _facing(objects: list[PlacedMesh], surfaces: list[MeshSurface]) -> dict[int, tuple[np.ndarray, ...]]:
    """For each surface of the ``objects``, by its row: the normals (C, 3) of its face corners in its own space, which
    of them are valid (C,), and which corners (P,) show which triangles (P,).
    """
    meshes = {placed.surface: placed.evaluated for placed in objects}
    if not meshes:
        return {}
    shown = [surfaces[row] for row in meshes]
    ends = starts_of([len(surface.at_corners) for surface in shown])[1:-1]
    normals, valid = (np.split(whole, ends) for whole in corner_normals(list(meshes.values()), shown))
    triangles = [np.repeat(np.arange(len(surface.triangles)), 3) for surface in shown]
    corners = [surface.corners.ravel() for surface in shown]
    return dict(zip(meshes, zip(normals, valid, corners, triangles, strict=True), strict=True))


def _same_corners(original, vertices: np.ndarray, evaluated, surface: MeshSurface) -> bool:
    """Whether both meshes, whose corners have these ``vertices`` and those of the surface, have the same faces.

    Vertices may have been split, as Edge Split does.
    """
    counts = [(len(mesh.polygons), len(mesh.loops)) for mesh in (original, evaluated)]
    if counts[0] != counts[1] or len(vertices) == 0:
        return counts[0] == counts[1]
    source = np.full(surface.at_corners.max() + 1, -1)
    source[surface.at_corners] = vertices
    return np.array_equal(source[surface.at_corners], vertices)


def _on_changed_surface(placed: PlacedMesh, surface: MeshSurface, vertex_of: np.ndarray):
    """Positions, normals and triangles (-1 for none) of the corners on a surface that has other faces."""
    obj, original = placed.object, placed.object.data
    kinds = {modifier.type for modifier in obj.modifiers if modifier.show_render}
    kept = kinds <= _KEEPS_VERTICES | _MOVES_VERTICES and len(surface.vertices) >= len(original.vertices)
    before = surface.vertices[: len(original.vertices)] if kept else vertex_positions(original)
    turned = kept and (kinds & _MOVES_VERTICES or original.shape_keys is not None)
    wanted = stored_normals(original)
    if turned:
        # Bones have turned the surface, so the normals of the rest pose say nothing about it.
        wanted = np.zeros_like(wanted)
    # Corners that ask for the same place ask once.
    rows, first = _shared(vertex_of, wanted, np.ones(len(vertex_of), bool))
    triangles, places = nearest_places(surface, before[vertex_of[first]], wanted[first])
    found = triangles >= 0
    normals = np.zeros_like(places)
    normals[found] = _interpolated_normals(placed.evaluated, surface, triangles[found], places[found])
    return places[rows], normals[rows], triangles[rows]


def _interpolated_normals(mesh, surface: MeshSurface, triangles: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Normals (E, 3) at places on triangles, between those of the triangles' corners."""
    corners = surface.vertices[surface.triangles[triangles]]
    flat = face_directions(surface)[triangles]
    weights = weights_within(corners, flat, places)
    at_corners = stored_normals(mesh)[surface.corners[triangles]]
    smooth, valid = safe_unit(np.einsum("ek,eki->ei", weights, at_corners))
    agrees = valid & (dots(smooth, flat) > 0.0)
    return np.where(agrees[:, None], smooth, flat)


def _shared(vertex_of: np.ndarray, normals: np.ndarray, valid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Put corners of one vertex and one normal together: the row (C,) of each, -1 if invalid, and the rows' first
    corners (N,), sorted by vertex and normal.
    """
    chosen = np.flatnonzero(valid)
    steps = np.rint(np.nan_to_num(normals[chosen]) * _STEPS).astype(np.int64) + _STEPS
    key = (steps[:, 0] << 42) | (steps[:, 1] << 21) | steps[:, 2]
    order = np.lexsort((key, vertex_of[chosen]))
    vertex, key = vertex_of[chosen][order], key[order]
    starts = np.ones(len(order), bool)
    starts[1:] = (vertex[1:] != vertex[:-1]) | (key[1:] != key[:-1])
    rows = np.full(len(vertex_of), -1, np.int64)
    rows[chosen[order]] = np.cumsum(starts) - 1
    return rows, chosen[order[starts]]
