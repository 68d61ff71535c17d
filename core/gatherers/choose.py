"""Which gatherer searches, and why: by the cost model, with counts from a few of the scene's own segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..cost_model import SearchProblem, best_last_radius, best_q, front_share
from ..discs import TangentDiscs
from ..errors import InvalidSettingError
from ..segments import Segments
from ..settings import GATHERERS
from ..space_filling import mean_spacing
from ..unit_costs import UNIT_COSTS, bare_segments, build_seconds, search_lanes, search_seconds, this_machine
from .brute_force import BruteForce
from .counts import Counts
from .disc_index import DiscIndex, favoured_index
from .gatherer import Gatherer
from .grid_cells import best_cell
from .sphere_cache import SphereCache

#: Segments that a bake may have, when it does not say.
EXPECTED = 1 << 19
#: Segments of the pilot that are searched to count.
PILOT = 2048
#: Lists of one chunk of segments that the Sphere Cache makes for each disc; 0.04 to 0.15 in the samples.
LISTS_PER_DISC = 0.1
#: More discs than this are not left to brute force.
FEW = 64
#: Another search is built and tried when that takes at most this share of the time that the first will need.
TRIAL = 0.04

_TITLES = {
    "grid": "Disc Indexing with a grid",
    "tree": "Disc Indexing with a tree",
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


def make_gatherer(
    name: str, discs: TangentDiscs, expected: int = EXPECTED, pilot: Segments | None = None
) -> tuple[Gatherer, str]:
    """The gatherer called ``name`` over ``discs``, and in one sentence why it is this one.

    name      one of GATHERERS; "auto" takes the one of the least predicted time
    expected  how many segments it will search in all
    pilot     a few hundred segments or more of the kind that it will search; None: ways between the discs' centres

    Equal arguments give the same gatherer on every machine; only the seconds in the sentence are this machine's.
    Raises InvalidSettingError for any other name.
    """
    if name not in GATHERERS:
        raise InvalidSettingError(f"Unknown gatherer '{name}': choose {', '.join(GATHERERS)}.")
    pilot = pilot_of(discs, pilot)
    if name == "auto" and len(discs):
        return _chosen(discs, expected, pilot)
    kind = {"disc-index": favoured_index(discs), "auto": "grid"}.get(name, name)
    return made(kind, discs, expected, pilot), f"{_TITLES[kind]}{_uneven(kind)}, as asked for."


def made(kind: str, discs: TangentDiscs, expected: int, pilot: Segments, spacing: float | None = None) -> Gatherer:
    """The search of that ``kind``, a key of UNIT_COSTS, with the options that suit ``expected`` segments.

    ``spacing`` is the discs' mean_spacing, if it is known already.
    """
    if len(discs) == 0 or kind == "brute-force":
        return BruteForce(discs) if kind == "brute-force" else DiscIndex(discs)
    if kind == "sphere-cache":
        problem = SearchProblem.of(discs, expected)
        q = best_q(problem.dimension)
        return SphereCache(discs, q, best_last_radius(problem, q), chunk=_sphere_chunk(len(discs)))
    if kind == "tree":
        return DiscIndex(discs, "tree")
    return DiscIndex(discs, "grid", best_cell(discs, expected, _crossings(discs, pilot), spacing))


def _sphere_chunk(discs: int) -> int:
    """Segments whose lists the Sphere Cache keeps together: enough that making lists is a tenth of its work.

    It makes about one for ten discs (LISTS_PER_DISC) at 9 us, and else needs about 8 us a segment, see UNIT_COSTS.
    """
    enough = LISTS_PER_DISC * discs * 9.0 / (0.1 * 8.0)
    return 1 << int(np.clip(np.ceil(np.log2(max(enough, 1.0))), 15, 18))


def tried(kind: str, discs: TangentDiscs, expected: int, pilot: Segments, spacing: float | None = None) -> Candidate:
    """Build a search and predict its time from what it does with the ``pilot``'s segments."""
    gatherer = made(kind, discs, expected, pilot, spacing)
    lanes = search_lanes(expected, gatherer.chunk)
    return Candidate(kind, gatherer, predicted_seconds(kind, gatherer, expected, pilot), lanes)


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


def _chosen(discs: TangentDiscs, expected: int, pilot: Segments) -> tuple[Gatherer, str]:
    """The search of the least predicted time, where trying others pays, and why it is this one."""
    spacing = mean_spacing(discs.centres)
    first = favoured_index(discs, spacing)
    candidates = [tried(first, discs, expected, pilot, spacing)]
    for kind in UNIT_COSTS:
        if kind == "brute-force" and len(discs) > FEW:
            continue
        if kind != first and build_seconds(kind, len(discs)) <= TRIAL * candidates[0].seconds:
            candidates.append(tried(kind, discs, expected, pilot, spacing))
    best, *others = sorted(candidates, key=lambda candidate: candidate.seconds)
    size = "all points are in one place"
    if spacing > 0.0:
        size = f"the radius is {float(np.median(discs.radii)) / spacing:.2g} point spacings"
    against = ", too short to try others"
    if others:
        against = f" against {_said(others[0].wall_seconds)} with {_TITLES[others[0].kind]}"
    why = f"{size}{_uneven(best.kind)}, predicted {_said(best.wall_seconds)}{against}"
    return best.gatherer, f"{_TITLES[best.kind]}: {why}."


def _uneven(kind: str) -> str:
    return ", the points are too unevenly spread for a grid" if kind == "tree" else ""


def _said(seconds: float) -> str:
    return f"{seconds:.1f} s" if seconds >= 0.95 else f"{seconds:.1g} s"


def pilot_of(discs: TangentDiscs, pilot: Segments | None) -> Segments:
    """Up to PILOT of the segments, evenly from all; without any, ways between the discs' centres."""
    if pilot is None or len(pilot) == 0:
        return _ways_between(discs)
    return pilot.taken(np.linspace(0, len(pilot) - 1, min(PILOT, len(pilot))).astype(np.int64))


def _ways_between(discs: TangentDiscs) -> Segments:
    """Straight ways between discs, as light would go in a convex room."""
    generator = np.random.default_rng(0)
    rows = generator.integers(0, max(1, len(discs)), (2, PILOT if len(discs) else 0))
    return bare_segments(discs.centres[rows[0]], discs.centres[rows[1]])


def _crossings(discs: TangentDiscs, pilot: Segments) -> float:
    """Expected crossings of a segment by the uniform theory, for segments as long as the ``pilot``'s."""
    problem = SearchProblem.of(discs, len(pilot))
    length = float(np.linalg.norm(pilot.ends - pilot.origins, axis=1).mean())
    # A uniform line has 4/3 r0 of its length in the sphere on average.
    share = min(1.0, length / (4.0 / 3.0 * problem.around))
    return problem.points * float(front_share(problem.radius, problem.around)) * share
