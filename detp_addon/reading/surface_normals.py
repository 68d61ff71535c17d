"""Which way a mesh's face corners face, told apart from normals that only look valid."""

from __future__ import annotations

import numpy as np

from .read_attributes import face_sizes
from .read_meshes import MeshSurface, stored_normals
from .triangle_geometry import cross, dots, safe_unit

#: cosine below which a corner's normal does not belong to its face
_ASIDE = 0.01

#: cosine between a corner's normal and the mean direction of its vertex that makes the normal credible
_AGREES = 0.5

#: face directions whose sum is a smaller share than this of their lengths cancel out
_CANCELLED = 1e-6


def corner_normals(mesh, surface: MeshSurface) -> tuple[np.ndarray, np.ndarray]:
    """Normals (C, 3) of a mesh's face corners, and which are valid (C,).

    Blender gives every vertex a normal: its position where the faces around it cancel out, up where a face has no
    area. Here these count as what they are; where faces cancel out, each corner takes its own.
    """
    areas = _triangle_vectors(surface)
    size = len(surface.vertices)
    around, around_ok = _sums(areas, surface.triangles.ravel(), np.repeat(np.arange(len(areas)), 3), size)
    corner_face = np.repeat(np.arange(len(mesh.polygons)), face_sizes(mesh))
    vertex_of = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertex_of)
    faces, face_ok = _sums(areas, corner_face[surface.corners[:, 0]], np.arange(len(areas)), len(mesh.polygons))
    faces, face_ok = safe_unit(faces)[0][corner_face], face_ok[corner_face]
    around, around_ok = safe_unit(around)[0][vertex_of], around_ok[vertex_of]
    normals, stored = safe_unit(stored_normals(mesh))
    beside_face = face_ok & ((dots(normals, faces) > _ASIDE) | mesh.has_custom_normals)
    trusted = stored & (beside_face | (around_ok & (dots(normals, around) > _AGREES)))
    return np.where(trusted[:, None], normals, faces), trusted | face_ok


def face_directions(surface: MeshSurface) -> np.ndarray:
    """Unit normals (T, 3) of the triangles, zero where they have none."""
    return safe_unit(_triangle_vectors(surface))[0]


def _triangle_vectors(surface: MeshSurface) -> np.ndarray:
    """Normal times twice the area (T, 3) of each triangle, zero for those that are not kept."""
    corners = surface.vertices[surface.triangles]
    vectors = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.where(surface.kept[:, None], vectors, 0.0)


def _sums(vectors: np.ndarray, groups: np.ndarray, rows: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Sums (size, 3) of ``vectors[rows]`` over ``groups``, and where they do not cancel out."""
    sums = np.stack([np.bincount(groups, vectors[rows, axis], size) for axis in range(3)], axis=1)
    lengths = np.bincount(groups, _lengths(vectors)[rows], size)
    return sums, _lengths(sums) > _CANCELLED * lengths


def _lengths(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(dots(vectors, vectors))
