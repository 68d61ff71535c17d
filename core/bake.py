"""The method on one page: shadow rays for the direct light, and for the rest: trace photons, gather the segments that
cross each disc, estimate, repeat."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from .direct_light import DirectLight
from .discs import TangentDiscs
from .enclosure import hidden_points
from .errors import NoMeshError
from .estimate import Irradiance
from .gatherers.choose import make_gatherer
from .photon_light import PHOTONS_PER_GATHER, PhotonLight
from .radius import check_radius, choose_radius
from .rays import RayCaster
from .scene import Scene
from .settings import BakeSettings
from .stopwatch import Stopwatch
from .tracing import PhotonTracer
from .visible_area import VisibleDiscs, visible_discs, whole_discs

#: Particles whose segments tell which gatherer is the fastest.
PILOT_PHOTONS = 1 << 11

#: What the shadow rays are taken for in the progress, when photons follow.
SHADOW_SHARE = 0.2


@dataclass(frozen=True)
class Progress:
    """Where a bake stands: what it is doing, the share done (0..1), and the light found so far, if any."""

    phase: str
    fraction: float
    light: Irradiance | None = None


@dataclass(frozen=True)
class BakeResult:
    """What a bake found, and how.

    direct        irradiance at the N points that comes straight from the lights, with its standard error
    indirect      irradiance after at least one reflection or refraction; what was not asked for is zero
    hidden        (N,) points that no light can reach because they are buried in other geometry: nothing is known there
    radius        of the discs, metres
    gatherer      name, and ``reason`` for its choice
    photons, segments   how many were traced and gathered
    seconds       wall time by stage: radius, place (the discs), shadow (rays), trace, gather
    emitted_flux  (3,) W from all lights; ``cut_flux`` (3,) W that the bounce limit cut off
    """

    direct: Irradiance
    indirect: Irradiance
    hidden: np.ndarray
    radius: float
    gatherer: str
    reason: str
    photons: int
    segments: int
    seconds: dict[str, float]
    emitted_flux: np.ndarray
    cut_flux: np.ndarray

    @property
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
        """Median over the lit points of standard error over irradiance, of the RGB sums; NaN when all are dark."""
        return self.light.relative_error


def bake(
    scene: Scene, centres: np.ndarray, normals: np.ndarray, settings: BakeSettings, inward: np.ndarray | None = None
) -> Generator[Progress, None, BakeResult]:
    """Estimate the irradiance at points ``centres`` (N, 3) m with unit ``normals`` (N, 3), step by step.

    ``inward`` (N, 3) metres leads from points on an edge into their own faces (see core/visible_area.py); None when all
    points lie inside faces.

    Yields a Progress often (a user interface calls next() between redraws; closing the generator cancels) and
    returns a BakeResult. Memory is bounded by the batch. Raises NoMeshError without points, NoLightError without
    light, InvalidSettingError and InvalidArrayError on bad input.
    """
    if len(centres) == 0:
        raise NoMeshError("There is no vertex to bake: choose at least one mesh with faces.")
    stopwatch = Stopwatch("radius", "place", "shadow", "trace", "gather")
    yield Progress("Choosing the radius", 0.0)
    with stopwatch("radius"):
        caster = RayCaster(scene.corners)
        if settings.radius is not None:
            check_radius(settings.radius, scene)
        radius = settings.radius or choose_radius(scene, caster, centres, normals, settings)
    with stopwatch("trace"):
        bounces = settings.bounces if settings.indirect else 0
        by_photons = settings.direct_by == "photons"
        tracer = PhotonTracer(scene, caster, scene.bounds.expanded(2 * radius), bounces, by_photons)

    discs = TangentDiscs.of_radius(centres, normals, radius)
    placing = whole_discs(caster, discs) if settings.estimator == "plain" else visible_discs(caster, discs, inward)
    parts = []
    for part in stopwatch.timed("place", placing):
        parts.append(part)
        yield Progress("Placing the discs", 0.0)
    placed = VisibleDiscs.joined(parts)

    direct, done = Irradiance.dark(len(discs)), 0.0
    if settings.direct_by == "shadow-rays":
        done = SHADOW_SHARE if settings.indirect else 1.0
        rays = DirectLight(scene, caster, placed.origins, placed.discs.normals, settings)
        for share in stopwatch.timed("shadow", rays.rounds(0, settings.shadow_rounds)):
            yield Progress("Casting shadow rays", share * done)
        direct = rays.irradiance

    kinds = [kind for kind, wanted in (("direct", by_photons), ("indirect", settings.indirect)) if wanted]
    light, count = direct, settings.photon_count if kinds else 0
    with stopwatch("gather"):
        pilot = tracer.trace(PILOT_PHOTONS, np.random.default_rng(settings.seed)).segments
        expected = max(1, count * len(pilot) // PILOT_PHOTONS)
        searched = placed.discs if kinds else placed.discs.taken(slice(0))
        gatherer, reason = make_gatherer(settings.gatherer, searched, expected, pilot)
    photons = PhotonLight(tracer, gatherer, placed, kinds, settings.seed)
    while photons.particles < count:
        first, particles = photons.particles, min(PHOTONS_PER_GATHER, count - photons.particles)
        for phase, share in photons.batch(particles, stopwatch):
            yield Progress(phase, done + (1.0 - done) * (first + share * particles) / count, light)
        light = direct + photons.part("direct") + photons.part("indirect")
    return BakeResult(
        direct=direct + photons.part("direct"),
        indirect=photons.part("indirect"),
        hidden=hidden_points(placed.area, light.value),
        radius=radius,
        gatherer=gatherer.name,
        reason=reason,
        photons=photons.particles,
        segments=photons.segments,
        seconds=stopwatch.seconds,
        emitted_flux=tracer.emitted_flux,
        cut_flux=photons.cut_flux,
    )
