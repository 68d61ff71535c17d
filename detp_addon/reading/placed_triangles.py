"""Meshes as they stand in the world: the triangles of all of them, but those that have no area there; NumPy only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .joined_rows import numbered, starts_of
from .read_meshes import MeshSurface
from .triangle_geometry import determinants, has_area

#: an object whose volume scales by less than this share of its largest scale cubed may have lost triangles
_FLAT = 1e-6


@dataclass(frozen=True)
class Placement:
    """A mesh as it stands in the world: the row of its surface and the matrix (4, 4) that takes it there, in metres.

    ``diffuse`` and ``shadow``: whether such rays meet it. ``lightgroup``: that its emission belongs to, "" for none.
    """

    surface: int
    matrix: np.ndarray
    diffuse: bool = True
    shadow: bool = True
    lightgroup: str = ""


@dataclass(frozen=True)
class PlacedTriangles:
    """T triangles in the world.

    vertices   (V, 3) metres, and triangles (T, 3) of them, turned about on objects that are ``mirrored`` (P,)
    rows       (T,) which triangle it is of all surfaces, one after the other
    placement  (T,) which of the P placements it belongs to, ascending
    """

    vertices: np.ndarray
    triangles: np.ndarray
    rows: np.ndarray
    placement: np.ndarray
    mirrored: np.ndarray

    def taken(self, rows: np.ndarray) -> PlacedTriangles:
        """Some ``rows`` of the triangles alone."""
        return replace(self, triangles=self.triangles[rows], rows=self.rows[rows], placement=self.placement[rows])


def placed_triangles(surfaces: Sequence[MeshSurface], placements: Sequence[Placement]) -> PlacedTriangles:
    """The triangles of ``surfaces`` that are kept, at all their ``placements``."""
    none = np.zeros(0, np.int64)
    if not placements:
        return PlacedTriangles(np.zeros((0, 3)), np.zeros((0, 3), np.int64), none, none, np.zeros(0, bool))
    standing = [surfaces[placement.surface] for placement in placements]
    matrices = np.stack([placement.matrix for placement in placements])
    vertices = [
        surface.vertices @ matrix[:3, :3].T + matrix[:3, 3] for surface, matrix in zip(standing, matrices, strict=True)
    ]
    volumes = determinants(matrices)
    kept = [surface.kept for surface in standing]
    flat = np.abs(volumes) <= _FLAT * np.abs(matrices[:, :3, :3]).max(axis=(1, 2)) ** 3
    for number in np.flatnonzero(flat):
        kept[number] = kept[number] & has_area(vertices[number][standing[number].triangles])
    triangles = numbered([surface.triangles for surface in standing], starts_of(list(map(len, vertices))))
    first = starts_of([len(surface.triangles) for surface in surfaces])[[placement.surface for placement in placements]]
    counts = list(map(len, kept))
    kept = np.flatnonzero(np.concatenate(kept))
    placement = np.repeat(np.arange(len(placements)), counts)[kept]
    triangles, rows = triangles[kept], kept + (first - starts_of(counts)[:-1])[placement]
    # A mirrored object turns its triangles inside out.
    mirrored = ~(volumes >= 0.0)
    turned = mirrored[placement]
    triangles[turned] = triangles[turned, ::-1]
    return PlacedTriangles(np.concatenate(vertices), triangles, rows, placement, mirrored)
