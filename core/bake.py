"""The method on one page: trace photons, gather the segments that cross each disc, estimate, repeat."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from .discs import TangentDiscs
from .errors import NoMeshError
from .estimate import Accumulator, IrradianceEstimate
from .gatherers.choose import make_gatherer
from .parallel import ordered_map
from .radius import choose_radius
from .rays import RayCaster
from .scene import Scene
from .segments import Segments
from .settings import BakeSettings
from .tracing import PhotonTracer
from .visible_area import VisibleDiscs, visible_discs

Step = TypeVar("Step")

#: Particles traced at a time, and gathered at a time. Fixed, because the random numbers follow from them:
#: a seed gives the same light whatever the machine, the gatherer or the number of threads.
PHOTONS_PER_TRACE = 1 << 15
PHOTONS_PER_GATHER = 1 << 18


@dataclass(frozen=True)
class Progress:
    """Where a bake stands: what it is doing, the share done (0..1), and the estimate after the last whole batch."""

    phase: str
    fraction: float
    estimate: IrradianceEstimate | None = None


@dataclass(frozen=True)
class BakeResult:
    """What a bake found, and how.

    estimate      irradiance at the N points, with its standard error
    hidden        (N,) points that no light can reach because they are buried in other geometry: nothing is known there
    radius        of the discs, metres
    gatherer      name, and ``reason`` for its choice
    photons, segments   how many were traced
    seconds       wall time by stage: radius, place (the discs), trace, gather
    emitted_flux  (3,) W from all lights; ``cut_flux`` (3,) W that the bounce limit cut off
    """

    estimate: IrradianceEstimate
    hidden: np.ndarray
    radius: float
    gatherer: str
    reason: str
    photons: int
    segments: int
    seconds: dict[str, float]
    emitted_flux: np.ndarray
    cut_flux: np.ndarray


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
    stopwatch = _Stopwatch("radius", "place", "trace", "gather")
    yield Progress("Choosing the radius", 0.0)
    with stopwatch("radius"):
        caster = RayCaster(scene.corners)
        radius = settings.radius or choose_radius(scene, caster, centres, normals, settings)
    discs, visible = TangentDiscs.of_radius(centres, normals, radius), None
    if settings.estimator == "visible":
        yield Progress("Placing the discs", 0.0)
        placed = []
        inward = np.zeros_like(discs.centres) if inward is None else inward
        for part in stopwatch.timed("place", visible_discs(caster, discs, inward)):
            placed.append(part)
            yield Progress("Placing the discs", 0.0)
        joined = VisibleDiscs.joined(placed)
        discs, visible = joined.discs, joined.area
    with stopwatch("gather"):
        gatherer, reason = make_gatherer(settings.gatherer, discs)
    with stopwatch("trace"):
        tracer = PhotonTracer(scene, caster, scene.bounds.expanded(2 * radius), settings.bounces)

    estimate = IrradianceEstimate.empty(len(discs))
    segment_count, cut = 0, np.zeros(3)
    for first in range(0, settings.photon_count, PHOTONS_PER_GATHER):
        particles = min(PHOTONS_PER_GATHER, settings.photon_count - first)
        starts = range(first, first + particles, PHOTONS_PER_TRACE)
        shares = [min(PHOTONS_PER_TRACE, first + particles - start) for start in starts]
        traces = ordered_map(
            lambda task: tracer.trace(task[0], _generator(settings.seed, task[1])), zip(shares, starts, strict=True)
        )
        yield Progress("Tracing photons", first / settings.photon_count, estimate)
        parts = []
        for share, start, traced in zip(shares, starts, stopwatch.timed("trace", traces), strict=True):
            # Each part carries the scene's full power; in its batch it stands for its share of the particles.
            parts.append(traced.segments.weighted(share / particles))
            cut += traced.cut_flux * (share / settings.photon_count)
            yield Progress("Tracing photons", (start + share) / settings.photon_count, estimate)
        segments = Segments.joined(parts)
        segment_count += len(segments)
        accumulator = Accumulator(discs, segments, particles, visible)
        yield Progress("Gathering", (first + particles) / settings.photon_count, estimate)
        for crossings in stopwatch.timed("gather", gatherer.crossings(segments)):
            with stopwatch("gather"):
                accumulator.add(crossings)
            yield Progress("Gathering", (first + particles) / settings.photon_count, estimate)
        estimate = estimate.merged(accumulator.estimate())
    return BakeResult(
        estimate=estimate,
        hidden=np.zeros(len(discs), bool) if visible is None else visible.hidden,
        radius=radius,
        gatherer=gatherer.name,
        reason=reason,
        photons=estimate.particles,
        segments=segment_count,
        seconds=stopwatch.seconds,
        emitted_flux=tracer.emitted_flux,
        cut_flux=cut,
    )


def _generator(seed: int, start: int) -> np.random.Generator:
    """The random numbers of the particles from ``start`` on; key 0 is the pilot's (see core/radius.py)."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1, start)))


class _Stopwatch:
    """Adds up wall time by stage: ``with stopwatch("trace"): ...``, or of all that an iterator does between items."""

    def __init__(self, *stages: str):
        self.seconds = dict.fromkeys(stages, 0.0)

    @contextmanager
    def __call__(self, stage: str):
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] += time.perf_counter() - start

    def timed(self, stage: str, steps: Iterator[Step]) -> Iterator[Step]:
        """The items of ``steps``; making them counts for ``stage``, what the caller does with them does not."""
        while True:
            with self(stage):
                try:
                    step = next(steps)
                except StopIteration:
                    return
            yield step
