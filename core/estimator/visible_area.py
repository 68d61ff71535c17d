"""The part of a tangent disc that its centre can see: what remains of it beside walls and inside hollows.

The plain estimator divides by the whole disc, of which a part may lie behind a wall: there it finds no light, or the
light of the other side. Here short rays within the tangent plane measure how far each disc reaches in each direction;
only crossings inside this outline count, and they are divided by its area. How much of the disc is used within the
outline, the crossings decide (nested_discs.py).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..discs import TangentDiscs
from ..gatherers.gatherer import Crossings
from ..parallel import ordered_map, slices
from ..rays import RayCaster
from ..rows import Rows
from ..sampling import frames
from ..segments import Segments
from .rings import OUTSIDE, nested_areas, offsets, outline_area, rings_of, whole_areas
from .standpoints import LEAST_STEP, POINTS_PER_CHUNK, headroom, headroom_beside, moved

if TYPE_CHECKING:
    from ..cluster.crew import Crew

#: Rays in the tangent plane. Neighbours are joined by straight lines, so a wall's outline is exact.
DIRECTIONS = 32

#: Points are moved into their own face, and discs lifted off it, by this share of the radius, so that a point on the
#: line where two walls meet is clearly in front of both.
NUDGE = 0.01

#: But by no more than so many of the caster's tolerances, about 1/2048 of the distance from the middle of the scene:
#: where a disc is as large as the scene, light does not come nearer by a hundredth of that.
MOST_NUDGE = 1024

#: Higher lifts, in radii, that are tried while each shows GAIN times the area of the one before: inside a hollow, where
#: the tangent plane lies behind the surface, a disc must be lifted by its sagitta.
LIFTS = (0.05, 0.2)
GAIN = 1.3

#: A higher lift is looked at in every so many of the directions first, and in all only if it gains so much there.
SPARSE, SPARSE_GAIN = 4, 1.15

#: Below this share of its disc a point counts as hidden: buried in other geometry or squeezed between surfaces.
SMALLEST_SHARE = 0.002


@dataclass(frozen=True)
class VisibleArea(Rows):
    """Outlines of N discs, DIRECTIONS distances each, seen from their centres.

    reach    (N, DIRECTIONS) metres, at equal angles from the disc's first frame vector
    nested   (N, K) m^2 inside the outline of each nested disc, see rings.py; whole where nothing stands in the way. Of
             the plain estimator's discs K is 1
    partial  (N,) whether anything does
    hidden   (N,) whether so little is left that the point has no light of its own
    """

    reach: np.ndarray
    nested: np.ndarray
    partial: np.ndarray
    hidden: np.ndarray

    @property
    def areas(self) -> np.ndarray:
        """Area (N,) m^2 inside the whole outline."""
        return self.nested[:, 0]

    def rings(self, discs: TangentDiscs, segments: Segments, crossings: Crossings) -> np.ndarray:
        """The ring (C,) of its disc in which each of the ``crossings`` lies, OUTSIDE of its outline that number."""
        if self.nested.shape[1] == 1:
            return np.zeros(len(crossings), np.uint8)
        offset = offsets(discs, segments, crossings)
        ring = rings_of(offset, discs.radii[crossings.disc])
        doubtful = np.flatnonzero(self.partial[crossings.disc])
        outside = self._outside(discs.normals, crossings.disc[doubtful], offset[doubtful])
        ring[doubtful[outside]] = OUTSIDE
        return ring

    def _outside(self, normals: np.ndarray, disc: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """Which places so far (P, 3) from the centres of discs ``disc`` (P,) lie outside of their outlines."""
        first, second = frames(normals[disc])
        x, y = (np.einsum("ij,ij->i", offset, axis) for axis in (first, second))
        sector = np.floor(np.arctan2(y, x) * (DIRECTIONS / (2 * np.pi))).astype(np.int64)
        ax, ay = _corner(self.reach, disc, sector)
        bx, by = _corner(self.reach, disc, sector + 1)
        return (bx - ax) * (y - ay) < (by - ay) * (x - ax)


@dataclass(frozen=True)
class VisibleDiscs(Rows):
    """N discs put in front of the surface, and what their centres see of them.

    discs  where crossings are counted; inside hollows lifted well off the surface
    area   the outlines of what their centres see
    """

    discs: TangentDiscs
    area: VisibleArea

    def told(self) -> tuple:
        """What tells all of them: of the outlines those alone that something stands in the way of."""
        area = self.area
        return self.discs, area.reach[area.partial], area.reach.shape[1], area.nested, area.partial, area.hidden

    @classmethod
    def of(cls, discs: TangentDiscs, reach, directions: int, nested, partial, hidden) -> VisibleDiscs:
        """Those of which that was told."""
        whole = np.repeat(discs.radii[:, None], directions, axis=1)
        whole[partial] = reach
        return cls(discs, VisibleArea(whole, nested, partial, hidden))

    def with_rows(self, rows: np.ndarray, others: VisibleDiscs) -> VisibleDiscs:
        """The same, with the discs of those ``rows`` (K,) replaced by ``others`` (K)."""
        order = np.arange(len(self.discs))
        order[rows] = len(order) + np.arange(len(rows))
        return VisibleDiscs.joined([self, others]).taken(order)


def visible_discs(
    caster: RayCaster,
    discs: TangentDiscs,
    inward: np.ndarray | None = None,
    every: int = 1,
    facing: np.ndarray | None = None,
) -> Iterator[VisibleDiscs]:
    """Put ``discs`` (N) in front of the surface and measure their outlines, some at a time.

    ``inward`` (N, 3) metres leads from each point into its own faces, at most half of which it is moved along; zero
    where it need not be, None if nowhere. Where time is short only every so many of the DIRECTIONS, 1 to SPARSE, may be
    looked in; the outline is straight between them. ``facing`` (N, 3) are the unit normals of the points' faces, from
    which discs are lifted; None: those of the discs.
    """
    facing = discs.normals if facing is None else facing
    tolerance = caster.tolerance(discs.centres)
    least = np.clip(NUDGE * discs.radii, LEAST_STEP * tolerance, MOST_NUDGE * tolerance)
    based = moved(discs.centres, inward, facing, least)

    def placed(rows: slice) -> VisibleDiscs:
        normals, radii, up = discs.normals[rows], discs.radii[rows], facing[rows]
        beside = None if inward is None else inward[rows]
        room = headroom_beside(caster, discs.centres[rows], beside, up, based[rows])
        ways = based[rows], up, normals, radii
        lifts, reach = _lifted(caster, *ways, np.minimum(least[rows], 0.5 * room), room, every)
        reach = _filled(reach, radii)
        partial = (reach < radii[:, None]).any(axis=1)
        nested, whole = nested_areas(reach, radii), whole_areas(radii)
        hidden = nested[:, 0] < SMALLEST_SHARE * whole[:, 0]
        lifted = TangentDiscs(based[rows] + lifts[:, None] * up, normals, radii)
        return VisibleDiscs(lifted, VisibleArea(reach, np.where(hidden[:, None], whole, nested), partial, hidden))

    yield from ordered_map(placed, slices(len(discs), POINTS_PER_CHUNK))


def placing(caster: RayCaster, crew: Crew | None = None) -> Callable[..., Iterator[VisibleDiscs]]:
    """What places discs: :func:`visible_discs` with this ``caster``, or the workers of a ``crew``."""
    return partial(visible_discs, caster) if crew is None else crew.visible_discs


def whole_discs(discs: TangentDiscs) -> Iterator[VisibleDiscs]:
    """The ``discs`` (N) as they are, seen as a whole: the plain estimator."""
    nowhere = np.zeros(len(discs), bool)
    area = VisibleArea(np.empty((len(discs), 0)), discs.areas[:, None], nowhere, nowhere)
    yield VisibleDiscs(discs, area)


def _lifted(caster, centres, up, normals, radii, least, room, every) -> tuple[np.ndarray, np.ndarray]:
    """The lift (N,), ``least`` or more, of each disc ``up`` (N, 3) and its outline there, through no surface."""
    lifts = least.copy()
    reach = _reach(caster, centres + lifts[:, None] * up, normals, radii, every)
    areas = outline_area(reach)
    rows = np.flatnonzero(areas < np.pi * radii**2 / GAIN)
    # From where the disc lies now, too: aside of a point in a wedge the other side is nearer.
    above = lifts[rows] + headroom(caster, centres[rows] + lifts[rows, None] * up[rows], up[rows])
    room = room.copy()
    room[rows] = np.minimum(room[rows], above)
    for share in LIFTS:
        rows = rows[share * radii[rows] < 0.5 * room[rows]]
        lifted = centres[rows] + share * radii[rows, None] * up[rows]
        higher = _reach(caster, lifted, normals[rows], radii[rows], SPARSE)
        gains = outline_area(higher) > SPARSE_GAIN * outline_area(reach[rows, :: SPARSE // every])
        rows, lifted, higher = rows[gains], lifted[gains], higher[gains]
        if every < SPARSE:
            higher = _reach(caster, lifted, normals[rows], radii[rows], every)
        gains = outline_area(higher) > GAIN * areas[rows]
        rows, higher = rows[gains], higher[gains]
        lifts[rows], reach[rows], areas[rows] = share * radii[rows], higher, outline_area(higher)
    return lifts, reach


def _reach(caster: RayCaster, origins, normals, radii, every: int) -> np.ndarray:
    """How far (N, DIRECTIONS / every) one sees within the tangent plane, up to the radius."""
    first, second = (axis[:, None] for axis in frames(normals))
    count = DIRECTIONS // every
    angle = (np.arange(count) * (2 * np.pi / count))[:, None]
    directions = (np.cos(angle) * first + np.sin(angle) * second).reshape(-1, 3)
    starts = np.repeat(origins, count, axis=0)
    hits = caster.first_hits(starts, directions, np.repeat(radii, count))
    away = hits.points - starts
    distance = np.sqrt(np.einsum("ij,ij->i", away, away)).reshape(-1, count)
    missed = hits.triangle.reshape(-1, count) < 0
    return np.where(missed, radii[:, None], np.minimum(distance, radii[:, None]))


def _filled(reach: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """The outlines ``reach`` (N, D) with all DIRECTIONS: between its corners straight, or round where nothing is."""
    every = DIRECTIONS // reach.shape[1]
    if every == 1:
        return reach
    following = np.roll(reach, -1, axis=1)
    free = np.minimum(reach, following) >= radii[:, None]
    filled = np.empty((len(reach), DIRECTIONS))
    filled[:, ::every] = reach
    whole = 2 * np.pi / reach.shape[1]
    for step in range(1, every):
        angle = step / every * whole
        # Where the ray at that angle meets the line between the two corners.
        width = reach * np.sin(angle) + following * np.sin(whole - angle)
        line = np.divide(reach * following * np.sin(whole), width, out=np.zeros_like(width), where=width > 0)
        filled[:, step::every] = np.where(free, radii[:, None], np.minimum(line, radii[:, None]))
    return filled


def _corner(reach: np.ndarray, disc, sector) -> tuple[np.ndarray, np.ndarray]:
    """The outline's corner (C,), (C,) at the start of each sector, in the disc's frame."""
    distance = reach[disc, sector % DIRECTIONS]
    angle = sector * (2 * np.pi / DIRECTIONS)
    return distance * np.cos(angle), distance * np.sin(angle)
