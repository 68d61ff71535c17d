"""What every kind of index over the discs offers to Disc Indexing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np


@dataclass(frozen=True)
class Candidates:
    """Pairs that may cross: every crossing is among them, and most of the rest is not.

    segment      (C,) int64, row in the searched segments
    disc         (C,) int64, row in the index's discs
    first, last  (C,) float64, the stretch of the segment, as shares of it, in which this pair's crossing t
                 must lie, first <= t < last. An index that meets a disc in several places hands out
                 stretches that do not overlap, so that a crossing counts once.
    """

    segment: np.ndarray
    disc: np.ndarray
    first: np.ndarray
    last: np.ndarray


class DiscSearch(Protocol):
    """An index over tangent discs that segments walk from their origin to their end."""

    def candidates(self, origins: np.ndarray, ends: np.ndarray) -> Iterator[Candidates]:
        """Yield, in blocks of bounded size, the discs that may be crossed on the way from origins to ends (3, S)."""
        ...
