"""The hybrid for quasi-static scenes: Disc Indexing for discs that stay, Sphere Cache for those on moving objects."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import copy

import numpy as np

from ..discs import TangentDiscs
from ..errors import InvalidArrayError
from ..segments import Segments
from .disc_index import DiscIndex
from .gatherer import Counts, Crossings, Gatherer
from .outer_spheres import SphereLists, sphere_around, walked_on
from .sphere_cache import SphereCache
from .sphere_cache_plan import Q

Search = Callable[[TangentDiscs], Gatherer]


def checked_moving(moving: np.ndarray | None, count: int) -> np.ndarray:
    """``moving`` (N,) bool for so many discs; None: none moves. Raises InvalidArrayError for anything else."""
    moving = np.zeros(count, bool) if moving is None else np.asarray(moving)
    if moving.shape != (count,) or moving.dtype != bool:
        raise InvalidArrayError(f"Which discs move must be {count} times True or False, one for each disc.")
    return moving


class Hybrid:
    """What the study leaves as future work, for "static scene, relatively small mobile objects".

    discs    the TangentDiscs of the first frame
    moving   (N,) bool, which of them move; None: none so far
    still    makes the search over those that stay, which is kept over all frames; the study: Disc Indexing
    mobile   makes that over the others, for each frame anew; the study: Sphere Cache
    q        ratio of one outer sphere's radius to that around it, 0 < q < 1

    Attributes ``still`` and ``mobile``: both halves, which may be asked for different segments: where sums are kept,
    discs that stay need only the segments that were traced anew.
    Raises InvalidArrayError when ``moving`` is not a bool per disc.
    """

    name = "hybrid"

    def __init__(
        self,
        discs: TangentDiscs,
        moving: np.ndarray | None = None,
        still: Search = DiscIndex,
        mobile: Search = SphereCache,
        q: float = Q,
    ):
        moving = checked_moving(moving, len(discs))
        self._discs, self.moving, self._searches, self._q = discs, moving, (still, mobile), q
        rows = np.flatnonzero(~moving)
        self.still = SomeDiscs(still(discs.taken(rows)), rows)
        self.mobile = MovingDiscs(discs, np.flatnonzero(moving), mobile, q)

    def moved(self, discs: TangentDiscs) -> Hybrid:
        """The search of the next frame, whose ``discs`` (N,) stand for those of this one, row by row.

        What stays keeps its index. Discs that were to stay and have changed move from now on, for which the others'
        index is built once more: better say so beforehand. Raises InvalidArrayError for another number of discs.
        """
        if len(discs) != len(self._discs):
            raise InvalidArrayError(f"Discs that moved are as many as before: {len(self._discs)}, not {len(discs)}.")
        before = self._discs
        other = (discs.centres != before.centres).any(axis=1) | (discs.normals != before.normals).any(axis=1)
        other |= discs.radii != before.radii
        if (other & ~self.moving).any():
            return Hybrid(discs, self.moving | other, *self._searches, self._q)
        after = copy(self)
        after._discs, after.mobile = discs, self.mobile.moved(discs)
        return after

    def crossings(self, segments: Segments, counts: Counts | None = None) -> Iterator[Crossings]:
        """Yield all crossings of ``segments``, each pair once, in chunks of bounded size."""
        yield from self.still.crossings(segments, counts)
        yield from self.mobile.crossings(segments, counts)


class SomeDiscs:
    """A ``search`` over some ``rows`` (K,) of the discs, which it calls by these."""

    def __init__(self, search: Gatherer, rows: np.ndarray):
        self.search, self._rows = search, rows

    def crossings(self, segments: Segments, counts: Counts | None = None) -> Iterator[Crossings]:
        """Yield all crossings of ``segments`` with them."""
        for found in self.search.crossings(segments, counts):
            yield Crossings(found.segment, self._rows.take(found.disc))


class MovingDiscs:
    """The search over the ``rows`` (M,) of ``discs`` that move, in the frame that these are of.

    The outer spheres of the Sphere Cache, between the scene and what moves, are kept from frame to frame while that
    stays in them, and so are their lists for segments that stay: all frames share them. A frame that keeps most
    segments then looks at few.
    ``search`` makes that inside of them; ``q`` as for Hybrid.
    """

    def __init__(self, discs: TangentDiscs, rows: np.ndarray, search: Search, q: float):
        self._rows, self._make, self._q = rows, search, q
        self._first = sphere_around(discs).radius if len(rows) else 0.0
        self._lists, self._spheres = SphereLists(), ()
        self._place(discs)

    def moved(self, discs: TangentDiscs) -> MovingDiscs:
        """The same in the next frame."""
        after = copy(self)
        after._place(discs)
        return after

    def _place(self, discs: TangentDiscs) -> None:
        some = discs.taken(self._rows)
        if len(some):
            self._within = SomeDiscs(self._make(some), self._rows)
            self._spheres = walked_on(self._spheres, sphere_around(some), self._first, self._q)

    def crossings(self, segments: Segments, counts: Counts | None = None) -> Iterator[Crossings]:
        """Yield all crossings of ``segments`` with what moves."""
        if len(self._rows) == 0:
            return
        if not self._spheres:
            yield from self._within.crossings(segments, counts)
            return
        near = self._lists.near(segments, self._spheres, counts)
        for found in self._within.crossings(segments.taken(near), counts):
            yield Crossings(near.take(found.segment), found.disc)
