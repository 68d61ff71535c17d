"""Where points stand to look around: inside their own faces and just off them, whatever the radius of their discs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..parallel import ordered_map, slices
from ..rays import RayCaster
from ..rows import Rows
from ..triangles import normals_and_areas
from .enclosure import enclosed

#: Points look from as far off their faces as this share of a face's size, and on an edge from as far aside of it.
STEP = 0.002

#: But from no more than so many of the caster's tolerances, about 1/8192 of the distance from the middle of all, so
#: that points that stand in other geometry do not come out of it, and at least from so many.
MOST_STEP, LEAST_STEP = 256, 2

#: Where that least is more than this share of a face's size, its light is coarse.
COARSE = 0.1

#: Faces rise from a point when the way into them leads off its plane by more than this share of itself.
HOLLOW = 1e-3

#: A gap in front of a face is narrow when it is less than this share of the face's size.
NARROW = 0.1

#: Points whose rays are cast at a time.
POINTS_PER_CHUNK = 1 << 12


@dataclass(frozen=True)
class Standpoints(Rows):
    """Where N points look around from.

    origins   (N, 3) metres, where shadow rays start
    enclosed  (N,) whether the point looks at the insides of closed geometry (see enclosure.py)
    coarse    (N,) whether the point's face is so small that rounding, so far from the middle of all, tells in its light
    open      (N,) how well it can be seen, 0..1: little from within a gap that is narrow beside the point's face
    """

    origins: np.ndarray
    enclosed: np.ndarray
    coarse: np.ndarray
    open: np.ndarray


def standpoints(
    caster: RayCaster, points: np.ndarray, facing: np.ndarray, inward: np.ndarray | None = None
) -> Iterator[Standpoints]:
    """Find where ``points`` (N, 3) m on faces with unit normals ``facing`` (N, 3) can look around from, some at a time.

    ``inward`` (N, 3) metres leads from each point into its own faces, at most half of which it is moved along; zero
    where it need not be, None if nowhere.
    """

    def found(rows: slice) -> Standpoints:
        tolerance, ways = caster.tolerance(points[rows]), None if inward is None else inward[rows]
        size = _sizes(caster, points[rows], ways, facing[rows], tolerance)
        step = np.clip(STEP * size, LEAST_STEP * tolerance, MOST_STEP * tolerance)
        aside = moved(points[rows], ways, facing[rows], step)
        room = headroom_beside(caster, points[rows], ways, facing[rows], aside)
        off = np.minimum(step, 0.5 * room)
        origins = aside + off[:, None] * facing[rows]
        coarse = (size > 0) & (LEAST_STEP * tolerance > COARSE * size)
        wide = np.maximum(NARROW * size, LEAST_STEP * tolerance)
        return Standpoints(origins, enclosed(caster, origins, facing[rows]), coarse, np.minimum(room / wide, 1.0))

    yield from ordered_map(found, slices(len(points), POINTS_PER_CHUNK))


def plain_standpoints(caster: RayCaster, points: np.ndarray, facing: np.ndarray) -> Iterator[Standpoints]:
    """Just off the ``points`` (N, 3) themselves, and none of them enclosed: as the plain estimator takes them."""
    off = LEAST_STEP * caster.tolerance(points)
    yield Standpoints(points + off[:, None] * facing, *np.zeros((2, len(points)), bool), np.ones(len(points)))


def _sizes(caster: RayCaster, points, inward, facing, tolerance) -> np.ndarray:
    """Sizes (N,), metres, of the triangles that ``points`` (N, 3) lie on, or of the way ``inward``; 0 if unknown."""
    above = moved(points, inward, facing, np.full(len(points), caster.radius)) + tolerance[:, None] * facing
    hits = caster.first_hits(above, -facing, tolerance)
    _, areas = normals_and_areas(caster.corners[hits.triangle])
    ways = 0.0 if inward is None else np.linalg.norm(inward, axis=1)
    return np.where((hits.triangle >= 0) & (areas > 0), np.sqrt(2.0 * areas), ways)


def moved(points: np.ndarray, inward: np.ndarray | None, facing: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """The ``points`` (N, 3) moved ``inward`` (N, 3), None for nowhere, in the planes of their faces by a ``distance``
    (N,), but by half of each way at most.

    Where several faces share a point, much of the way leads out of its plane: into the solid from a rounded edge, off
    both walls from one between them. What is left of it in the plane counts for as little as it is of the whole.
    """
    if inward is None:
        return points
    within = inward - np.einsum("ij,ij->i", inward, facing)[:, None] * facing
    length = np.linalg.norm(inward, axis=1)
    return points + np.minimum(distance / np.maximum(length, distance), 0.5)[:, None] * within


def headroom_beside(
    caster: RayCaster, points: np.ndarray, inward: np.ndarray | None, facing: np.ndarray, aside: np.ndarray
) -> np.ndarray:
    """How far (N,) it is along ``facing`` to the next surface, from ``points`` and from where they stand ``aside``.

    From the point itself: in a hollow, where its own faces rise ``inward``, a point moved aside lies behind them before
    it is lifted, and they do not count. One moved aside in a wedge, or under something, has less room.
    """
    room = headroom(caster, points, facing)
    if inward is None:
        return room
    rising = np.einsum("ij,ij->i", inward, facing) > HOLLOW * np.linalg.norm(inward, axis=1)
    return np.minimum(room, headroom(caster, aside, facing, points, rising))


def headroom(
    caster: RayCaster,
    points: np.ndarray,
    facing: np.ndarray,
    own: np.ndarray | None = None,
    rising: np.ndarray | None = None,
) -> np.ndarray:
    """How far (N,) it is along ``facing`` to the next surface, at least twice what keeps clear of the own one.

    Where ``rising`` (N,), what is met from behind in a plane with the place ``own`` (N, 3) m does not count.
    """
    start = caster.tolerance(points)
    hits = caster.first_hits(points + start[:, None] * facing, facing)
    free = hits.triangle < 0
    if rising is not None:
        normals = caster.normals[hits.triangle]
        off = np.abs(np.einsum("ij,ij->i", normals, hits.points - own))
        free |= rising & (np.einsum("ij,ij->i", normals, facing) > 0) & (off < start)
    distance = np.linalg.norm(hits.points - points, axis=1)
    return np.where(free, np.inf, np.maximum(distance, 2 * start))
