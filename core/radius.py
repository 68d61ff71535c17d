"""The automatic disc radius: as small as the noise that the user accepts allows."""

from __future__ import annotations

import numpy as np

from .discs import TangentDiscs
from .estimate import Accumulator
from .gatherers.choose import make_gatherer
from .rays import RayCaster
from .scene import Scene
from .settings import BakeSettings
from .tracing import PhotonTracer

#: Particles of the pilot trace, and the most points that it looks at.
PILOT_PHOTONS = 1 << 15
PILOT_POINTS = 2000

#: The automatic radius stays within these shares of the scene's radius: below, rounding would show; above, blur.
SMALLEST_SHARE = 1e-5
LARGEST_SHARE = 0.05


def choose_radius(
    scene: Scene, caster: RayCaster, centres: np.ndarray, normals: np.ndarray, settings: BakeSettings
) -> float:
    """Radius in metres at which the settings' photons give their target error at the median lit point.

    A pilot trace measures the relative standard error e0 with n0 particles at radius d0. The flux through a disc
    grows as d^2 n, hence e = e0 (d0/d) sqrt(n0/n), solved for d. ``centres`` and ``normals`` are (N, 3).
    """
    size = scene.bounds.radius
    pilot_radius = LARGEST_SHARE * size
    generator = np.random.default_rng(np.random.SeedSequence(settings.seed, spawn_key=(0,)))
    rows = np.arange(len(centres))
    if len(rows) > PILOT_POINTS:
        rows = np.sort(generator.choice(rows, PILOT_POINTS, replace=False))
    discs = TangentDiscs.of_radius(centres[rows], normals[rows], pilot_radius)
    tracer = PhotonTracer(scene, caster, scene.bounds.expanded(pilot_radius), settings.bounces)
    segments = tracer.trace(PILOT_PHOTONS, generator).segments
    accumulator = Accumulator(discs, segments, PILOT_PHOTONS)
    gatherer, _ = make_gatherer("auto", discs)
    for crossings in gatherer.crossings(segments):
        accumulator.add(crossings)
    error = accumulator.estimate().relative_error
    if not np.isfinite(error):
        return pilot_radius
    radius = pilot_radius * error / settings.target_error * np.sqrt(PILOT_PHOTONS / settings.photon_count)
    return float(np.clip(radius, SMALLEST_SHARE * size, LARGEST_SHARE * size))
