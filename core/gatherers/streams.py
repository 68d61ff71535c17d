"""Crossings of long lists of segments: cut up evenly, found in parallel, handed out in fair portions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import chain

import numpy as np

from ..parallel import interleaved, slices
from .gatherer import Crossings

LANES = 16  # most streams, and so threads, that search at the same time
PAIRS = 1 << 19  # most crossings handed out together, unless one block holds more


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
