"""What the user may trade: photons against time, radius against blur."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .errors import InvalidSettingError

#: quality -> (photons, relative standard error that the automatic radius aims at, rounds of shadow rays)
QUALITIES = {
    "draft": (1 << 18, 0.12, 8),
    "preview": (1 << 21, 0.06, 16),
    "final": (1 << 24, 0.04, 32),
}

#: names of the gatherers a user may ask for
GATHERERS = ("auto", "disc-index", "sphere-cache", "brute-force")


#: visible: the part of each disc that its centre sees; plain: the whole disc, as in the study
ESTIMATORS = ("visible", "plain")

#: how the light that comes straight from the lights is found, if at all
DIRECT_LIGHT = ("shadow-rays", "photons", "none")


@dataclass(frozen=True)
class BakeSettings:
    """How to bake. ``None`` takes the quality's value, or for the radius the automatic one.

    quality   draft, preview or final
    photons   particles to emit, >= 1
    radius    of the tangent discs, metres, > 0
    bounces   most reflections of one photon path, >= 0
    seed      of the random numbers; equal seeds give equal results on any number of threads
    gatherer  one of GATHERERS
    estimator one of ESTIMATORS
    direct    one of DIRECT_LIGHT; None takes shadow rays, and with the plain estimator photons, as in the study
    indirect  whether light is followed over reflections and refractions
    shadow_distance  metres, > 0, beyond which surfaces do not shade a point from the world (for ambient occlusion);
              None for no limit

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
    indirect: bool = True
    shadow_distance: float | None = None

    def __post_init__(self):
        if self.quality not in QUALITIES:
            raise InvalidSettingError(f"Unknown quality '{self.quality}': choose {', '.join(QUALITIES)}.")
        if self.gatherer not in GATHERERS:
            raise InvalidSettingError(f"Unknown gatherer '{self.gatherer}': choose {', '.join(GATHERERS)}.")
        if self.estimator not in ESTIMATORS:
            raise InvalidSettingError(f"Unknown estimator '{self.estimator}': choose {', '.join(ESTIMATORS)}.")
        if self.direct is not None and self.direct not in DIRECT_LIGHT:
            raise InvalidSettingError(f"Unknown way to direct light '{self.direct}': choose {', '.join(DIRECT_LIGHT)}.")
        if self.direct == "none" and not self.indirect:
            raise InvalidSettingError("Without direct and indirect light nothing is left to bake: choose at least one.")
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
    def photon_count(self) -> int:
        """Particles to emit."""
        return self.photons if self.photons is not None else QUALITIES[self.quality][0]

    @property
    def target_error(self) -> float:
        """Relative standard error at which the automatic radius aims."""
        return QUALITIES[self.quality][1]

    @property
    def shadow_rounds(self) -> int:
        """Rounds of shadow rays from each point (see core/direct_light.py)."""
        return QUALITIES[self.quality][2]

    @property
    def direct_by(self) -> str:
        """How direct light is found, one of DIRECT_LIGHT."""
        return self.direct or ("photons" if self.estimator == "plain" else "shadow-rays")
