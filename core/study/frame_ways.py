"""Ways to search over the frames of a quasi-static scene: Disc Indexing, Sphere Cache, and the hybrid."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from ..gatherers.disc_index import DiscIndex
from ..gatherers.gatherer import Counts
from ..gatherers.hybrid import Hybrid, MovingDiscs, Search
from ..gatherers.sphere_cache import SphereCache
from ..segments import Segments
from .frames import Frame, MovingObject
from .measure import searched
from .theory import best_q

# Each yields the crossings of one frame after the other, all as many, and counts what it compares.
Way = Callable[[MovingObject, list[Frame], Counts], Iterator[int]]


def _rebuilt(search: Search, scene: MovingObject, frames, counts) -> Iterator[int]:
    """A search over all discs, built for each frame as a bake does it."""
    for frame in frames:
        yield searched(search(frame.discs), frame.segments, counts)


def _hybrid(scene: MovingObject, frames, counts) -> Iterator[int]:
    """The hybrid, where each frame has segments of its own."""
    hybrid = Hybrid(frames[0].discs, scene.moving)
    for frame in frames:
        hybrid = hybrid.moved(frame.discs)
        yield searched(hybrid, frame.segments, counts)


def _hybrid_with_sums(scene: MovingObject, frames, counts) -> Iterator[int]:
    """The hybrid, where what the first scene's segments bring to discs that stay is known, and subtracted or kept."""
    hybrid = Hybrid(frames[0].discs, scene.moving)
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


def _alone(search: Search, scene: MovingObject, frames, counts) -> Iterator[int]:
    """The discs that move alone, with a search made for each frame, and the first scene's segments."""
    for frame in frames:
        yield searched(search(frame.discs.taken(scene.moving)), scene.segments, counts)


def _in_spheres(search: Search, scene: MovingObject, frames, counts) -> Iterator[int]:
    """The same by the hybrid's half, whose outer spheres are kept."""
    mobile = MovingDiscs(frames[0].discs, np.flatnonzero(scene.moving), search, best_q(2.0))
    for frame in frames:
        mobile = mobile.moved(frame.discs)
        yield searched(mobile, scene.segments, counts)


#: For all discs.
WHOLE: dict[str, Way] = {
    "disc-index": partial(_rebuilt, DiscIndex),
    "sphere-cache": partial(_rebuilt, SphereCache),
    "hybrid": _hybrid,
    "hybrid, sums kept": _hybrid_with_sums,
}
#: For the discs that move alone.
ALONE: dict[str, Way] = {
    "disc-index": partial(_alone, DiscIndex),
    "sphere-cache": partial(_alone, SphereCache),
    "sphere-cache, outer spheres kept": partial(_in_spheres, SphereCache),
    "disc-index, outer spheres kept": partial(_in_spheres, DiscIndex),
}
