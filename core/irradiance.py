"""Irradiance at points, how sure it is, and the one number that sums that up."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .rows import Rows

#: Most points from which the one number is computed: more would not change it by a hundredth.
SAMPLE = 1 << 15

#: Halvings of an interval that find it.
HALVINGS = 24

#: Points with less than this share of the light that is usual in a scene are seen as dark, whatever their own light.
DARK_SHARE = 0.02

#: Lit points with a smaller relative standard error than this are sure; the others speak for themselves when they are
#: more than such a share of all.
SURE, FEW = 2e-3, 0.01


@dataclass(frozen=True)
class Irradiance(Rows):
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
        """
        return error_within(self.relative_errors, 0.5)

    def error_among(self, some: np.ndarray) -> float:
        """The same of ``some`` (N,) of the points alone."""
        return self.taken(some).relative_error

    @property
    def doubtful(self) -> np.ndarray:
        """The lit points (N,), without those that are sure: the open does not vouch for what lies in shadow.

        All lit ones where hardly any is not sure.
        """
        light = np.abs(self.value).sum(axis=1)
        unsure = self.standard_error.sum(axis=1) > SURE * light
        lit = light > 0
        return lit & unsure if np.count_nonzero(lit & unsure) > FEW * np.count_nonzero(lit) else lit

    @cached_property
    def seen_errors(self) -> np.ndarray:
        """Standard error over irradiance (N,), of the RGB sums, of all points as they are seen beside each other.

        Where there is next to no light, what is usual in the scene counts instead.
        """
        light = np.abs(self.value).sum(axis=1)
        lit = light[light > 0]
        usual = np.maximum(light, DARK_SHARE * np.median(lit) if len(lit) else 1.0)
        return self.standard_error.sum(axis=1) / usual

    @cached_property
    def high_error(self) -> float:
        """The error, of :attr:`seen_errors`, by which nine tenths of the points are likely to be off at most."""
        return error_within(self.seen_errors, 0.9)

    def __add__(self, other: Irradiance) -> Irradiance:
        """Light from two independent estimates together."""
        return Irradiance(self.value + other.value, np.hypot(self.standard_error, other.standard_error))


def error_within(errors: np.ndarray, share: float) -> float:
    """The error within which a ``share`` of points stays, whose standard errors are ``errors`` (L,), inf if unknown.

    The errors at point i follow a normal distribution with standard deviation s_i. This is the m with
    mean_i erf(m / (s_i sqrt 2)) = share; where all s_i are equal, and share is a half, it is 0.674 s. NaN without
    points, inf where too little is known.
    """
    if len(errors) == 0:
        return float("nan")
    if len(errors) > SAMPLE:
        errors = errors[np.linspace(0, len(errors) - 1, SAMPLE).astype(np.int64)]
    known = np.isfinite(errors)
    if known.mean() < share:
        return float("inf")
    # Half of what is left out stays within so many of this with a probability that leaves out the other half at most.
    row = int((0.5 + 0.5 * share) * len(errors))
    upper = np.partition(errors, row)[row]
    low, high = 0.0, float(3.0 * upper if np.isfinite(upper) else 3.0 * errors[known].max())
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            within = np.where(errors > 0, share_within(middle / errors), 1.0)
            low, high = (middle, high) if within.mean() < share else (low, middle)
    return high


def share_within(deviations: np.ndarray) -> np.ndarray:
    """Share of a normal distribution within so many standard deviations, to 5e-4 (Abramowitz and Stegun 7.1.27)."""
    x = np.minimum(deviations, 10.0) * np.sqrt(0.5)
    return 1.0 - 1.0 / (1.0 + x * (0.278393 + x * (0.230389 + x * (0.000972 + x * 0.078108)))) ** 4
