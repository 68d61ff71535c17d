"""What every gatherer offers: it finds, it does not estimate."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..rows import Rows
from ..segments import Segments
from .counts import Counts


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
