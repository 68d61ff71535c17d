"""Ways to search over the frames of a quasi-static scene: Disc Indexing, Sphere Cache, and the hybrid."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from ..cost_model import best_q
from ..discs import TangentDiscs
from ..gatherers.candidates import Task, made
from ..gatherers.choose import make_gatherer
from ..gatherers.counts import Counts
from ..gatherers.gatherer import Gatherer
from ..gatherers.hybrid import Hybrid, MovingDiscs
from ..gatherers.hybrid_choice import hybrid_of
from ..segments import Segments
from .frames import Frame, MovingObject
from .measure import searched

# Each yields the crossings of one frame after the other, all as many, and counts what it compares.
Way = Callable[[MovingObject, list[Frame], Counts], Iterator[int]]


def _rebuilt(name: str, scene: MovingObject, frames, counts) -> Iterator[int]:
    """A search over all discs, chosen and built for each frame as a bake does it."""
    for frame in frames:
        gatherer, _ = make_gatherer(name, frame.discs, len(frame.segments), frame.segments)
        yield searched(gatherer, frame.segments, counts)


def _hybrid(scene: MovingObject, frames, counts) -> Iterator[int]:
    """The hybrid, where each frame has segments of its own."""
    hybrid, _ = hybrid_of(frames[0].discs, scene.moving, len(scene.segments), scene.segments)
    for frame in frames:
        hybrid = hybrid.moved(frame.discs)
        yield searched(hybrid, frame.segments, counts)


def _hybrid_with_sums(scene: MovingObject, frames, counts) -> Iterator[int]:
    """The hybrid, where what the first scene's segments bring to discs that stay is known, and subtracted or kept."""
    hybrid, _ = hybrid_of(frames[0].discs, scene.moving, len(scene.segments), scene.segments)
    first = searched(hybrid.still, scene.segments, counts)
    for frame in frames:
        hybrid = hybrid.moved(frame.discs)
        known = first - searched(hybrid.still, scene.segments.taken(frame.gone), counts)
        known += searched(hybrid.still, frame.come, counts) + searched(hybrid.mobile, frame.come, counts)
        yield known + _not_gone(hybrid, scene.segments, frame.gone, counts)


def _not_gone(hybrid: Hybrid, segments: Segments, gone: np.ndarray, counts: Counts) -> int:
    """Crossings of ``segments`` but those ``gone`` with what moves."""
    stays = np.ones(len(segments), bool)
    stays[gone] = False
    return sum(np.count_nonzero(stays.take(found.segment)) for found in hybrid.mobile.crossings(segments, counts))


def _alone(make: Callable[[TangentDiscs, int], Gatherer], scene: MovingObject, frames, counts) -> Iterator[int]:
    """The discs that move alone, with a search made for each frame, and the first scene's segments."""
    for frame in frames:
        yield searched(make(frame.discs.taken(scene.moving), len(scene.segments)), scene.segments, counts)


def _in_spheres(kind: str, scene: MovingObject, frames, counts) -> Iterator[int]:
    """The same by the hybrid's half, whose outer spheres are kept."""
    search = partial(made, kind, expected=len(scene.segments))
    mobile = MovingDiscs(frames[0].discs, np.flatnonzero(scene.moving), search, best_q(2.0))
    for frame in frames:
        mobile = mobile.moved(frame.discs)
        yield searched(mobile, scene.segments, counts)


def _made(kind: str, discs: TangentDiscs, expected: int) -> Gatherer:
    """The search as the cost model plans it."""
    return Task.of(discs, expected, None).made(kind) if kind == "grid" else made(kind, discs, expected)


#: For all discs.
WHOLE: dict[str, Way] = {
    "disc-index": partial(_rebuilt, "disc-index"),
    "sphere-cache": partial(_rebuilt, "sphere-cache"),
    "hybrid": _hybrid,
    "hybrid, sums kept": _hybrid_with_sums,
}
#: For the discs that move alone.
ALONE: dict[str, Way] = {
    "grid": partial(_alone, partial(_made, "grid")),
    "tree": partial(_alone, partial(_made, "tree")),
    "sphere-cache": partial(_alone, partial(_made, "sphere-cache")),
    "sphere-cache, outer spheres kept": partial(_in_spheres, "sphere-cache"),
    "tree, outer spheres kept": partial(_in_spheres, "tree"),
}
