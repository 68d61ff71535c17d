"""Which way a mesh's face corners face, told apart from normals that only look valid."""

from __future__ import annotations

import numpy as np

from ...core.group_sums import group_sums
from ...core.triangles import cross, dots
from .joined_rows import numbered, starts_of
from .read_attributes import face_sizes, stored_normals
from .read_meshes import MeshSurface
from .triangle_geometry import safe_unit

#: cosine below which a corner's normal does not belong to its face
_ASIDE = 0.01

#: cosine between a corner's normal and the mean direction of its vertex that makes the normal credible
_AGREES = 0.5

#: face directions whose sum is a smaller share than this of their lengths cancel out
_CANCELLED = 1e-6


def corner_normals(meshes: list, surfaces: list[MeshSurface]) -> tuple[np.ndarray, np.ndarray]:
    """Normals (C, 3) of the face corners of ``meshes``, one mesh after the other, and which are valid (C,).

    Blender gives every vertex a normal: its position where the faces around it cancel out, up where a face has no
    area. Here these count as what they are; where faces cancel out, each corner takes its own.
    """
    vertices = starts_of([len(surface.vertices) for surface in surfaces])
    corners = starts_of([len(surface.at_corners) for surface in surfaces])
    triangles = numbered([surface.triangles for surface in surfaces], vertices)
    kept = np.concatenate([surface.kept for surface in surfaces])
    areas = _triangle_vectors(np.concatenate([surface.vertices for surface in surfaces])[triangles], kept)
    around, around_ok = _sums(areas, triangles.ravel(), np.repeat(np.arange(len(areas)), 3), vertices[-1])
    sizes = np.concatenate([face_sizes(mesh) for mesh in meshes])
    corner_face = np.repeat(np.arange(len(sizes)), sizes)
    vertex_of = numbered([surface.at_corners for surface in surfaces], vertices)
    first = numbered([surface.corners[:, 0] for surface in surfaces], corners)
    faces, face_ok = _sums(areas, corner_face[first], np.arange(len(areas)), len(sizes))
    faces, face_ok = safe_unit(faces)[0][corner_face], face_ok[corner_face]
    around, around_ok = safe_unit(around)[0][vertex_of], around_ok[vertex_of]
    known = [stored_normals(mesh) if s.normals is None else s.normals for mesh, s in zip(meshes, surfaces, strict=True)]
    normals, stored = safe_unit(np.concatenate(known))
    custom = np.repeat([mesh.has_custom_normals for mesh in meshes], np.diff(corners))
    beside_face = face_ok & ((dots(normals, faces) > _ASIDE) | custom)
    trusted = stored & (beside_face | (around_ok & (dots(normals, around) > _AGREES)))
    return np.where(trusted[:, None], normals, faces), trusted | face_ok


def face_directions(surface: MeshSurface) -> np.ndarray:
    """Unit normals (T, 3) of the triangles, zero where they have none."""
    return safe_unit(_triangle_vectors(surface.vertices[surface.triangles], surface.kept))[0]


def _triangle_vectors(corners: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Normal times twice the area (T, 3) of triangles with these ``corners`` (T, 3, 3), zero unless ``kept`` (T,)."""
    vectors = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.where(kept[:, None], vectors, 0.0)


def _sums(vectors: np.ndarray, groups: np.ndarray, rows: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Sums (size, 3) of ``vectors[rows]`` over ``groups``, and where they do not cancel out."""
    sums = group_sums(vectors[rows], groups, size)
    lengths = np.bincount(groups, _lengths(vectors)[rows], size)
    return sums, _lengths(sums) > _CANCELLED * lengths


def _lengths(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(dots(vectors, vectors))
