"""Which gatherer searches, and why: by the cost model, with counts from a few of the scene's own segments."""

from __future__ import annotations

import numpy as np

from ..discs import TangentDiscs
from ..errors import InvalidSettingError
from ..segments import Segments
from ..settings import GATHERERS
from ..unit_costs import build_seconds, seconds_here
from .brute_force import BruteForce
from .candidates import Candidate, Task, made, options_of, tried
from .disc_index import DiscIndex
from .gatherer import Gatherer
from .hybrid import Hybrid, checked_moving
from .hybrid_choice import chosen_hybrid, halves_of, hybrid_of

#: Segments that a bake may have, when it does not say.
EXPECTED = 1 << 19
#: More discs than this are not left to brute force.
FEW = 64
#: Other searches are built and tried when that takes at most this share of the time that the first will need, and the
#: rough plan gives them less than so many times what it gives the first: it is right to a factor of two.
TRIAL, HOPELESS = 0.05, 2.0
#: Reference seconds that searching takes however few the segments.
AT_LEAST = 0.01

_TITLES = {
    "grid": "Disc Indexing with a grid",
    "tree": "Disc Indexing with a tree",
    "sphere-cache": "Sphere Cache",
    "brute-force": "Brute force",
}


def make_gatherer(
    name: str,
    discs: TangentDiscs,
    expected: int = EXPECTED,
    pilot: Segments | None = None,
    moving: np.ndarray | None = None,
    frames: int = 1,
) -> tuple[Gatherer, str]:
    """The gatherer called ``name`` over ``discs``, and in one sentence why it is this one.

    name      one of GATHERERS; "auto" takes the one of the least predicted time
    expected  how many segments it will search in all
    pilot     a few hundred segments or more of the kind that it will search; None: ways between the discs' centres
    moving    (N,) bool, which discs move from frame to frame; None: none
    frames    over so many of them; in each, ``expected`` segments are searched

    Equal arguments give the same gatherer on every machine, and all find the same crossings. Only the seconds in the
    sentence are this machine's, where they are one or more.
    Raises InvalidSettingError for any other name, InvalidArrayError when ``moving`` is not a bool per disc.
    """
    if name not in GATHERERS:
        raise InvalidSettingError(f"Unknown gatherer '{name}': choose {', '.join(GATHERERS)}.")
    if len(discs) == 0:
        return (BruteForce if name == "brute-force" else DiscIndex)(discs), f"{name}: there is nothing to search."
    if name in ("brute-force", "sphere-cache"):
        gatherer = made(name, discs, expected)
        return gatherer, f"{_TITLES[name]}, as asked for ({options_of(gatherer)})."
    moving = checked_moving(moving, len(discs))
    if name == "hybrid":
        return _hybrid(*hybrid_of(discs, moving, expected, pilot))
    task = Task.of(discs, expected, pilot)
    if name == "auto":
        best, why = _chosen(task)
        found = _hybrid_that_pays(task, best, moving, frames) if frames > 1 and moving.any() else None
        return found or (best.gatherer, why)
    kind = task.plan.index
    gatherer = task.made(kind)
    return gatherer, f"{_TITLES[kind]}{task.unevenly(kind)}, as asked for ({options_of(gatherer)})."


def _hybrid(gatherer: Hybrid, kind: str) -> tuple[Hybrid, str]:
    """The hybrid that was asked for, with that ``kind`` of index, and a sentence on it."""
    if not gatherer.moving.any():
        index = f"{_TITLES[kind]} ({options_of(gatherer.still.search)})"
        return gatherer, f"Hybrid, as asked for: in a bake of one frame nothing moves, so that it is {index}."
    return gatherer, f"Hybrid, as asked for ({halves_of(gatherer)})."


def _hybrid_that_pays(task: Task, single: Candidate, moving: np.ndarray, frames: int) -> tuple[Hybrid, str] | None:
    """The hybrid and why, if it is predicted to take less than the best ``single`` search, built for each frame."""
    alone = single.seconds + build_seconds(single.kind, len(task.discs))
    hybrid, seconds = chosen_hybrid(task, moving, frames)
    if seconds >= alone:
        return None
    said = (_said(seconds_here(each, single.lanes)) for each in (seconds, alone))
    times = "predicted {} a frame against {}".format(*said)
    return hybrid, f"Hybrid: {times} with {_TITLES[single.kind]} for each of {frames} ({halves_of(hybrid)})."


def _chosen(task: Task) -> tuple[Candidate, str]:
    """The search of the least predicted time, where trying others pays, and why it is this one."""
    plan = task.plan.seconds
    first = tried("tree" if task.plan.uneven else min(plan, key=plan.get), task)
    candidates, hopeless = [first], HOPELESS * plan[first.kind]
    trials = {kind: _trial_seconds(kind, task) for kind in plan if kind != first.kind and plan[kind] <= hopeless}
    if len(task.discs) <= FEW:
        trials["brute-force"] = 0.0
    left = TRIAL * first.seconds
    # The most promising one first.
    for kind in sorted(trials, key=lambda kind: plan.get(kind, 0.0)):
        if trials[kind] <= left:
            left -= trials[kind]
            candidates.append(tried(kind, task))
    best, *others = sorted(candidates, key=lambda candidate: candidate.seconds)
    if others:
        against = f"{_said(others[0].wall_seconds)} with {_TITLES[others[0].kind]}"
    else:
        other = min((kind for kind in plan if kind not in (first.kind, "tree")), key=plan.get)
        roughly = seconds_here(plan[other], best.lanes)
        against = f"roughly {_said(roughly)} with {_TITLES[other]}"
    why = f"{task.size()}{task.unevenly(best.kind)}, predicted {_said(best.wall_seconds)} against {against}"
    return best, f"{_TITLES[best.kind]}: {why} ({options_of(best.gatherer)})."


def _trial_seconds(kind: str, task: Task) -> float:
    """Reference seconds that building and trying a search takes."""
    trying = task.plan.seconds[kind] * len(task.pilot) / task.expected
    return build_seconds(kind, len(task.discs)) + trying + AT_LEAST


def _said(seconds: float) -> str:
    return f"{seconds:.1f} s" if seconds >= 0.95 else f"{seconds:.1g} s"
