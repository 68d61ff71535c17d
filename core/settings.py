"""What the user may trade: photons against time, radius against blur."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .errors import InvalidSettingError

#: quality -> error that it aims at: half of the lit points are to be off by less
QUALITIES = {"draft": 0.08, "preview": 0.04, "final": 0.02}

#: Share of an error that is left to noise and to the blur that a bake can measure; the rest, in squares, is for blur
#: that noise hides.
NOISE_SHARE = 0.85

#: Particles with which an error of REFERENCE_ERROR is aimed at, and how their number grows as the error shrinks. Noise
#: falls as 1 / (d sqrt n); the blur of a disc of radius d grew more slowly than d in the scenes that were measured,
#: and where both shrink together as d does, n grows as e^-4.
REFERENCE_PHOTONS, REFERENCE_ERROR, GROWTH = 3 << 18, 0.04, 4.0

#: A quality gives up on its error at so many times the particles it counts on, an error that was asked for later.
QUALITY_PATIENCE, ERROR_PATIENCE = 8, 64

#: the gatherers that a user may ask for, and what they are called in sentences
GATHERERS = {
    "auto": "Automatic", "disc-index": "Disc Indexing", "sphere-cache": "Sphere Cache", "hybrid": "Hybrid",
    "brute-force": "Brute Force",
}  # fmt: skip

#: visible: the part of each disc that its centre sees; plain: the whole disc, as in the study
ESTIMATORS = ("visible", "plain")

#: how light that was reflected is found: gathered by rays from each point over what DETP finds where they land, by
#: photons on discs at the points themselves, as in the study, or not at all
INDIRECT_LIGHT = ("gather", "photons", "off")

#: how the light that comes straight from the lights is found, if at all
DIRECT_LIGHT = ("shadow-rays", "photons", "none")


@dataclass(frozen=True)
class BakeSettings:
    """How to bake. ``None`` leaves the choice to the bake.

    quality   draft, preview or final: the error to bake to where neither photons nor error nor seconds are given
    photons   particles to emit, >= 1
    radius    of the tangent discs, metres, > 0
    bounces   most reflections of one photon path, >= 0
    seed      of the random numbers; equal seeds give equal results on any number of threads
    gatherer  one of GATHERERS
    estimator one of ESTIMATORS
    direct    one of DIRECT_LIGHT; None takes shadow rays, and with the plain estimator photons, as in the study
    indirect  one of INDIRECT_LIGHT; None gathers, and with the plain estimator takes photons, as in the study
    shadow_distance  metres, > 0, beyond which surfaces do not shade a point from the world (for ambient occlusion);
              None for no limit
    error     bake until half of the lit points are estimated to be off by less than this share, in 0..1
    seconds   bake for so long, > 0; whichever of photons, error and seconds comes first ends the bake

    Raises InvalidSettingError on anything else.
    """

    quality: str = "preview"
    photons: int | None = None
    radius: float | None = None
    bounces: int = 64
    seed: int = 0
    gatherer: str = "auto"
    estimator: str = "visible"
    direct: str | None = None
    indirect: str | None = None
    shadow_distance: float | None = None
    error: float | None = None
    seconds: float | None = None

    def __post_init__(self):
        for what, chosen, allowed in (
            ("quality", self.quality, QUALITIES),
            ("gatherer", self.gatherer, GATHERERS),
            ("estimator", self.estimator, ESTIMATORS),
            ("way to direct light", self.direct, (None, *DIRECT_LIGHT)),
            ("way to indirect light", self.indirect, (None, *INDIRECT_LIGHT)),
        ):
            if chosen not in allowed:
                choices = ", ".join(filter(None, allowed))
                raise InvalidSettingError(f"Unknown {what} '{chosen}': choose {choices}.")
        if self.estimator == "plain" and self.indirect == "gather":
            raise InvalidSettingError(
                "The plain estimator counts whole discs at the points themselves: leave gathering to the visible one."
            )
        if self.direct == "none" and self.indirect == "off":
            raise InvalidSettingError("Without direct and indirect light nothing is left to bake: choose at least one.")
        if self.error is not None and not 0 < self.error < 1:
            raise InvalidSettingError(f"The error to aim at must lie between 0 and 100 %, not {self.error:.3g}.")
        if self.seconds is not None and not (math.isfinite(self.seconds) and self.seconds > 0):
            raise InvalidSettingError(f"The time to bake must be a finite number above 0 s, not {self.seconds:g}.")
        if self.photons is not None and self.photons < 1:
            raise InvalidSettingError(f"At least 1 photon is needed, not {self.photons}.")
        if self.radius is not None and not (math.isfinite(self.radius) and self.radius > 0):
            raise InvalidSettingError(f"The disc radius must be a finite number above 0 m, not {self.radius:g}.")
        if self.shadow_distance is not None and not self.shadow_distance > 0:
            raise InvalidSettingError(f"The distance of shadows must be above 0 m, not {self.shadow_distance:g}.")
        if self.bounces < 0:
            raise InvalidSettingError(f"The number of bounces must be 0 or more, not {self.bounces}.")
        if self.seed < 0:
            raise InvalidSettingError(f"The seed must be 0 or more, not {self.seed}.")

    @property
    def time_alone(self) -> bool:
        """Whether nothing but a time ends the bake."""
        return self.seconds is not None and self.error is None and self.photons is None

    @property
    def aimed_noise(self) -> float | None:
        """The error by noise at which the bake ends; None when time or photons alone end it.

        A number of photons ends no bake that sends none.
        """
        photons_end_it = self.photons is not None and self.sends_photons
        if self.error is None and (photons_end_it or self.seconds is not None):
            return None
        return NOISE_SHARE * self.target_error

    @property
    def target_error(self) -> float:
        """The error at which the automatic radius aims, noise and blur together."""
        return self.error if self.error is not None else QUALITIES[self.quality]

    @property
    def expected_photons(self) -> int:
        """Particles that the bake is likely to need, when time does not limit them."""
        return self.photons if self.photons is not None else photons_for(self.target_error)

    @property
    def most_photons(self) -> int | None:
        """Particles after which the bake ends in any case; None when only its time ends it."""
        if self.photons is not None:
            return self.photons
        if self.error is not None:
            return ERROR_PATIENCE * photons_for(self.error)
        return QUALITY_PATIENCE * photons_for(self.target_error) if self.seconds is None else None

    @property
    def sends_photons(self) -> bool:
        """Whether photons find any of the light of surfaces that reflect diffusely.

        Where light is gathered, shadow rays light what rays land on, and photons bring what is reflected twice.
        """
        least = {"photons": 1, "gather": 2}.get(self.indirect_by, math.inf)
        return self.direct_by == "photons" or self.bounces >= least

    @property
    def direct_by(self) -> str:
        """How direct light is found, one of DIRECT_LIGHT."""
        return self.direct or ("photons" if self.estimator == "plain" else "shadow-rays")

    @property
    def indirect_by(self) -> str:
        """How indirect light is found, one of INDIRECT_LIGHT."""
        return self.indirect or ("photons" if self.estimator == "plain" else "gather")


def photons_for(error: float) -> int:
    """Particles with which the automatic radius aims at an ``error``, see REFERENCE_PHOTONS."""
    return max(1, round(REFERENCE_PHOTONS * (REFERENCE_ERROR / error) ** GROWTH))


def error_for(photons: float) -> float:
    """The error at which the automatic radius aims with so many ``photons``."""
    return REFERENCE_ERROR * (REFERENCE_PHOTONS / photons) ** (1.0 / GROWTH)
