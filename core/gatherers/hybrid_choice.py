"""The hybrid as it is chosen: which search each half takes, and what a frame costs by the cost model."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..cost_model import share_through
from ..discs import TangentDiscs
from ..segments import Segments
from ..unit_costs import build_seconds
from .candidates import Task, made, options_of, predicted_seconds
from .hybrid import Hybrid
from .outer_spheres import sphere_around

#: Reference nanoseconds to compare a segment with an outer sphere; in metres, so dearer than those inside.
OUTER_SPHERE = 40.0


def hybrid_of(
    discs: TangentDiscs, moving: np.ndarray, expected: int, pilot: Segments | None, mobile: str = "sphere-cache"
) -> tuple[Hybrid, str]:
    """A hybrid of N >= 1 ``discs`` of which some are ``moving`` (N,) bool, and the kind of index for the others.

    ``mobile`` is the kind of search for those that move; the rest as for :func:`.choose.make_gatherer`.
    """
    kind, cell = "grid", None
    if not moving.all():
        plan = Task.of(discs.taken(~moving), expected, pilot).plan
        kind = plan.index
        cell = plan.cell if kind == "grid" else None
    still = partial(made, kind, expected=expected, cell=cell)
    return Hybrid(discs, moving, still, partial(made, mobile, expected=expected)), kind


def mobile_kind(task: Task, moving: np.ndarray) -> str:
    """The search over the discs that are ``moving`` (N,) of the least time, building included, by the rough plan."""
    some = task.discs.taken(moving)
    near = share_through(sphere_around(some).radius, sphere_around(task.discs).radius)
    plan = Task.of(some, max(1, int(near * task.expected)), task.pilot).plan.seconds
    return min(plan, key=plan.get)


def frame_seconds(hybrid: Hybrid, kinds: tuple[str, str], task: Task, frames: int) -> float:
    """Reference seconds of one processor that a frame takes of so many ``frames``, each with segments of its own.

    ``kinds`` are those of the searches over what stays and what moves.
    """
    count = np.count_nonzero(hybrid.moving)
    seconds = build_seconds(kinds[0], len(task.discs) - count) / frames + build_seconds(kinds[1], count)
    if count < len(task.discs):
        seconds += predicted_seconds(kinds[0], hybrid.still.search, task.expected, task.pilot)
    near = hybrid.mobile.near(task.pilot) if count else ()
    if len(near):
        share = len(near) / len(task.pilot)
        seconds += predicted_seconds(kinds[1], hybrid.mobile.search, max(1, int(share * task.expected)), near)
    return seconds + 1e-9 * OUTER_SPHERE * task.expected


def chosen_hybrid(task: Task, moving: np.ndarray, frames: int) -> tuple[Hybrid, float]:
    """The hybrid of the least predicted time, of whose discs some are ``moving``, and its :func:`frame_seconds`."""
    mobile = mobile_kind(task, moving)
    hybrid, still = hybrid_of(task.discs, moving, task.expected, task.pilot, mobile)
    return hybrid, frame_seconds(hybrid, (still, mobile), task, frames)


def halves_of(hybrid: Hybrid) -> str:
    """What its two halves are, in words."""
    stay, move = (np.count_nonzero(rows) for rows in (~hybrid.moving, hybrid.moving))
    return "; ".join(
        f"{count} discs that {do}: {half.search.name}, {options_of(half.search)}"
        for count, do, half in ((stay, "stay", hybrid.still), (move, "move", hybrid.mobile))
        if count
    )
