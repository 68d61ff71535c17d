"""What face corners see of each other, and of the middles of their faces, past the surfaces that touch them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.bounds import Bounds
from ...core.rays import RELATIVE_TOLERANCE, RayCaster
from ...core.triangles import normals_and_areas
from .estimation_points import CornerPoints
from .read_meshes import MeshSurface
from .triangle_geometry import dots, safe_unit

#: how far from its vertex a corner looks around, as a share of the way to the middle of its triangles
_ASIDE = 0.01

#: the least of it, and the most distance of surfaces that touch, in tolerances of the rays
_LEAST = 32
_TOUCHING = 24

#: Surfaces are drawn back behind themselves by so many tolerances, so that two that lie exactly on each other have an
#: order. It must leave them within _TOUCHING.
_DRAWN_BACK = 8

#: A corner is cut off when less than this share of the way from its triangles' middles is hidden.
_CUT_OFF = 0.5

#: the places from which triangles look for their corners, in sixths of their vertices, and the share of the way from
#: there that may be hidden: the middle, and half-way between it and the vertices, lest a mere post hides a corner
_LOOKS = (((2, 2, 2), _CUT_OFF), ((4, 1, 1), 1.0), ((1, 4, 1), 1.0), ((1, 1, 4), 1.0))


@dataclass(frozen=True)
class Corners:
    """The face corners of all objects: C corners, N points, P pairs of a corner and a triangle that shows its colour.

    rows      (C,) the point of each corner, -1 for none, and vertices (C,), both counted through all objects
    centres   (N, 3) metres; normals (N, 3) unit
    pairs     (P,) the corner of each pair; triangles (P, 3, 3) the vertices of its triangle in the world, metres
    inward    (C, 3) metres, from each corner to the middle of its triangles
    """

    rows: np.ndarray
    vertices: np.ndarray
    centres: np.ndarray
    normals: np.ndarray
    pairs: np.ndarray
    triangles: np.ndarray
    inward: np.ndarray

    @staticmethod
    def joined(points: list[CornerPoints], surfaces: list[MeshSurface]) -> Corners:
        """All corners of objects that have these ``points`` on these ``surfaces``."""
        none = np.zeros(0, np.int64)
        columns = [(none, none, np.zeros((0, 3)), np.zeros((0, 3)), none, np.zeros((0, 3, 3)))]
        row = vertex = corner = 0
        for part, surface in zip(points, surfaces, strict=True):
            rows = np.where(part.rows >= 0, part.rows + row, -1)
            placed = surface.vertices @ part.matrix[:3, :3].T + part.matrix[:3, 3]
            triangles = placed[surface.triangles[part.triangles]]
            columns.append((rows, part.vertices + vertex, part.centres, part.normals, part.corners + corner, triangles))
            row, corner = row + len(part.centres), corner + len(part.rows)
            vertex += int(part.vertices.max(initial=-1)) + 1
        rows, vertices, centres, normals, pairs, triangles = map(np.concatenate, zip(*columns, strict=True))
        known = np.flatnonzero(rows[pairs] >= 0)
        pairs, triangles = pairs[known], triangles[known]
        inward = means(triangles.mean(axis=1) - centres[rows[pairs]], pairs, len(rows))
        return Corners(rows, vertices, centres, normals, pairs, triangles, inward)


class Neighbourhood:
    """Looks around from just inside the faces of ``corners``, among surfaces with these vertices (T, 3, 3)."""

    def __init__(self, corners: Corners, surfaces: np.ndarray):
        self._corners = corners
        self._tolerance = RELATIVE_TOLERANCE * Bounds.of(surfaces.reshape(-1, 3)).radius
        self._facing, _ = normals_and_areas(surfaces)
        self._caster = RayCaster(surfaces - _DRAWN_BACK * self._tolerance * self._facing[:, None])

    def covered(self) -> np.ndarray:
        """Whether (C,) the face of each corner lies against the front of another one."""
        rows = np.flatnonzero(self._corners.rows >= 0)
        normals, aside, _ = self._aside(rows, self._corners.inward[rows])
        met, distance = self._looks(aside, normals)
        against = (met >= 0) & (distance < _TOUCHING * self._tolerance)
        result = np.zeros(len(self._corners.rows), bool)
        result[rows] = against & (dots(self._facing[met], normals) < -0.5)
        return result

    def apart(self, rows: np.ndarray) -> np.ndarray:
        """Those of the corners ``rows`` from which a surface hides the next one with the same point."""
        rows = rows[np.argsort(self._corners.rows[rows], kind="stable")]
        starts = np.flatnonzero(np.diff(self._corners.rows[rows], prepend=-1))
        following = np.arange(1, len(rows) + 1)
        following[np.append(starts[1:], len(rows))[: len(starts)] - 1] = starts
        several = np.flatnonzero(following != np.arange(len(rows)))
        normals, aside, steps = self._aside(rows, self._corners.inward[rows])
        lifted = aside + steps[:, None] * normals
        way = lifted[following[several]] - lifted[several]
        directions, moves = safe_unit(way)
        hidden = self._caster.occluded(lifted[several], directions, np.sqrt(dots(way, way))) & moves
        return rows[several[hidden]]

    def cut_off(self) -> np.ndarray:
        """Whether (C,) no triangle of each corner sees it, although most of the way from their middles is free."""
        corners = self._corners
        pairs = np.arange(len(corners.pairs))
        for weights, share in _LOOKS:
            starts = np.einsum("c,pcx->px", np.array(weights) / 6, corners.triangles[pairs])
            pairs = pairs[self._end_before(pairs, starts, share)]
        shown = np.bincount(corners.pairs, minlength=len(corners.rows))
        hidden = np.bincount(corners.pairs[pairs], minlength=len(corners.rows))
        return (shown > 0) & (hidden == shown)

    def _end_before(self, pairs: np.ndarray, starts: np.ndarray, share: float) -> np.ndarray:
        """Whether a front ends the ways from ``starts`` (K, 3), on the triangles of ``pairs`` (K,), to their corners,
        with less than this ``share`` of the way left.
        """
        rows, triangles = self._corners.pairs[pairs], self._corners.triangles[pairs]
        inward = triangles.mean(axis=1) - self._corners.centres[self._corners.rows[rows]]
        normals, aside, steps = self._aside(rows, inward)
        flat, _ = normals_and_areas(triangles)
        # Along the triangle itself, not by its corner's normal, which may lead through a bent surface.
        lift = steps[:, None] * np.copysign(1.0, dots(flat, normals))[:, None] * flat
        directions, _ = safe_unit(aside - starts)
        met, distance = self._looks(starts + lift, directions)
        way = np.sqrt(dots(aside - starts, aside - starts))
        fronts = (met >= 0) & (dots(self._facing[met], directions) < 0)
        return fronts & (distance < way) & (distance > (1 - share) * way)

    def _aside(self, rows: np.ndarray, inward: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The normals (K, 3) of corners, places (K, 3) a little ``inward`` (K, 3) of them, and how far (K,) that is."""
        points = self._corners.rows[rows]
        directions, _ = safe_unit(inward)
        length = np.sqrt(dots(inward, inward))
        steps = np.minimum(np.maximum(_ASIDE * length, _LEAST * self._tolerance), 0.5 * length)
        return self._corners.normals[points], self._corners.centres[points] + steps[:, None] * directions, steps

    def _looks(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The surface (K,) that each ray meets first, -1 for none, and how far away (K,) it is."""
        hits = self._caster.first_hits(origins, directions)
        away = hits.points - origins
        return hits.triangle, np.sqrt(dots(away, away))


def means(values: np.ndarray, groups: np.ndarray, count: int) -> np.ndarray:
    """Mean (count, 3) of the ``values`` (K, 3) of each of the ``groups`` (K,), zero where it has none."""
    sums = [np.bincount(groups, values[:, axis], count) for axis in range(3)]
    return np.stack(sums, axis=1) / np.maximum(np.bincount(groups, minlength=count), 1)[:, None]
