"""The automatic disc radius: as small as the noise that the user accepts allows."""

from __future__ import annotations

import numpy as np

from .direct_light import DirectLight
from .discs import TangentDiscs
from .errors import InvalidSettingError
from .estimate import Accumulator, Irradiance
from .gatherers.choose import make_gatherer
from .rays import RayCaster
from .scene import Scene
from .settings import BakeSettings
from .tracing import PhotonTracer
from .visible_area import whole_discs

#: Particles of the pilot trace, and the most points that it looks at.
PILOT_PHOTONS = 1 << 15
PILOT_POINTS = 2000

#: Rounds of shadow rays from these points.
PILOT_ROUNDS = 2

#: Indirect light alone may have this many times the target error, so that it is smooth where no direct light hides it.
INDIRECT_ALLOWANCE = 2.0

#: The automatic radius stays within these shares of the scene's radius: below, rounding would show; above, blur.
SMALLEST_SHARE = 1e-5
LARGEST_SHARE = 0.05

#: A radius that a user asks for may be as small and as large, in radii of the scene: beyond, arithmetic breaks down.
LEAST_WANTED, MOST_WANTED = 1e-12, 1e12


def check_radius(radius: float, scene: Scene) -> None:
    """Raise InvalidSettingError when ``radius``, metres, is out of all proportion to the scene's."""
    size = scene.bounds.radius
    if not LEAST_WANTED * size <= radius <= MOST_WANTED * size:
        raise InvalidSettingError(
            f"The disc radius of {radius:g} m is out of all proportion to the scene, whose radius is {size:g} m: "
            f"choose another, or remove objects that are far away."
        )


def choose_radius(
    scene: Scene, caster: RayCaster, centres: np.ndarray, normals: np.ndarray, settings: BakeSettings
) -> float:
    """Radius in metres at which the settings' photons give their target error at the median lit point.

    A pilot trace measures the relative standard error e0 with n0 particles at radius d0. The flux through a disc
    grows as d^2 n, hence e = e0 (d0/d) sqrt(n0/n), solved for d. Light that shadow rays will bring counts in the
    irradiance, but not in the error; the indirect light alone may then have INDIRECT_ALLOWANCE times the target.
    ``centres`` and ``normals`` are (N, 3).
    """
    size = scene.bounds.radius
    pilot_radius = LARGEST_SHARE * size
    by_photons = settings.direct_by == "photons"
    if not (settings.indirect or by_photons):
        return pilot_radius
    generator = np.random.default_rng(np.random.SeedSequence(settings.seed, spawn_key=(0,)))
    rows = np.arange(len(centres))
    if len(rows) > PILOT_POINTS:
        rows = np.sort(generator.choice(rows, PILOT_POINTS, replace=False))
    (placed,) = whole_discs(caster, TangentDiscs.of_radius(centres[rows], normals[rows], pilot_radius))
    bounces = settings.bounces if settings.indirect else 0
    tracer = PhotonTracer(scene, caster, scene.bounds.expanded(pilot_radius), bounces, by_photons)
    segments = tracer.trace(PILOT_PHOTONS, generator).segments
    accumulator = Accumulator(placed.discs, segments, PILOT_PHOTONS, placed.area)
    gatherer, _ = make_gatherer("disc-index", placed.discs, len(segments), segments)
    for crossings in gatherer.crossings(segments):
        accumulator.add(crossings)
    light = accumulator.estimate().irradiance
    error = light.relative_error
    if settings.direct_by == "shadow-rays":
        light += _certain_light(DirectLight(scene, caster, placed.origins, placed.discs.normals, settings))
        error = np.fmax(error / INDIRECT_ALLOWANCE, light.relative_error)
    if not (np.isfinite(error) and error > 0):
        return pilot_radius
    radius = pilot_radius * error / settings.target_error * np.sqrt(PILOT_PHOTONS / settings.photon_count)
    return float(np.clip(radius, SMALLEST_SHARE * size, LARGEST_SHARE * size))


def _certain_light(direct: DirectLight) -> Irradiance:
    """What a few shadow rays find, without its error, which the radius does not change."""
    for _ in direct.rounds(0, PILOT_ROUNDS):
        pass
    value = direct.irradiance.value
    return Irradiance(value, np.zeros_like(value))
