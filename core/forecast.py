"""What a bake will take and how well it will turn out, before anything of it is computed.

The error e asks for about 1 / e^2 crossings of each disc, whatever the scene: their number, the photons, the rays and
the points are what a bake spends its time on. The automatic radius sees to it that the photons bring these crossings.
Where light is gathered, the first rounds of rays, which all bakes cast, are often enough already, and many lamps leave
more noise. Reference seconds become this machine's by core/machine.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .costs import CROSSING, FIRST_GATHERED, GATHERED, LAMP, START, WHOLE_PHOTON, WHOLE_POINT, WHOLE_RAY
from .machine import this_machine
from .refinement import FIRST_PHOTONS
from .settings import BakeSettings, error_for, photons_for

#: Photons over those that the radius is chosen for: often it may not become as large as that would ask for.
MORE_PHOTONS = 3.0

#: Standard error over the median error of normal noise; mean square over squared mean of the crossings' flux.
DEVIATION, UNEVEN = 1.48, 1.5

#: Shadow rays of a point for an error of a tenth; they grow as 1 / error.
RAYS = 30.0

#: Errors between which a bake of a given time is looked for.
ERRORS = (0.001, 0.9)


@dataclass(frozen=True)
class Forecast:
    """Wall ``seconds`` of a bake, and the ``error`` by which half of its lit points will be off at most."""

    seconds: float
    error: float


def forecast(
    points: int, settings: BakeSettings, factor: float = 1.0, lamps: float = 0, before: float = 0.0
) -> Forecast:
    """What baking so many ``points`` among so many ``lamps`` is likely to take, with what takes so many seconds of one
    processor of the reference ``before``; ``factor`` corrects the time by what a scene took the last time."""
    given = points, settings, lamps, before
    if settings.time_alone:
        # A bake does what it can, however short its time.
        seconds = max(settings.seconds, 2.0 * factor * START)
        low, high = np.log(ERRORS)
        for _ in range(30):
            middle = 0.5 * (low + high)
            late = factor * _wall_seconds(np.exp(middle), *given) > seconds
            low, high = (middle, high) if late else (low, middle)
        return Forecast(settings.seconds, float(np.exp(high)))
    error = _error(settings)
    return Forecast(factor * _wall_seconds(error, *given), error)


def processor_seconds(points: int, settings: BakeSettings) -> float:
    """Seconds of one processor of the reference that baking so many ``points`` is likely to take."""
    if settings.time_alone:
        return settings.seconds
    return WHOLE_POINT * points + _shared_seconds(_error(settings), points, settings)


def _error(settings: BakeSettings) -> float:
    """Which error is aimed at."""
    by_photons = settings.photons is not None and settings.sends_photons
    return float(error_for(settings.photons) if by_photons else settings.target_error)


def _wall_seconds(error: float, points: int, settings: BakeSettings, lamps: float, before: float) -> float:
    machine = this_machine()
    shared = machine.wall_seconds(before + _shared_seconds(error, points, settings, lamps))
    return START + machine.slowness * WHOLE_POINT * points + shared


def _shared_seconds(error: float, points: int, settings: BakeSettings, lamps: float = 0) -> float:
    """Seconds of one processor of the reference for all that all processors do."""
    seconds = 0.0
    if settings.direct_by == "shadow-rays":
        seconds += WHOLE_RAY * RAYS * (0.1 / error) * points
    if settings.sends_photons:
        crossings = UNEVEN / (DEVIATION * error) ** 2
        gathers = settings.indirect_by == "gather" and settings.direct_by != "photons"
        photons = settings.photons or (FIRST_PHOTONS if gathers else MORE_PHOTONS * photons_for(error))
        each = CROSSING * crossings
        if gathers:
            each = (FIRST_GATHERED + GATHERED * crossings) * (1.0 + LAMP * lamps)
        seconds += WHOLE_PHOTON * photons + each * points
    return seconds
