"""Searches that may be chosen: built as planned, and tried with a few of the scene's own segments."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..cost_model import SearchProblem, best_last_radius, best_q
from ..discs import TangentDiscs
from ..segments import Segments
from ..space_filling import mean_spacing
from ..unit_costs import SHARED_OUT, bare_segments, search_lanes, search_seconds, seconds_here
from .brute_force import BruteForce
from .counts import Counts
from .disc_index import DiscIndex
from .gatherer import Gatherer
from .search_plan import SearchPlan, crossings_per_segment, planned
from .sphere_cache import SphereCache

#: Least and most segments of the pilot that are searched to count.
PILOT = (128, 4096)
#: Lists of one chunk of segments that the Sphere Cache makes for each disc; 0.04 to 0.15 in the samples.
LISTS_PER_DISC = 0.1


@dataclass(frozen=True)
class Candidate:
    """A search that was tried.

    kind     a key of UNIT_COSTS
    seconds  predicted, reference seconds of one processor that is not alone
    """

    kind: str
    gatherer: Gatherer
    seconds: float
    lanes: int

    @property
    def wall_seconds(self) -> float:
        """Predicted for this machine."""
        return seconds_here(self.seconds, self.lanes)


@dataclass(frozen=True)
class Task:
    """What a gatherer is chosen for.

    discs     N >= 1
    expected  segments to search in all
    pilot     some of them
    spacing   of the discs, metres; 0 when all are in one place
    """

    discs: TangentDiscs
    expected: int
    pilot: Segments
    spacing: float

    @classmethod
    def of(cls, discs: TangentDiscs, expected: int, pilot: Segments | None) -> Task:
        """Look at N >= 1 ``discs`` and some segments, None for such as might be."""
        return cls(discs, expected, pilot_of(discs, expected, pilot), mean_spacing(discs.centres))

    @cached_property
    def plan(self) -> SearchPlan:
        """Rough costs, made when they are needed: that takes longer than a small search."""
        return planned(self.discs, self.expected, crossings_per_segment(self.discs, self.pilot), self.spacing)

    def made(self, kind: str) -> Gatherer:
        """The search of that ``kind`` with cells as planned."""
        return made(kind, self.discs, self.expected, self.plan.cell if kind == "grid" else None)

    def size(self) -> str:
        """The discs' radius in words."""
        if self.spacing == 0.0:
            return "all points are in one place"
        return f"the radius is {float(np.median(self.discs.radii)) / self.spacing:.2g} point spacings"

    def unevenly(self, kind: str) -> str:
        """Why it is a tree, if that is why."""
        return ", the points are too unevenly spread for a grid" if kind == "tree" and self.plan.uneven else ""


def made(kind: str, discs: TangentDiscs, expected: int, cell: float | None = None) -> Gatherer:
    """The search of that ``kind``, a key of UNIT_COSTS, over N >= 1 discs, with options for ``expected`` segments.

    ``cell`` is the side of a grid's cells; None: what fits best.
    """
    if kind == "brute-force":
        return BruteForce(discs)
    if kind == "sphere-cache":
        problem = SearchProblem.of(discs, expected)
        q = best_q(problem.dimension)
        return SphereCache(discs, q, best_last_radius(problem, q), chunk=_sphere_chunk(len(discs)))
    return DiscIndex(discs, kind, cell)


def options_of(gatherer: Gatherer) -> str:
    """The options with which it searches, in words."""
    options = []
    if gatherer.name == "sphere-cache":
        order = "points sorted" if gatherer.sorted else "points unsorted"
        options += [f"Q = {gatherer.q:.2f}", f"last spheres of {gatherer.last_radius:.2g} m", order]
    elif getattr(gatherer, "cell", None) is not None:
        options.append(f"cells of {gatherer.cell:.2g} m")
    return ", ".join([*options, f"{gatherer.chunk} segments at a time"])


def _sphere_chunk(discs: int) -> int:
    """Segments whose lists the Sphere Cache keeps together: enough that making lists is a tenth of its work.

    It makes about one for ten discs (LISTS_PER_DISC) at 6 us, and else needs about 5 us a segment, see UNIT_COSTS.
    """
    enough = LISTS_PER_DISC * discs * 6.0 / (0.1 * 5.0)
    return 1 << int(np.clip(np.ceil(np.log2(max(enough, 1.0))), 15, 18))


def tried(kind: str, task: Task) -> Candidate:
    """Build a search and predict its time from what it does with the pilot's segments."""
    gatherer = task.made(kind)
    counts, chunk = _pilot_counts(kind, gatherer, task.expected, task.pilot)
    seconds = search_seconds(kind, counts, task.expected, chunk) * SHARED_OUT.get(kind, 1.0)
    return Candidate(kind, gatherer, seconds, search_lanes(task.expected, chunk))


def predicted_seconds(kind: str, gatherer: Gatherer, expected: int, pilot: Segments) -> float:
    """Reference seconds of one processor that ``gatherer`` takes for ``expected`` segments like the ``pilot``'s."""
    counts, chunk = _pilot_counts(kind, gatherer, expected, pilot)
    return search_seconds(kind, counts, expected, chunk)


def _pilot_counts(kind: str, gatherer: Gatherer, expected: int, pilot: Segments) -> tuple[dict[str, int], int]:
    """What the search does with the pilot's segments, and how many of those expected it searches together."""
    chunk = min(expected, gatherer.chunk)
    if kind == "brute-force":
        return {"segments": 1, "tests": len(gatherer)}, chunk
    counts = Counts()
    search = gatherer.scaled(len(pilot) / chunk) if kind == "sphere-cache" else gatherer
    for _ in search.crossings(pilot, counts):
        pass
    return counts.totals(), chunk


def pilot_of(discs: TangentDiscs, expected: int, pilot: Segments | None) -> Segments:
    """A hundredth of the ``expected`` segments, but 128 to 4096, evenly from the ``pilot``.

    Without any, ways between the discs' centres, as light would go in a convex room.
    """
    count = int(np.clip(expected // 100, *PILOT))
    if pilot is None or len(pilot) == 0:
        rows = np.random.default_rng(0).integers(0, len(discs), (2, count))
        return bare_segments(discs.centres[rows[0]], discs.centres[rows[1]])
    return pilot.spread(count)
