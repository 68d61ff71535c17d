"""Values as a fit has settled on them, from where those of light that differs a little follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Settled:
    """U values, fitted to light at K places.

    value   (U, 3) W/m^2, and ``part`` (U, 3) of it, of the part of the light that was asked for
    known   (U,) whether light was found on any face that shows the value
    placed  (K, 3) the values on the triangle of each place
    left    (K,) the share of the places' errors by chance that is left where they are shown
    """

    value: np.ndarray
    part: np.ndarray
    known: np.ndarray
    placed: np.ndarray
    left: np.ndarray

    def among(self, placed: np.ndarray, count: int, same: np.ndarray) -> np.ndarray:
        """Which of these each of ``count`` other values (U,) is, -1 for none, where K other places show those
        ``placed`` (K, 3), and are the ``same`` (K,) as here, or -1."""
        if count == len(self.value) and np.array_equal(placed, self.placed):
            return np.arange(count)
        was, rows = np.full(count, -1), np.flatnonzero(same >= 0)
        was[placed[rows]] = self.placed[same[rows]]
        return was
