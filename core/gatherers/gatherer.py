"""What every gatherer offers: it finds, it does not estimate.

And how long lists of segments are searched: cut up evenly, in parallel, what is found handed out in fair portions.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Protocol

import numpy as np

from ..parallel import interleaved, slices
from ..rows import Rows
from ..segments import Segments

#: what is counted
KINDS = ("segments", "lists", "nodes", "patches", "listed", "discs", "tests", "crossings")

LANES = 16  # most streams, and so threads, that search at the same time
PAIRS = 1 << 19  # most crossings handed out together, unless one block holds more


class Counts:
    """What one search did, or several, for the study: a bake counts nothing and pays nothing.

    Hand one to a gatherer's ``crossings`` and read it when all crossings have been taken:

    segments   searched
    lists      of the Sphere Cache: spheres whose list was made anew
    nodes      comparisons of a segment with a sphere or a box of the tree
    patches    comparisons of a segment with the slab around a few neighbouring discs
    listed     discs in those patches: the pairs that the study would test, for want of slabs and balls
    discs      comparisons of a segment with the ball around a disc
    tests      exact tests of a segment with a disc
    crossings  found
    """

    def __init__(self):
        self._noted: list[tuple[str, int]] = []

    def note(self, kind: str, number: int) -> None:
        """Count ``number`` more of ``kind``; safe from several threads, because lists append in one step."""
        self._noted.append((kind, int(number)))

    def totals(self) -> dict[str, int]:
        """The number of each of KINDS."""
        sums = Counter(dict.fromkeys(KINDS, 0))
        for kind, number in self._noted:
            sums[kind] += number
        return dict(sums)


@dataclass(frozen=True)
class Crossings(Rows):
    """Pairs of a segment and a disc that it crosses from the disc's front.

    segment  (C,) int64, row in the searched Segments
    disc     (C,) int64, row in the gatherer's TangentDiscs
    """

    segment: np.ndarray
    disc: np.ndarray


class Gatherer(Protocol):
    """A search over fixed discs. Built once per bake from the discs, then asked once per batch of segments.

    Every gatherer finds the same set of pairs: those that :func:`..crossing.crosses` accepts.
    """

    name: str

    def crossings(self, segments: Segments, counts: Counts | None = None) -> Iterator[Crossings]:
        """Yield all crossings, each pair once, in chunks of bounded size and in any order.

        The chunks and their order do not depend on the number of threads. ``counts`` notes what was done.
        """
        ...


def in_lanes(count: int, chunk: int, search: Callable[[slice], Iterator[Crossings]]) -> Iterator[Crossings]:
    """Yield what ``search`` finds in rows 0..``count``, sliced into at most ``chunk`` rows, searched in parallel.

    The slices, and the order of what is found in them, do not depend on the number of threads.
    """
    if count == 0:
        return
    chunk = min(chunk, max(-(-count // LANES), chunk // 2))
    parts = slices(count, chunk)
    lanes = [chain.from_iterable(map(search, parts[lane::LANES])) for lane in range(min(LANES, len(parts)))]
    yield from interleaved(lanes)


def portions(found: Iterable[Crossings], blocks: int) -> Iterator[Crossings]:
    """Join up to ``blocks`` of the crossings ``found``, so that few but not too large portions are handed out.

    A portion without crossings is handed out too: that ends a step, so that the caller may look around.
    """
    held: list[Crossings] = []
    pairs = 0
    for crossings in found:
        if held and pairs + len(crossings) > PAIRS:
            yield Crossings.joined(held)
            held, pairs = [], 0
        held.append(crossings)
        pairs += len(crossings)
        if len(held) == blocks:
            yield Crossings.joined(held)
            held, pairs = [], 0
    yield Crossings.joined([Crossings(*np.zeros((2, 0), np.int64)), *held])
