"""What a bake says while it works, and what it found."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .fit.settled import Settled
from .irradiance import Irradiance


@dataclass(frozen=True)
class Progress:
    """Where a bake stands: what it is doing, and the share done (0..1).

    ``found`` is its BakeResult so far, at once after a step that changed it, so that it can be shown; else None.
    """

    phase: str
    fraction: float
    found: BakeResult | None = None


@dataclass(frozen=True)
class BakeResult:
    """What a bake found, and how.

    direct        irradiance at the N points that comes straight from the lights, with its standard error
    indirect      irradiance after at least one reflection or refraction; what was not asked for is zero
    seen          all light, with the errors that are left where it is shown
    doubtful      (N,) points by whose error the bake ends: what was lit, and not sure, when it was first known
    hidden        (N,) points that no light can reach because they are buried in other geometry: nothing is known there
    open          (N,) how well each point can be seen, 0..1: little from within a narrow gap
    coarse        (N,) points on faces too small to be told apart so far from most of the points
    radius        of the discs, metres; 0 as long as none is chosen
    gatherer      name, and ``reason`` for its choice
    photons, segments   how many were traced and gathered
    shadow_rays    how many were cast
    seconds       wall time by stage: radius, place (the discs), shadow (rays), trace, gather
    emitted_flux  (3,) W from all lights; ``cut_flux`` (3,) W that the bounce limit cut off
    settled       the values fitted to this light, where they are known
    """

    direct: Irradiance
    indirect: Irradiance
    seen: Irradiance
    doubtful: np.ndarray
    hidden: np.ndarray
    open: np.ndarray
    coarse: np.ndarray
    radius: float
    gatherer: str
    reason: str
    photons: int
    segments: int
    shadow_rays: int
    seconds: dict[str, float]
    emitted_flux: np.ndarray
    cut_flux: np.ndarray
    settled: Settled | None = None

    @cached_property
    def light(self) -> Irradiance:
        """Direct and indirect light together."""
        return self.direct + self.indirect

    @property
    def irradiance(self) -> np.ndarray:
        """Irradiance E (N, 3), W/m^2, of all light."""
        return self.light.value

    @property
    def standard_error(self) -> np.ndarray:
        """Standard error (N, 3), W/m^2, of :attr:`irradiance`."""
        return self.light.standard_error

    @property
    def relative_error(self) -> float:
        """The share by which half of the lit points are likely to be off at most; NaN when all are dark."""
        return self.seen.relative_error

    @property
    def ending_error(self) -> float:
        """The same of the :attr:`doubtful` points alone."""
        return self.seen.error_among(self.doubtful)

    @property
    def high_error(self) -> float:
        """The share of the light that is seen by which nine tenths of the points are likely to be off at most."""
        return self.seen.high_error

    def __add__(self, other: BakeResult) -> BakeResult:
        """All that two bakes of the same points found, each in the light of other sources, from seeds of its own."""
        sums = "direct indirect seen photons segments shadow_rays emitted_flux cut_flux".split()
        return replace(
            self,
            doubtful=self.doubtful | other.doubtful,
            hidden=self.hidden & other.hidden,
            radius=max(self.radius, other.radius),
            settled=None,
            seconds={stage: seconds + other.seconds[stage] for stage, seconds in self.seconds.items()},
            **{name: getattr(self, name) + getattr(other, name) for name in sums},
        )
