"""Which gatherer searches, and why: by the cost model, with counts from a few of the scene's own segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..compiled import kernels
from ..cost_model import SearchProblem, best_last_radius, best_q
from ..discs import TangentDiscs
from ..errors import InvalidSettingError
from ..segments import Segments
from ..settings import GATHERERS
from ..space_filling import mean_spacing
from ..unit_costs import UNIT_COSTS, bare_segments, build_seconds, search_lanes, search_seconds, this_machine
from .brute_force import BruteForce
from .compiled_index import CompiledIndex
from .counts import Counts
from .disc_index import DiscIndex
from .gatherer import Gatherer
from .search_plan import SearchPlan, crossings_per_segment, planned
from .sphere_cache import SphereCache

#: Segments that a bake may have, when it does not say.
EXPECTED = 1 << 19
#: Least and most segments of the pilot that are searched to count.
PILOT = (128, 4096)
#: Lists of one chunk of segments that the Sphere Cache makes for each disc; 0.04 to 0.15 in the samples.
LISTS_PER_DISC = 0.1
#: More discs than this are not left to brute force.
FEW = 64
#: Other searches are built and tried when that takes at most this share of the time that the first will need, and the
#: rough plan gives them less than so many times what it gives the first: it is right to a factor of two.
TRIAL, HOPELESS = 0.04, 2.5

_TITLES = {
    "grid": "Disc Indexing with a grid",
    "tree": "Disc Indexing with a tree",
    "compiled grid": "Disc Indexing with a compiled grid",
    "sphere-cache": "Sphere Cache",
    "brute-force": "Brute force",
}


@dataclass(frozen=True)
class Candidate:
    """A search that was tried: its ``kind``, a key of UNIT_COSTS, and the reference ``seconds`` of one processor."""

    kind: str
    gatherer: Gatherer
    seconds: float
    lanes: int

    @property
    def wall_seconds(self) -> float:
        """Predicted for this machine."""
        return this_machine().wall_seconds(self.seconds, self.lanes)


@dataclass(frozen=True)
class Task:
    """What a gatherer is chosen for.

    discs     N >= 1
    expected  segments to search in all
    pilot     some of them
    spacing   of the discs, metres; 0 when all are in one place
    plan      rough costs
    """

    discs: TangentDiscs
    expected: int
    pilot: Segments
    spacing: float
    plan: SearchPlan

    @classmethod
    def of(cls, discs: TangentDiscs, expected: int, pilot: Segments | None) -> Task:
        """Look at N >= 1 ``discs`` and some segments, None for such as might be."""
        pilot = pilot_of(discs, expected, pilot)
        spacing = mean_spacing(discs.centres)
        plan = planned(discs, expected, crossings_per_segment(discs, pilot), spacing)
        return cls(discs, expected, pilot, spacing, plan)

    def size(self) -> str:
        """The discs' radius in words."""
        if self.spacing == 0.0:
            return "all points are in one place"
        return f"the radius is {float(np.median(self.discs.radii)) / self.spacing:.2g} point spacings"

    def unevenly(self, kind: str) -> str:
        """Why it is a tree, if that is why."""
        return ", the points are too unevenly spread for a grid" if self.plan.uneven and kind == "tree" else ""


def make_gatherer(
    name: str, discs: TangentDiscs, expected: int = EXPECTED, pilot: Segments | None = None
) -> tuple[Gatherer, str]:
    """The gatherer called ``name`` over ``discs``, and in one sentence why it is this one.

    name      one of GATHERERS; "auto" takes the one of the least predicted time
    expected  how many segments it will search in all
    pilot     a few hundred segments or more of the kind that it will search; None: ways between the discs' centres

    Equal arguments give the same gatherer on every machine, but for the compiled one where there are kernels, and all
    find the same crossings. Only the seconds in the sentence are this machine's.
    Raises InvalidSettingError for any other name.
    """
    if name not in GATHERERS:
        raise InvalidSettingError(f"Unknown gatherer '{name}': choose {', '.join(GATHERERS)}.")
    if len(discs) == 0:
        return (BruteForce if name == "brute-force" else DiscIndex)(discs), f"{name}: there is nothing to search."
    if name in ("brute-force", "sphere-cache"):
        return made(name, discs, expected), f"{_TITLES[name]}, as asked for."
    task = Task.of(discs, expected, pilot)
    if name == "auto":
        return _chosen(task)
    kind = "tree" if task.plan.uneven else min(("grid", "tree"), key=task.plan.seconds.get)
    if not task.plan.uneven and _compiled(task):
        kind = "compiled grid"
    return made(kind, discs, expected, task.plan.cell), f"{_TITLES[kind]}{task.unevenly(kind)}, as asked for."


def _compiled(task: Task) -> bool:
    """Whether there are compiled kernels, and loading them pays."""
    return kernels(min(task.plan.seconds.values())) is not None


