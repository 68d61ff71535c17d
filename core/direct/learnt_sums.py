"""Sums over rounds of rays before and after it was learnt where light comes from, each weighed by what it is worth."""

from __future__ import annotations

import numpy as np

from .point_groups import PointGroups
from .round_sums import RoundSums

#: The first rounds count this much or more of what later ones do, however much noisier they were.
LEAST_WEIGHT = 1 / 64


class LearntSums:
    """Rounds of rays at points in ``groups``, ``before`` and ``after`` learning; channel by channel as RoundSums."""

    def __init__(self, groups: PointGroups):
        self._groups = groups
        self.before, self.after = (RoundSums.of(len(groups.order)) for _ in range(2))

    def plain(self, rows: slice = slice(None)) -> np.ndarray:
        """Plain means (3, K) over all rounds at those ``rows``."""
        before, after = self.before.part(rows), self.after.part(rows)
        return (before.total + after.total) / np.maximum(before.count + after.count, 1)

    def value(self, light: np.ndarray) -> np.ndarray:
        """Irradiance (3, N), where all ``light`` (N,), RGB sum, is about so much."""
        first = self._first_share(light)
        return first * self.before.mean + (1.0 - first) * self.after.mean

    def squared_error(self, value: np.ndarray, light: np.ndarray) -> np.ndarray:
        """Squared standard error (3, N) of :meth:`value`; of all light, errors are relative to ``value`` (3, N)."""
        first, squared = self._first_share(light), np.zeros_like(value)
        for sums, share in ((self.before, first), (self.after, 1.0 - first)):
            if share.any():
                with np.errstate(invalid="ignore"):
                    error = share**2 * sums.squared_error(value, self._groups)
                squared += np.where(share == 0.0, 0.0, error)
        return squared

    def had(self, light: np.ndarray) -> np.ndarray:
        """Rounds (N,) that points had, in rounds after learning."""
        return self.after.count + self.before.count * _trust(*self._variances(light))

    def variance(self, light: np.ndarray) -> np.ndarray:
        """Relative variance (N,) of one round more, as the others of the group tell; nan while that is unknown."""
        before, after = self._variances(light)
        return np.where(np.isnan(after), before, after)

    def _first_share(self, light: np.ndarray) -> np.ndarray:
        """Share (N,) that the rounds before learning have.

        It rests on how noisy the rounds were at the *other* points of the group, so that it is independent of what this
        point's own rounds found, and biases nothing. A single round after learning does not count: nobody knows how
        noisy it is.
        """
        weight = self.before.count * _trust(*self._variances(light))
        return np.divide(weight, weight + self.after.count, out=np.ones_like(weight), where=self.after.count > 1)

    def _variances(self, light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        before, after = (self._groups.of_others(s.relative_variance(light)) for s in (self.before, self.after))
        return before, after


def _trust(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """What a round before learning is worth in later ones, by their variances (N,); 1 where that is not known."""
    ratio = np.divide(after, before, out=np.ones_like(before), where=before > 0)
    return np.clip(np.where(np.isnan(ratio), 1.0, ratio), LEAST_WEIGHT, 1.0)
