"""What face corners see of each other, and of the middles of their faces, past the surfaces that touch them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.group_sums import group_means
from ...core.rays import RayCaster
from ...core.triangles import angles_between, dots, normals_and_areas
from .estimation_points import CornerPoints
from .joined_rows import numbered, starts_of
from .read_meshes import MeshSurface
from .triangle_geometry import determinants, safe_unit

#: how far from its vertex a corner looks around, as a share of the way to the middle of its triangles
_ASIDE = 0.002

#: the least of it in tolerances of the rays, if that is no more than this share of the way, and at any rate
_LEAST, _MOST_ASIDE, _LEAST_ASIDE = 128, 0.06, 8

#: Surfaces are drawn back behind themselves by this share of their height as triangles at most. What lies within so
#: many times as far of one touches it.
_DRAWN_BACK, _TOUCHING = 0.01, 3

#: the places from which triangles look for their corners, in sixths of their vertices: the middle, and half-way between
#: it and the vertices, lest a mere post hides a corner
_LOOKS = ((2, 2, 2), (4, 1, 1), (1, 4, 1), (1, 1, 4))

#: the least weight of a triangle, as an angle in radians
_LEAST_ANGLE = 1e-6

#: a corner is a vertex of a triangle when it is nearer to it than this share of the triangle's longer edge there
_SAME_PLACE = 1e-4


@dataclass(frozen=True)
class Corners:
    """The face corners of all objects: C corners, N points, P pairs of a corner and a triangle that shows its colour.

    rows      (C,) the point of each corner, -1 for none, and vertices (C,), both counted through all objects
    centres   (N, 3) metres; normals (N, 3) unit
    pairs     (P,) the corner of each pair; triangles (P, 3, 3) the vertices of its triangle in the world, metres
    facing    (C, 3) mean unit normals of each corner's triangles, by their winding
    inward    (C, 3) metres, from each corner across its triangles, half-way between their edges
    angles    (C,) between those, in radians
    """

    rows: np.ndarray
    vertices: np.ndarray
    centres: np.ndarray
    normals: np.ndarray
    pairs: np.ndarray
    triangles: np.ndarray
    facing: np.ndarray
    inward: np.ndarray
    angles: np.ndarray

    @staticmethod
    def joined(points: list[CornerPoints], surfaces: list[MeshSurface]) -> Corners:
        """All corners of objects that have these ``points`` on these ``surfaces``."""
        none = CornerPoints(
            *np.zeros((2, 0), np.int64), *np.zeros((2, 0, 3)), *np.zeros((2, 0), np.int64), np.zeros((0, 3), np.int64),
            np.eye(4), False,
        )  # fmt: skip
        points = points or [none]
        triangles = [np.zeros((0, 3, 3))]
        for part, surface in zip(points, surfaces, strict=False):
            placed = surface.vertices @ part.matrix[:3, :3].T + part.matrix[:3, 3]
            shown = placed[surface.triangles[part.triangles]]
            triangles.append(shown[:, ::-1] if determinants(part.matrix[None])[0] < 0 else shown)
        rows = numbered([part.rows for part in points], starts_of([len(part.centres) for part in points]))
        rows[np.concatenate([part.rows for part in points]) < 0] = -1
        counts = [part.vertices.max(initial=-1) + 1 for part in points]
        vertices = numbered([part.vertices for part in points], starts_of(counts))
        pairs = numbered([part.corners for part in points], starts_of([len(part.rows) for part in points]))
        centres, normals = (np.concatenate([getattr(part, name) for part in points]) for name in ("centres", "normals"))
        triangles = np.concatenate(triangles)
        known = np.flatnonzero(rows[pairs] >= 0)
        pairs, triangles = pairs[known], triangles[known]
        bisectors, angles = _bisectors(triangles, centres[rows[pairs]])
        inward, _ = group_means(bisectors, pairs, len(rows), angles)
        total = np.bincount(pairs, angles, len(rows))
        facing, _ = group_means(normals_and_areas(triangles)[0], pairs, len(rows), angles)
        return Corners(rows, vertices, centres, normals, pairs, triangles, facing, inward, total)


class Neighbourhood:
    """Looks around from just inside the faces of ``corners``, among surfaces with these vertices (T, 3, 3)."""

    def __init__(self, corners: Corners, surfaces: np.ndarray):
        self._corners = corners
        self._facing, areas = normals_and_areas(surfaces)
        longest = np.linalg.norm(np.roll(surfaces, -1, axis=1) - surfaces, axis=2).max(axis=1)
        heights = np.divide(2.0 * areas, longest, out=np.zeros_like(areas), where=longest > 0)
        self._caster = RayCaster(surfaces, corners.centres, _DRAWN_BACK * heights)

    def covered(self) -> np.ndarray:
        """Whether (C,) the face of each corner lies against the front of another one."""
        rows = np.flatnonzero(self._corners.rows >= 0)
        normals, aside, _ = self._aside(rows)
        met, distance = self._looks(aside, normals)
        against = (met >= 0) & (distance < _TOUCHING * self._caster.drawn_back(met, aside))
        result = np.zeros(len(self._corners.rows), bool)
        result[rows] = against & (dots(self._facing[met], normals) < -0.5)
        return result

    def apart(self, rows: np.ndarray, way: np.ndarray) -> np.ndarray:
        """Those of the corners ``rows`` from which a surface hides the next one with the same point.

        They look from where they were moved to by the ``way`` (C, 3) m.
        """
        rows = rows[np.argsort(self._corners.rows[rows], kind="stable")]
        starts = np.flatnonzero(np.diff(self._corners.rows[rows], prepend=-1))
        following = np.arange(1, len(rows) + 1)
        following[np.append(starts[1:], len(rows))[: len(starts)] - 1] = starts
        several = np.flatnonzero(following != np.arange(len(rows)))
        normals, aside, steps = self._aside(rows)
        lifted = aside + way[rows] + steps[:, None] * normals
        across = lifted[following[several]] - lifted[several]
        directions, moves = safe_unit(across)
        hidden = self._caster.occluded(lifted[several], directions, np.sqrt(dots(across, across))) & moves
        return rows[several[hidden]]

    def behind(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """How far (C,) each corner lies behind something as seen from its triangles, as a share of the way there from
        their middles, 0 where one of them sees it; the way (C, 3) m from the corner to where the free part of its face
        begins, and the unit normal (C, 3) of what ends it there.
        """
        corners = self._corners
        pairs = np.arange(len(corners.pairs))
        for weights in _LOOKS:
            starts = np.einsum("c,pcx->px", np.array(weights) / 6, corners.triangles[pairs])
            met, left = self._ends_before(pairs, starts)
            if weights == _LOOKS[0]:
                first_met, first_left = met, left
            pairs = pairs[met >= 0]
        unseen, shown = (np.bincount(corners.pairs[rows], minlength=len(corners.rows)) for rows in (pairs, slice(None)))
        # Of several triangles the one that shows most tells where the free part begins.
        pairs = pairs[np.argsort(-first_left[pairs], kind="stable")]
        pairs = pairs[(unseen == shown)[corners.pairs[pairs]]]
        rows, left = corners.pairs[pairs], first_left[pairs]
        share, way, facing = np.zeros(len(corners.rows)), *np.zeros((2, len(corners.rows), 3))
        share[rows], facing[rows] = left, self._facing[first_met[pairs]]
        way[rows] = left[:, None] * (corners.triangles[pairs].mean(axis=1) - corners.centres[corners.rows[rows]])
        return share, way, facing

    def _ends_before(self, pairs: np.ndarray, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The surface (K,), -1 for none, whose front ends the way from ``starts`` (K, 3), on the triangles of ``pairs``
        (K,), to their corners, and the share (K,) of the way that is left there.
        """
        rows = self._corners.pairs[pairs]
        centres = self._corners.centres[self._corners.rows[rows]]
        normals, aside, steps = self._aside(rows)
        flat, _ = normals_and_areas(self._corners.triangles[pairs])
        # Along the triangle itself, not by its corner's normal, which may lead through a bent surface.
        lift = steps[:, None] * np.copysign(1.0, dots(flat, normals))[:, None] * flat
        directions, _ = safe_unit(aside - starts)
        met, distance = self._looks(starts + lift, directions)
        before = distance**2 < dots(aside - starts, aside - starts)
        ends = before & (met >= 0) & (dots(self._facing[met], directions) < 0)
        way = np.sqrt(dots(centres - starts, centres - starts))
        return np.where(ends, met, -1), 1.0 - distance / np.where(way > 0, way, 1.0)

    def _aside(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The normals (K, 3) of corners, places (K, 3) just inside their faces, and how far (K,) that is."""
        points, inward = self._corners.rows[rows], self._corners.inward[rows]
        directions, _ = safe_unit(inward)
        length = np.sqrt(dots(inward, inward))
        centres = self._corners.centres[points]
        tolerance = self._caster.tolerance(centres)
        least = np.maximum(np.minimum(_LEAST * tolerance, _MOST_ASIDE * length), _LEAST_ASIDE * tolerance)
        steps = np.minimum(np.maximum(_ASIDE * length, least), 0.5 * length)
        return self._corners.normals[points], centres + steps[:, None] * directions, steps

    def _looks(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The surface (K,) that each ray meets first, -1 for none, and how far away (K,) it is."""
        hits = self._caster.first_hits(origins, directions)
        away = hits.points - origins
        return hits.triangle, np.sqrt(dots(away, away))


def _bisectors(triangles: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What leads (P, 3) from ``corners`` (P, 3) of ``triangles`` (P, 3, 3) half-way between the edges to the opposite
    one, and the angle (P,) there; for places inside a triangle, to its middle.
    """
    away = triangles - corners[:, None]
    lengths = np.sqrt(np.einsum("pcx,pcx->pc", away, away))
    own, pairs = lengths.argmin(axis=1), np.arange(len(triangles))
    (first, a), (second, b) = ((away[pairs, (own + k) % 3], lengths[pairs, (own + k) % 3]) for k in (1, 2))
    # The bisector meets the opposite edge at parts that are to each other as the edges beside it.
    total = np.where(a + b > 0, a + b, 1.0)[:, None]
    bisectors = (b[:, None] * first + a[:, None] * second) / total
    angles = np.maximum(angles_between(first, second), _LEAST_ANGLE)
    inside = lengths[pairs, own] > _SAME_PLACE * np.maximum(a, b)
    return np.where(inside[:, None], triangles.mean(axis=1) - corners, bisectors), np.where(inside, 1.0, angles)
