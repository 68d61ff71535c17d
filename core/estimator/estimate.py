"""From crossings to irradiance: the density estimate, its running sums and its standard error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..discs import TangentDiscs
from ..errors import InvalidArrayError
from ..gatherers.gatherer import Crossings
from ..irradiance import Irradiance
from ..segments import Segments
from .crossing_sums import CrossingSums
from .repeated_crossings import RepeatedCrossings
from .visible_area import VisibleArea


@dataclass(frozen=True)
class IrradianceEstimate:
    """Irradiance at N points as sums over independent samples, so that two estimates of the same points merge.

    A sample is one particle scaled to the scene's full power, or one round of shadow rays. It alone would give X at a
    point; then

    total    (N, 3) sum of X over the samples, W/m^2, RGB
    squares  (N, 3) sum of X^2, (W/m^2)^2
    samples  how many there are
    single   (N, 3) X^2 that one crossing more would likely bring; 0 for shadow rays
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
            self._repeated.add(crossings, self._sums.add(crossings))

    def estimate(self) -> IrradianceEstimate:
        """What has been added up so far."""
        scale = self._scale[:, None]
        squares = self._sums.squares + self._repeated.products()
        return IrradianceEstimate(
            self._sums.total * scale, squares * scale**2, self._particles, self._single() * scale**2
        )

    def _single(self) -> np.ndarray:
        """Squared flux (N, 3) of a crossing more: the mean of the disc's own crossings and one like those of all discs.

        Aimed lights send particles of unlike flux to unlike places, so that all segments' mean says little of a disc.
        As many equal crossings as would have the same sums count, (sum f)^2 / sum f^2.
        """
        total, squares = self._sums.total, self._sums.squares
        equal = np.divide(total**2, squares, out=np.zeros_like(squares), where=squares > 0)
        mean = (self._segments.flux**2).sum(axis=0) / max(len(self._segments), 1)
        everywhere = np.divide(squares.sum(axis=0), equal.sum(axis=0), out=mean, where=equal.any(axis=0))
        return (squares + everywhere) / (equal + 1.0)
