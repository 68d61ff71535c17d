"""What every kind of index over the discs offers to Disc Indexing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .counts import Counts


@dataclass(frozen=True)
class Candidates:
    """Pairs that may cross: every crossing is among them, and most of the rest is not.

    stretch      (C,) int64, the row of each pair's stretch of a segment among the R that follow
    disc         (C,) int64, row in the index's discs
    segment      (R,) int64, row in the searched segments
    first, last  (R,) float64, the part of the segment, as shares of it, in which the crossing's t must lie,
                 first <= t < last. An index that meets a disc in several places hands out stretches that do not
                 overlap, so that a crossing counts once. None: anywhere.
    """

    stretch: np.ndarray
    disc: np.ndarray
    segment: np.ndarray
    first: np.ndarray | None = None
    last: np.ndarray | None = None


class DiscSearch(Protocol):
    """An index over tangent discs that segments walk from their origin to their end."""

    def candidates(self, origins: np.ndarray, ends: np.ndarray, counts: Counts | None = None) -> Iterator[Candidates]:
        """Yield, in blocks of bounded size, the discs that may be crossed on the way from origins to ends (3, S)."""
        ...