def made(kind: str, discs: TangentDiscs, expected: int, cell: float | None = None) -> Gatherer:
    """The search of that ``kind``, a key of UNIT_COSTS, over N >= 1 discs, with options for ``expected`` segments.

    ``cell`` is the side of a grid's cells, as planned. The "compiled grid" needs the kernels, and has cells of its own.
    """
    if kind == "brute-force":
        return BruteForce(discs)
    if kind == "sphere-cache":
        problem = SearchProblem.of(discs, expected)
        q = best_q(problem.dimension)
        return SphereCache(discs, q, best_last_radius(problem, q), chunk=_sphere_chunk(len(discs)))
    if kind == "compiled grid":
        return CompiledIndex(kernels(), discs)
    return DiscIndex(discs, kind, cell)


def _sphere_chunk(discs: int) -> int:
    """Segments whose lists the Sphere Cache keeps together: enough that making lists is a tenth of its work.

    It makes about one for ten discs (LISTS_PER_DISC) at 6 us, and else needs about 5 us a segment, see UNIT_COSTS.
    """
    enough = LISTS_PER_DISC * discs * 6.0 / (0.1 * 5.0)
    return 1 << int(np.clip(np.ceil(np.log2(max(enough, 1.0))), 15, 18))


def tried(kind: str, task: Task) -> Candidate:
    """Build a search and predict its time from what it does with the pilot's segments."""
    gatherer = made(kind, task.discs, task.expected, task.plan.cell)
    lanes = search_lanes(task.expected, gatherer.chunk)
    return Candidate(kind, gatherer, predicted_seconds(kind, gatherer, task.expected, task.pilot), lanes)


def predicted_seconds(kind: str, gatherer: Gatherer, expected: int, pilot: Segments) -> float:
    """Reference seconds of one processor that ``gatherer`` takes for ``expected`` segments like the ``pilot``'s."""
    if kind == "brute-force":
        counts = {"segments": 1, "tests": len(gatherer)}
        return search_seconds(kind, counts, expected, expected)
    counts, chunk = Counts(), min(expected, gatherer.chunk)
    search = gatherer.scaled(len(pilot) / chunk) if kind == "sphere-cache" else gatherer
    for _ in search.crossings(pilot, counts):
        pass
    return search_seconds(kind, counts.totals(), expected, chunk)


def _chosen(task: Task) -> tuple[Gatherer, str]:
    """The search of the least predicted time, where trying others pays, and why it is this one."""
    plan = task.plan.seconds
    first = "tree" if task.plan.uneven else min(plan, key=plan.get)
    kinds = [kind for kind in UNIT_COSTS if kind != "compiled grid"]
    if _compiled(task):
        first, kinds = "compiled grid", ["brute-force", *(["tree"] if task.plan.uneven else [])]
    candidates = [tried(first, task)]
    left = TRIAL * candidates[0].seconds
    trials = {kind: _trial_seconds(kind, task, first) for kind in kinds if kind != first}
    for kind in sorted(trials, key=trials.get):
        left -= trials[kind]
        if left >= 0.0:
            candidates.append(tried(kind, task))
    best, *others = sorted(candidates, key=lambda candidate: candidate.seconds)
    if others:
        against = f"{_said(others[0].wall_seconds)} with {_TITLES[others[0].kind]}"
    else:
        other = min((kind for kind in plan if kind not in (first, "tree")), key=plan.get)
        roughly = this_machine().wall_seconds(plan[other], best.lanes)
        against = f"roughly {_said(roughly)} with {_TITLES[other]}"
    why = f"{task.size()}{task.unevenly(best.kind)}, predicted {_said(best.wall_seconds)} against {against}"
    return best.gatherer, f"{_TITLES[best.kind]}: {why}."


def _trial_seconds(kind: str, task: Task, first: str) -> float:
    """Reference seconds that building and trying a search takes; infinite if it cannot be faster than ``first``."""
    if kind == "brute-force":
        return 0.0 if len(task.discs) <= FEW else np.inf
    plan = task.plan.seconds
    if first in plan and plan[kind] > HOPELESS * plan[first]:
        return np.inf
    # Each of a few segments takes longer than each of many.
    return build_seconds(kind, len(task.discs)) + 2.0 * plan[kind] * len(task.pilot) / task.expected


def _said(seconds: float) -> str:
    return f"{seconds:.1f} s" if seconds >= 0.95 else f"{seconds:.1g} s"


def pilot_of(discs: TangentDiscs, expected: int, pilot: Segments | None) -> Segments:
    """A hundredth of the ``expected`` segments, but 128 to 4096, evenly from the ``pilot``.

    Without any, ways between the discs' centres, as light would go in a convex room.
    """
    count = int(np.clip(expected // 100, *PILOT))
    if pilot is None or len(pilot) == 0:
        rows = np.random.default_rng(0).integers(0, len(discs), (2, count))
        return bare_segments(discs.centres[rows[0]], discs.centres[rows[1]])
    return pilot.spread(count)
