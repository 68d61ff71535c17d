"""Which face corner takes its light from which point, in view of the surfaces that touch it or stand before it.

Corners of one vertex and one normal share a point, as long as they see each other from just inside their faces. Where a
wall stands between them each gets a point of its own. A corner that lies behind another surface, while most of its face
lies in front of it, is moved to where the free part of the face begins: its own light would be that of another room.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.group_sums import group_means
from ...core.scene import Scene
from ...core.sides import any_side
from ...core.triangles import dots
from .corner_neighbourhood import Corners, Neighbourhood
from .estimation_points import CornerPoints
from .read_meshes import MeshSurface
from .triangle_geometry import sides_meant

#: Corners that lie behind something are moved in front of it, if less of the way from their faces' middles is hidden.
MOST_BEHIND = 0.5


@dataclass(frozen=True)
class SettledPoints:
    """The estimation points of all objects to bake.

    rows      for each object the point (C,) of each face corner, -1 for none
    centres   (N, 3) metres; normals (N, 3) unit, by which the points are shaded
    facing    (N, 3) unit normals of the triangles that show the point's colour
    inward    (N, 3) metres, from each point into the triangles that show its colour, away from their edges
    covered   (N,) whether another face lies against that of the point, or stands before it as seen from its middle: if
              the point is dark, the light of the face is not
    """

    rows: tuple[np.ndarray, ...]
    centres: np.ndarray
    normals: np.ndarray
    facing: np.ndarray
    inward: np.ndarray
    covered: np.ndarray


def settled_points(points: list[CornerPoints], surfaces: list[MeshSurface], scene: Scene, domain: str) -> SettledPoints:
    """The points of objects with these ``points`` and ``surfaces``, among everything that stands in ``scene``.

    With the ``domain`` POINT a vertex has one colour: its covered corners leave that to the others, and when half of
    its corners were moved, only those give it.
    """
    corners = Corners.joined(points, surfaces)
    rows, centres, inward = corners.rows.copy(), corners.centres[corners.rows], corners.inward
    covered, alone, moved = np.zeros((3, len(rows)), bool)
    behind = np.zeros(len(rows))
    opaque = ~any_side(scene.transmittance)
    if opaque.any():
        around = Neighbourhood(corners, scene.corners[opaque])
        (behind, way, facing), covered = around.behind(), around.covered()
        alone = _shares(corners.rows, around.apart(np.flatnonzero(rows >= 0), np.zeros_like(way)))
        # As long as one face around a vertex sees it, the others keep to it, too: no seam shall run between them.
        behind[~alone & _shares(corners.rows, np.flatnonzero((rows >= 0) & (behind == 0)))] = 0.0
        moved = (behind > 0) & (behind < MOST_BEHIND)
        way[~moved] = 0.0
        alone |= moved & _shares(corners.rows, around.apart(np.flatnonzero(moved), way))
        # On, away from what the corner lay behind, too.
        length = np.sqrt(dots(inward, inward))[:, None]
        centres, inward = centres + way, np.where(moved[:, None], 0.5 * (inward + length * facing), inward)
        if domain == "POINT":
            # Half of its faces see the vertex behind something: the others shall not light it for them.
            sides = np.bincount(corners.vertices, np.where(moved, 1, -1))
            rows[(sides[corners.vertices] >= 0) & ~moved] = -1
            rows[covered & _shares(corners.vertices, np.flatnonzero(~covered & (rows >= 0)))] = -1
        covered = (covered | (behind > 0)) & ~moved
    used = np.flatnonzero(rows >= 0)
    # Corners that were moved share the point of the one that was moved least.
    used = used[np.argsort(np.where(moved, behind, 0.0)[used], kind="stable")]
    shared = 3 * rows + np.where(moved, 2, covered)
    key = np.where(alone, 3 * len(corners.centres) + np.arange(len(rows)), shared)[used]
    _, first, rows[used] = np.unique(key, return_index=True, return_inverse=True)
    facing, inward = (
        group_means(part[used], rows[used], len(first), corners.angles[used])[0] for part in (corners.facing, inward)
    )
    first = used[first]
    normals = corners.normals[corners.rows[first]]
    ends = np.cumsum([len(part.rows) for part in points], dtype=np.int64)
    rows = tuple(np.split(rows, ends))[:-1]
    return SettledPoints(rows, centres[first], normals, sides_meant(facing, normals), inward, covered[first])


def _shares(groups: np.ndarray, members: np.ndarray) -> np.ndarray:
    """Whether each corner is in one of the ``groups`` (C,), -1 for none, that these ``members`` (K,) are in."""
    marked = np.zeros(groups.max(initial=-1) + 2, bool)
    marked[groups[members]] = True
    marked[-1] = False
    return marked[groups]
