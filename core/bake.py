"""The method on one page: shadow rays for the direct light, and for the rest: trace photons, gather the segments that
cross each disc, estimate; repeat until the error, the time or the photons that were asked for are reached."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from .checks import float_rows, unit_rows
from .direct.direct_light import DirectLight
from .discs import TangentDiscs
from .errors import NoMeshError
from .estimator.enclosure import hidden_points
from .estimator.standpoints import Standpoints, plain_standpoints, standpoints
from .estimator.visible_area import VisibleDiscs, visible_discs, whole_discs
from .gatherers.choose import make_gatherer
from .irradiance import Irradiance
from .photons.guiding import learn_guide
from .photons.photon_light import PhotonLight
from .photons.tracing import PhotonTracer
from .radius import Disc, check_radius, chosen_disc
from .rays import RayCaster
from .refinement import Refinement, first_rounds, look_in_every
from .scene import Scene
from .settings import BakeSettings
from .stopwatch import Stopwatch

Result = TypeVar("Result")

#: Particles whose segments tell which gatherer is the fastest.
PILOT_PHOTONS = 1 << 11


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
    hidden        (N,) points that no light can reach because they are buried in other geometry: nothing is known there
    radius        of the discs, metres; 0 as long as none is chosen
    gatherer      name, and ``reason`` for its choice
    photons, segments   how many were traced and gathered
    shadow_rays    how many were cast
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
    shadow_rays: int
    seconds: dict[str, float]
    emitted_flux: np.ndarray
    cut_flux: np.ndarray

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
        return self.light.relative_error


def bake(
    scene: Scene, centres: np.ndarray, normals: np.ndarray, settings: BakeSettings, inward: np.ndarray | None = None
) -> Generator[Progress, None, BakeResult]:
    """Estimate the irradiance at points ``centres`` (N, 3) m with unit ``normals`` (N, 3), step by step.

    ``inward`` (N, 3) metres leads from points on an edge into their own faces (estimator/visible_area.py); None when
    all points lie inside faces.

    Yields a Progress often (a user interface calls next() between redraws; closing the generator cancels) and
    returns a BakeResult. Memory is bounded by the batch. Raises NoMeshError without points, NoLightError without
    light, InvalidSettingError and InvalidArrayError on bad input.
    """
    if len(centres) == 0:
        raise NoMeshError("There is no vertex to bake: choose at least one mesh with faces.")
    centres = float_rows(centres, "points")
    normals = unit_rows(normals, "normals of points", len(centres))
    start = time.perf_counter()
    stopwatch = Stopwatch("radius", "place", "shadow", "trace", "gather")
    plain, by_photons = settings.estimator == "plain", settings.direct_by == "photons"
    if settings.radius is not None:
        check_radius(settings.radius, scene)
    yield Progress("Placing the points", 0.0)
    with stopwatch("place"):
        caster = RayCaster(scene.corners)
    before = stopwatch.seconds["place"]
    finding = plain_standpoints(caster, centres, normals) if plain else standpoints(caster, centres, normals, inward)
    places = Standpoints.joined((yield from _gathered("Placing the points", stopwatch.timed("place", finding))))
    standing = stopwatch.seconds["place"] - before

    rays, by_rays = None, Irradiance.dark(len(centres))
    if settings.direct_by == "shadow-rays":
        # Direct light first: it needs no disc, and is what a user sees soonest.
        rays = DirectLight(scene, caster, places.origins, normals, settings)
        for _ in stopwatch.timed("shadow", rays.rounds(0, first_rounds(rays, settings, start))):
            yield Progress("Casting shadow rays", 0.0)
        by_rays = rays.irradiance
        yield Progress("Casting shadow rays", 0.0, _only_direct(by_rays, settings, places, rays, stopwatch))

    yield Progress("Choosing the radius", 0.0)
    with stopwatch("radius"):
        if settings.radius is not None:
            disc = Disc(settings.radius, settings.expected_photons)
        else:
            disc = chosen_disc(scene, caster, centres, normals, settings, by_rays.value)
    with stopwatch("trace"):
        bounces = settings.bounces if settings.indirect else 0
        tracer = PhotonTracer(scene, caster, scene.bounds.expanded(2 * disc.radius), bounces, by_photons)

    discs = TangentDiscs.of_radius(centres, normals, disc.radius)
    if plain:
        placing = whole_discs(discs)
    else:
        placing = visible_discs(caster, discs, inward, look_in_every(settings, standing, start))
    placed = VisibleDiscs.joined((yield from _gathered("Placing the discs", stopwatch.timed("place", placing))))

    kinds = [kind for kind, wanted in (("direct", by_photons), ("indirect", settings.indirect)) if wanted]
    photons = PhotonLight(tracer, placed, kinds, settings.seed)
    gatherer, reason = make_gatherer(settings.gatherer, placed.discs.taken(slice(0)))

    def found() -> BakeResult:
        direct, indirect = by_rays + photons.part("direct"), photons.part("indirect")
        return BakeResult(
            direct=direct,
            indirect=indirect,
            hidden=hidden_points(placed.area.hidden, places.enclosed, direct.value + indirect.value),
            radius=disc.radius,
            gatherer=gatherer.name,
            reason=reason,
            photons=photons.particles,
            segments=photons.segments,
            shadow_rays=rays.rays if rays is not None else 0,
            seconds=stopwatch.seconds,
            emitted_flux=tracer.emitted_flux,
            cut_flux=photons.cut_flux,
        )

    result = found()
    refinement = Refinement(settings, rays, photons if kinds else None, stopwatch, start)
    refinement.observe(by_rays, photons.noise, result.light)
    while (step := refinement.next()) is not None:
        if step.rounds:
            last = rays.done + step.rounds
            work = stopwatch.timed("shadow", rays.rounds(rays.done, last, photons.part("indirect").value))
            for _ in work:
                yield Progress("Casting shadow rays", refinement.fraction)
            by_rays = rays.irradiance
        else:
            if photons.particles == 0:
                with stopwatch("gather"):
                    pilot = tracer.trace(PILOT_PHOTONS, np.random.default_rng(settings.seed)).segments
                    expected = max(1, disc.photons * len(pilot) // PILOT_PHOTONS)
                    gatherer, reason = make_gatherer(settings.gatherer, placed.discs, expected, pilot)
                likely = refinement.likely(disc.photons)
                aiming = learn_guide(tracer, gatherer, placed, kinds, result.irradiance, settings.seed, likely)
                guide = yield from _during("Aiming the lights", refinement.fraction, stopwatch.timed("trace", aiming))
                photons.prepare(gatherer, guide)
            for phase in photons.batch(step.photons, stopwatch):
                yield Progress(phase, refinement.fraction)
        result = found()
        refinement.observe(by_rays, photons.noise, result.light)
        yield Progress("Refining", refinement.fraction, result)
    return result


def _only_direct(
    light: Irradiance, settings: BakeSettings, places: Standpoints, rays: DirectLight, stopwatch: Stopwatch
) -> BakeResult:
    """What is known before there are discs and photons: of indirect light, nothing."""
    nothing, unknown = np.zeros(3), np.inf if settings.indirect else 0.0
    return BakeResult(
        direct=light,
        indirect=Irradiance(np.zeros_like(light.value), np.full_like(light.value, unknown)),
        hidden=hidden_points(np.zeros_like(places.enclosed), places.enclosed, light.value),
        radius=0.0,
        gatherer="none",
        reason="No photons were searched.",
        photons=0,
        segments=0,
        shadow_rays=rays.rays,
        seconds=stopwatch.seconds,
        emitted_flux=nothing,
        cut_flux=nothing,
    )


def _gathered(phase: str, parts: Iterable[Result]) -> Generator[Progress, None, list[Result]]:
    """Progress in that ``phase`` for each of the ``parts``; returns them all."""
    held = []
    for part in parts:
        held.append(part)
        yield Progress(phase, 0.0)
    return held


def _during(phase: str, done: float, steps: Generator[None, None, Result]) -> Generator[Progress, None, Result]:
    """Progress in that ``phase``, with so much ``done``, for each of the ``steps``; returns what they return."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
        yield Progress(phase, done)
