"""Places the estimation points: where irradiance is wanted for each face corner of a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .nearest_surface import nearest_places
from .read_meshes import MeshSurface, corner_triangles, corner_vertex_indices, stored_normals, vertex_positions
from .surface_normals import corner_normals, face_directions
from .triangle_geometry import cross, dots, normal_matrix, safe_unit

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


def place_points(obj, evaluated, surface: MeshSurface, matrix: np.ndarray) -> CornerPoints:
    """Points for the face corners of the original mesh of ``obj``.

    ``evaluated`` is its mesh after modifiers, read into ``surface``, and ``matrix`` (4, 4) takes it to the world.
    A corner of a mesh whose corners modifiers kept is where they put it; otherwise it is the nearest place of the
    surface. Corners without a direction (faces without area) have no point.
    """
    original = obj.data
    vertices = corner_vertex_indices(original)
    same = _same_corners(original, evaluated)
    if same:
        positions = surface.vertices[vertices]
        normals, valid = corner_normals(evaluated, surface)
        corners = surface.corners.ravel()
        triangles = np.repeat(np.arange(len(surface.triangles)), 3)
        faces = surface.corners[surface.kept]
    else:
        positions, normals, triangles = _on_changed_surface(obj, evaluated, surface, vertices)
        valid = triangles >= 0
        corners, triangles = np.flatnonzero(valid), triangles[valid]
        faces = corner_triangles(original)
    centres = positions @ matrix[:3, :3].T + matrix[:3, 3]
    normals, directed = safe_unit(normals @ normal_matrix(matrix).T)
    valid = valid & directed & np.isfinite(centres).all(axis=1)
    rows, first = _shared(vertices, normals, valid)
    return CornerPoints(vertices, rows, centres[first], normals[first], corners, triangles, faces, matrix, not same)


def _same_corners(original, evaluated) -> bool:
    """Whether the two meshes have the same faces made of the same vertices."""
    counts = [(len(mesh.vertices), len(mesh.loops), len(mesh.polygons)) for mesh in (original, evaluated)]
    return counts[0] == counts[1] and np.array_equal(*map(corner_vertex_indices, (original, evaluated)))


def _on_changed_surface(obj, evaluated, surface: MeshSurface, vertex_of: np.ndarray):
    """Positions, normals and triangles (-1 for none) of the corners on a surface that has other faces."""
    original = obj.data
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
    normals[found] = _interpolated_normals(evaluated, surface, triangles[found], places[found])
    return places[rows], normals[rows], triangles[rows]


def _interpolated_normals(mesh, surface: MeshSurface, triangles: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Normals (E, 3) at places on triangles, between those of the triangles' corners."""
    corners = surface.vertices[surface.triangles[triangles]]
    flat = face_directions(surface)[triangles]
    areas = [dots(cross(corners[:, (k + 1) % 3] - places, corners[:, (k + 2) % 3] - places), flat) for k in range(3)]
    weights = np.maximum(np.stack(areas, axis=1), 0.0)
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
