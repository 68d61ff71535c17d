"""From crossings to irradiance: the density estimate, its running sums and its standard error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .crossing_sums import CrossingSums
from .discs import TangentDiscs
from .errors import InvalidArrayError
from .gatherers.gatherer import Crossings
from .repeated_crossings import RepeatedCrossings
from .segments import Segments
from .visible_area import VisibleArea


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
    def relative_error(self) -> float:
        """Median over the lit points of standard error over irradiance, of the RGB sums; NaN when all are dark."""
        mean = np.abs(self.value).sum(axis=1)
        error = self.standard_error.sum(axis=1)
        lit = mean > 0
        return float(np.median(error[lit] / mean[lit])) if lit.any() else float("nan")

    def __add__(self, other: Irradiance) -> Irradiance:
        """Light from two independent estimates together."""
        return Irradiance(self.value + other.value, np.hypot(self.standard_error, other.standard_error))


@dataclass(frozen=True)
class IrradianceEstimate:
    """Irradiance at N points as sums over independent samples, so that two estimates of the same points merge.

    A sample is one particle scaled to the scene's full power, or one round of shadow rays. It alone would give X at a
    point; then

    total    (N, 3) sum of X over the samples, W/m^2, RGB
    squares  (N, 3) sum of X^2, (W/m^2)^2
    samples  how many there are
    single   (N, 3) X^2 that one crossing more would bring, on average over all segments; 0 for shadow rays
    """

    total: np.ndarray
    squares: np.ndarray
    samples: int
    single: np.ndarray | float = 0.0

    @classmethod
    def empty(cls, points: int) -> IrradianceEstimate:
        """The estimate before the first sample."""
        return cls(np.zeros((points, 3)), np.zeros((points, 3)), 0)

    @property
    def irradiance(self) -> Irradiance:
        """The mean of X, and its standard error sqrt((mean X^2 - (mean X)^2) / (n - 1)) from its variance.

        Of particles, the mean is the flux of the segments that cross a disc over its area [study, DETP]. The standard
        error counts one crossing more than there were: where few crossed, and least of all where none did, the
        crossings alone do not tell how many it might have been (as Agresti and Coull 1998 do for proportions). From few
        samples it is widened as Student's t asks, so that twice of it holds 95 % at any number.
        """
        count = self.samples
        mean = self.total / max(count, 1)
        if count < 2:
            return Irradiance(mean, np.full(mean.shape, np.inf))
        variance = np.maximum((self.squares + self.single) / count - mean**2, 0.0)
        return Irradiance(mean, _student(count - 1) * np.sqrt(variance / (count - 1)))

    def merged(self, other: IrradianceEstimate) -> IrradianceEstimate:
        """This estimate together with an independent one of the same points.

        Raises InvalidArrayError when the number of points differs.
        """
        if self.total.shape != other.total.shape:
            raise InvalidArrayError("Only estimates of the same points can be merged.")
        samples = self.samples + other.samples
        single = (self.single * self.samples + other.single * other.samples) / max(samples, 1)
        return IrradianceEstimate(self.total + other.total, self.squares + other.squares, samples, single)


def _student(freedom: int) -> float:
    """The 97.5 % quantile of Student's t over that of the normal distribution (Abramowitz and Stegun 26.7.5)."""
    z = 1.959964
    terms = (
        z,
        (z**3 + z) / 4,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
    )
    return sum(term / freedom**power for power, term in enumerate(terms)) / z


class Accumulator:
    """Adds the crossings of one batch of ``particles`` up to an :class:`IrradianceEstimate`.

    Only crossings inside the ``visible`` area count, and are divided by it.
    """

    def __init__(self, discs: TangentDiscs, segments: Segments, particles: int, visible: VisibleArea):
        self._segments = segments
        self._sums = CrossingSums(discs, segments, visible)
        self._scale = particles / visible.areas
        self._particles = particles
        self._repeated = RepeatedCrossings(len(discs), segments)

    def add(self, crossings: Crossings) -> None:
        """Count these crossings in; each pair must come once."""
        if len(crossings):
            self._repeated.add(self._sums.add(crossings))

    def estimate(self) -> IrradianceEstimate:
        """What has been added up so far."""
        scale = self._scale[:, None]
        squares = self._sums.squares + self._repeated.products()
        single = (self._segments.flux**2).sum(axis=0) / max(len(self._segments), 1)
        return IrradianceEstimate(self._sums.total * scale, squares * scale**2, self._particles, single * scale**2)
