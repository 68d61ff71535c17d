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
from .estimate import Accumulator, Irradiance, IrradianceEstimate
from .gatherers.choose import make_gatherer
from .parallel import ordered_map
from .radius import check_radius, choose_radius
from .rays import RayCaster
from .scene import Scene
from .segments import Segments
from .settings import BakeSettings
from .stopwatch import Stopwatch
from .tracing import PhotonTracer
from .visible_area import VisibleDiscs, visible_discs, whole_discs

#: Particles traced at a time, and gathered at a time. Fixed, because the random numbers follow from them:
#: a seed gives the same light whatever the machine, the gatherer or the number of threads.
PHOTONS_PER_TRACE = 1 << 15
PHOTONS_PER_GATHER = 1 << 18

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
    with stopwatch("gather"):
        gatherer, reason = make_gatherer(settings.gatherer, placed.discs)

    direct, done = Irradiance.dark(len(discs)), 0.0
    if settings.direct_by == "shadow-rays":
        rest = 1.0 - SHADOW_SHARE if settings.indirect else 0.0
        light = DirectLight(scene, caster, placed.origins, placed.discs.normals, settings)
        for share in stopwatch.timed("shadow", light.rounds(0, settings.shadow_rounds)):
            yield Progress("Casting shadow rays", share * (1.0 - rest))
        direct, done = light.irradiance, 1.0 - rest

    wanted = {"direct": by_photons, "indirect": settings.indirect}
    estimates = {kind: IrradianceEstimate.empty(len(discs)) for kind in wanted if wanted[kind]}
    photons = settings.photon_count if estimates else 0
    segment_count, cut = 0, np.zeros(3)
    for first in range(0, photons, PHOTONS_PER_GATHER):
        particles = min(PHOTONS_PER_GATHER, photons - first)
        starts = range(first, first + particles, PHOTONS_PER_TRACE)
        shares = [min(PHOTONS_PER_TRACE, first + particles - start) for start in starts]
        traces = ordered_map(
            lambda task: tracer.trace(task[0], _generator(settings.seed, task[1]), task[1]),
            zip(shares, starts, strict=True),
        )
        light = sum((estimate.irradiance for estimate in estimates.values()), direct)
        yield Progress("Tracing photons", done + (1 - done) * first / photons, light)
        parts = []
        for share, start, traced in zip(shares, starts, stopwatch.timed("trace", traces), strict=True):
            # Each part carries the scene's full power; in its batch it stands for its share of the particles.
            parts.append(traced.segments.weighted(share / particles))
            cut += traced.cut_flux * (share / photons)
            yield Progress("Tracing photons", done + (1 - done) * (start + share) / photons, light)
        segments = Segments.joined(parts)
        segment_count += len(segments)
        fraction = done + (1 - done) * (first + particles) / photons
        for kind, estimate in estimates.items():
            of_kind = segments.direct if kind == "direct" else segments.indirect
            accumulator = Accumulator(placed.discs, of_kind, particles, placed.area)
            yield Progress("Gathering", fraction, light)
            for crossings in stopwatch.timed("gather", gatherer.crossings(of_kind)):
                with stopwatch("gather"):
                    accumulator.add(crossings)
                yield Progress("Gathering", fraction, light)
            estimates[kind] = estimate.merged(accumulator.estimate())
    direct = estimates["direct"].irradiance if by_photons else direct
    indirect = estimates["indirect"].irradiance if settings.indirect else Irradiance.dark(len(discs))
    return BakeResult(
        direct=direct,
        indirect=indirect,
        hidden=hidden_points(placed.area, (direct + indirect).value),
        radius=radius,
        gatherer=gatherer.name,
        reason=reason,
        photons=photons,
        segments=segment_count,
        seconds=stopwatch.seconds,
        emitted_flux=tracer.emitted_flux,
        cut_flux=cut,
    )


def _generator(seed: int, start: int) -> np.random.Generator:
    """The random numbers of the particles from ``start`` on; key 0 is the pilot's (see core/radius.py)."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1, start)))
