"""From crossings to irradiance: the density estimate, its running sums and its standard error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .discs import TangentDiscs
from .errors import InvalidArrayError
from .gatherers.gatherer import Crossings
from .segments import Segments
from .visible_area import VisibleArea


@dataclass(frozen=True)
class IrradianceEstimate:
    """Irradiance at N points as sums over particles, so that two estimates of the same points merge.

    One particle alone, scaled to the scene's full power, would give X at a point; then

    total    (N, 3) sum of X over the particles, W/m^2, RGB
    squares  (N, 3) sum of X^2 over the crossings, (W/m^2)^2
    particles       how many were emitted
    """

    total: np.ndarray
    squares: np.ndarray
    particles: int

    @classmethod
    def empty(cls, points: int) -> IrradianceEstimate:
        """The estimate before the first particle."""
        return cls(np.zeros((points, 3)), np.zeros((points, 3)), 0)

    @property
    def irradiance(self) -> np.ndarray:
        """Irradiance E (N, 3) in W/m^2: flux of the crossing segments over the disc's area [study, DETP]."""
        return self.total / max(self.particles, 1)

    @property
    def standard_error(self) -> np.ndarray:
        """Standard error (N, 3) of :attr:`irradiance`, W/m^2.

        From the variance of X over the particles, sqrt((mean X^2 - (mean X)^2) / (n - 1)); a particle that
        crosses the same disc twice counts as two, which the discs' small share of the scene allows.
        """
        count = self.particles
        if count < 2:
            return np.full(self.total.shape, np.inf)
        variance = np.maximum(self.squares / count - (self.total / count) ** 2, 0.0)
        return np.sqrt(variance / (count - 1))

    @property
    def relative_error(self) -> float:
        """Median over the lit points of standard error over irradiance, of the RGB sums; NaN when all are dark."""
        mean = np.abs(self.irradiance).sum(axis=1)
        error = self.standard_error.sum(axis=1)
        lit = mean > 0
        return float(np.median(error[lit] / mean[lit])) if lit.any() else float("nan")

    def merged(self, other: IrradianceEstimate) -> IrradianceEstimate:
        """This estimate together with an independent one of the same points.

        Raises InvalidArrayError when the number of points differs.
        """
        if self.total.shape != other.total.shape:
            raise InvalidArrayError("Only estimates of the same points can be merged.")
        return IrradianceEstimate(
            self.total + other.total, self.squares + other.squares, self.particles + other.particles
        )


class Accumulator:
    """Adds the crossings of one batch of ``particles`` up to an :class:`IrradianceEstimate`.

    With a ``visible`` area only crossings inside it count and are divided by it, without one the whole disc.
    """

    def __init__(self, discs: TangentDiscs, segments: Segments, particles: int, visible: VisibleArea | None = None):
        self._discs, self._segments, self._visible = discs, segments, visible
        self._scale = particles / (discs.areas if visible is None else visible.areas)
        self._particles = particles
        self._total = np.zeros((len(discs), 3))
        self._squares = np.zeros((len(discs), 3))

    def add(self, crossings: Crossings) -> None:
        """Count these crossings in; each pair must come once."""
        if len(crossings) == 0:
            return
        if self._visible is not None:
            crossings = self._visible.kept(self._discs, self._segments, crossings)
        count = len(self._total)
        for channel in range(3):
            flux = self._segments.flux[crossings.segment, channel]
            self._total[:, channel] += np.bincount(crossings.disc, flux, count)
            self._squares[:, channel] += np.bincount(crossings.disc, flux * flux, count)

    def estimate(self) -> IrradianceEstimate:
        """What has been added up so far."""
        scale = self._scale[:, None]
        return IrradianceEstimate(self._total * scale, self._squares * scale**2, self._particles)
