"""Sums over rounds of rays before and after it was last learnt where light comes from, and what both say together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .point_groups import PointGroups
from .round_sums import RoundSums

#: The first rounds count this much or more of what later ones do, however much noisier they were.
LEAST_WEIGHT = 1 / 256


@dataclass(frozen=True)
class LearntSums:
    """Rounds ``before`` and ``after`` learning at the N points of ``groups``."""

    groups: PointGroups
    before: RoundSums
    after: RoundSums

    @classmethod
    def of(cls, groups: PointGroups) -> LearntSums:
        """No rounds yet."""
        points = len(groups.order)
        return cls(groups, RoundSums.of(points), RoundSums.of(points))

    def plain_mean(self, rows: slice = slice(None)) -> np.ndarray:
        """Mean irradiance (3, K) at those ``rows`` over all rounds alike."""
        before, after = self.before, self.after
        total = before.total[:, rows] + after.total[:, rows]
        return total / np.maximum(before.count[rows] + after.count[rows], 1)

    def mean(self, light: np.ndarray) -> np.ndarray:
        """Irradiance (3, N), where all light, RGB sum, is about ``light`` (N,)."""
        first = self._first_share(light)
        return first * self.before.mean + (1.0 - first) * self.after.mean

    def squared_error(self, value: np.ndarray, light: np.ndarray) -> np.ndarray:
        """Squared standard error (3, N) of :meth:`mean`, where all light is ``value`` (3, N)."""
        first = self._first_share(light)
        squared = np.zeros_like(value)
        for sums, share in ((self.before, first), (self.after, 1.0 - first)):
            if share.any():
                with np.errstate(invalid="ignore"):
                    error = share**2 * sums.squared_error(value, self.groups)
                squared += np.where(share == 0.0, 0.0, error)
        return squared

    def _variances(self, light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        before, after = (s.relative_variance(light) for s in (self.before, self.after))
        return self.groups.of_others(before), self.groups.of_others(after)

    def learnt(self, light: np.ndarray) -> None:
        """What comes next is aimed anew: what there is counts as before, the earlier the less."""
        trust = _trust(*self._variances(light))
        self.before.merge(self.after, np.where(self.after.samples > 1.5, trust, 1.0))

    def _first_share(self, light: np.ndarray) -> np.ndarray:
        """Share (N,) that the rounds before learning have.

        It rests on how noisy the rounds were at the *other* points of the group, so that it is independent of what this
        point's own rounds found, and biases nothing. A single sample after learning does not count: nobody knows how
        noisy it is.
        """
        weight = self.before.count * _trust(*self._variances(light))
        known = self.after.samples > 1.5
        return np.divide(weight, weight + self.after.count, out=np.ones_like(weight), where=known)


def _trust(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """What a round before learning is worth in later ones, by their variances (N,); 1 where that is not known."""
    ratio = np.divide(after, before, out=np.ones_like(before), where=before > 0)
    return np.clip(np.where(np.isnan(ratio), 1.0, ratio), LEAST_WEIGHT, 1.0)
