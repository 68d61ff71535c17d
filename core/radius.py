"""The automatic disc radius: as small as the noise that the user accepts allows."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from .costs import FOR_A_PHOTON, PLACING
from .discs import TangentDiscs
from .errors import InvalidSettingError
from .estimator.crossing_sums import Accumulator
from .estimator.visible_area import whole_discs
from .gatherers.disc_index import DiscIndex
from .irradiance import Irradiance
from .photons.tracing import PhotonTracer
from .random_streams import random_stream
from .rays import RayCaster
from .scene import Scene
from .settings import NOISE_SHARE, BakeSettings, error_for

#: Particles of the pilot trace, and the most points that it looks at.
PILOT_PHOTONS = 1 << 15
PILOT_POINTS = 2000

#: Indirect light alone may have this many times the target error, so that it is smooth where no direct light hides it.
INDIRECT_ALLOWANCE = 2.0

#: Radius of the pilot's discs, a share of the scene's, or of its part where most points are.
PILOT_SHARE = 0.05

#: The automatic radius stays within these shares of the scene's radius: below, rounding would show; above, the smallest
#: of the nested discs would blur.
SMALLEST_SHARE = 1e-5
LARGEST_SHARE = 0.1

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


def chosen_radius(
    scene: Scene,
    caster: RayCaster,
    centres: np.ndarray,
    normals: np.ndarray,
    settings: BakeSettings,
    direct: np.ndarray,
    kinds: Sequence[str],
) -> float:
    """The radius, metres, at which the expected photons give the settings' error at the median lit point.

    A pilot trace measures the relative error e0 with n0 particles at radius d0. The flux through a disc
    grows as d^2 n, hence e = e0 (d0/d) sqrt(n0/n), solved for d. ``direct`` (N, 3) W/m^2, which shadow rays have found,
    counts in the irradiance, but not in the error; the indirect light alone may then have INDIRECT_ALLOWANCE times the
    target. ``centres`` and ``normals`` are (N, 3); ``kinds`` of light are looked for at the discs.
    """
    start = time.perf_counter()
    size = min(scene.bounds.radius, caster.size)
    pilot_radius = PILOT_SHARE * size
    if not kinds:
        return pilot_radius
    generator = random_stream(settings.seed, "radius")
    rows = np.arange(len(centres))
    if len(rows) > PILOT_POINTS:
        rows = np.sort(generator.choice(rows, PILOT_POINTS, replace=False))
    (placed,) = whole_discs(TangentDiscs.of_radius(centres[rows], normals[rows], pilot_radius))
    bounces = settings.bounces if settings.indirect_by != "off" else 0
    tracer = PhotonTracer(scene, caster, scene.bounds.expanded(pilot_radius), bounces, "direct" in kinds)
    tracing = time.perf_counter()
    segments = tracer.trace(PILOT_PHOTONS, generator).segments
    segments = segments.of_kind("caustic") if kinds == ["caustic"] else segments
    traced = time.perf_counter()
    accumulator = Accumulator(placed.discs, segments, placed.area)
    for crossings in DiscIndex(placed.discs).crossings(segments):
        accumulator.add(crossings)
    light = accumulator.estimate(PILOT_PHOTONS).irradiance
    error = light.relative_error
    if settings.direct_by == "shadow-rays":
        light += Irradiance(direct[rows], np.zeros((len(rows), 3)))
        error = np.fmax(error / INDIRECT_ALLOWANCE, light.relative_error)
    photons, target = settings.expected_photons, settings.target_error
    if settings.time_alone:
        left = settings.seconds - (time.perf_counter() - start) - PLACING * len(centres)
        # The radius changes with the sixth root of such guesses.
        photons = max(int(PILOT_PHOTONS * left / (FOR_A_PHOTON * (traced - tracing))), PILOT_PHOTONS)
        target = error_for(photons)
    target *= NOISE_SHARE
    if not (np.isfinite(error) and error > 0):
        return pilot_radius
    wanted = pilot_radius * error / target * np.sqrt(PILOT_PHOTONS / photons)
    return float(np.clip(wanted, SMALLEST_SHARE * size, LARGEST_SHARE * size))
