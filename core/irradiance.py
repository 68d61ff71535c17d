"""Irradiance at points, how sure it is, and the one number that sums that up."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

#: Most points from which the one number is computed: more would not change it by a hundredth.
SAMPLE = 1 << 15

#: Halvings of an interval that find it.
HALVINGS = 24


@dataclass(frozen=True)
class Irradiance:
    """Irradiance at N points, and how sure it is.

    value           (N, 3) W/m^2, RGB
    standard_error  (N, 3) W/m^2; inf where nothing is known of it
    """

    value: np.ndarray
    standard_error: np.ndarray

    @classmethod
    def dark(cls, points: int) -> Irradiance:
        """No light at all, for certain."""
        return cls(np.zeros((points, 3)), np.zeros((points, 3)))

    @property
    def relative_errors(self) -> np.ndarray:
        """Standard error over irradiance (L,), of the RGB sums, at the lit points."""
        mean = np.abs(self.value).sum(axis=1)
        lit = mean > 0
        return self.standard_error.sum(axis=1)[lit] / mean[lit]

    @cached_property
    def relative_error(self) -> float:
        """The error by which half of the lit points are likely to be off at most; NaN when all are dark, inf before the
        light is known of half of them.

        The errors at point i follow a normal distribution with standard deviation s_i, see :attr:`relative_errors`.
        This is the median of the absolute errors of all points together: the m with mean_i erf(m / (s_i sqrt 2)) = 1/2.
        Where all s_i are equal, it is 0.674 s.
        """
        errors = self.relative_errors
        if len(errors) == 0:
            return float("nan")
        if len(errors) > SAMPLE:
            errors = errors[np.linspace(0, len(errors) - 1, SAMPLE).astype(np.int64)]
        known = np.isfinite(errors)
        if known.mean() < 0.5:
            return float("inf")
        # Three quarters of the points stay within 1.2 of this with a probability of three quarters: more than half.
        row = int(0.75 * len(errors))
        upper = np.partition(errors, row)[row]
        low, high = 0.0, float(1.2 * upper if np.isfinite(upper) else errors[known].max())
        with np.errstate(divide="ignore", invalid="ignore"):
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                within = np.where(errors > 0, _within(middle / errors), 1.0)
                low, high = (middle, high) if within.mean() < 0.5 else (low, middle)
        return high

    def __add__(self, other: Irradiance) -> Irradiance:
        """Light from two independent estimates together."""
        return Irradiance(self.value + other.value, np.hypot(self.standard_error, other.standard_error))


def _within(deviations: np.ndarray) -> np.ndarray:
    """Share of a normal distribution within so many standard deviations, to 5e-4 (Abramowitz and Stegun 7.1.27)."""
    x = np.minimum(deviations, 10.0) * np.sqrt(0.5)
    return 1.0 - 1.0 / (1.0 + x * (0.278393 + x * (0.230389 + x * (0.000972 + x * 0.078108)))) ** 4
