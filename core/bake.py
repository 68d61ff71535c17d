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
from .direct.shadows import Shadows
from .direct.stands import Stands
from .discs import TangentDiscs
from .errors import NoMeshError
from .estimator.enclosure import hidden_points
from .estimator.standpoints import Standpoints, plain_standpoints, standpoints
from .estimator.visible_area import VisibleDiscs, visible_discs, whole_discs
from .fit.vertex_fit import VertexFit
from .gather.record_light import RecordLight
from .gather.records import WIDTH, Records, scouted
from .gatherers.choose import make_gatherer
from .irradiance import Irradiance
from .photons.distant_light import wanted_box
from .photons.emission import lights_of
from .photons.guiding import learn_guide
from .photons.light_shares import seen_shares
from .photons.photon_light import PhotonLight, PhotonSearch
from .photons.tracing import PhotonTracer
from .radius import Disc, check_radius, chosen_disc
from .rays import RayCaster
from .refinement import Refinement, first_rounds, look_in_every
from .scene import Scene
from .settings import BakeSettings
from .stopwatch import Stopwatch

Result = TypeVar("Result")

#: Components of normals that differ by less are the same.
SAME = 1e-5

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
    seen          all light, with the errors that are left where it is shown
    hidden        (N,) points that no light can reach because they are buried in other geometry: nothing is known there
    open          (N,) how well each point can be seen, 0..1: little from within a narrow gap
    coarse        (N,) points on faces too small to be told apart so far from most of the points
    radius        of the discs, metres; 0 as long as none is chosen
    gatherer      name, and ``reason`` for its choice
    photons, segments   how many were traced and gathered
    shadow_rays    how many were cast
    seconds       wall time by stage: radius, place (the discs), shadow (rays), trace, gather
    emitted_flux  (3,) W from all lights; ``cut_flux`` (3,) W that the bounce limit cut off
    """

    direct: Irradiance
    indirect: Irradiance
    seen: Irradiance
    hidden: np.ndarray
    open: np.ndarray
    coarse: np.ndarray
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
        return self.seen.relative_error

    @property
    def high_error(self) -> float:
        """The share of the light that is seen by which nine tenths of the points are likely to be off at most."""
        return self.seen.high_error


def bake(
    scene: Scene,
    centres: np.ndarray,
    normals: np.ndarray,
    settings: BakeSettings,
    inward: np.ndarray | None = None,
    facing: np.ndarray | None = None,
    fit: VertexFit | None = None,
) -> Generator[Progress, None, BakeResult]:
    """Estimate the irradiance at points ``centres`` (N, 3) m with unit ``normals`` (N, 3), step by step.

    ``inward`` (N, 3) metres leads from points on an edge into their own faces (estimator/visible_area.py); None when
    all points lie inside faces. ``facing`` (N, 3) are the unit normals of the faces, where ``normals`` are those that
    they are shaded by: rays start, and light arrives, before the face; None where they are the same. Values that a
    ``fit`` makes of the light at the points are to have the error asked for; without one, the points themselves.

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
    gathers = settings.indirect_by == "gather" and settings.bounces > 0
    if settings.radius is not None:
        check_radius(settings.radius, scene)
    yield Progress("Placing the points", 0.0)
    with stopwatch("place"):
        caster = RayCaster(scene.corners, centres)
    before = stopwatch.seconds["place"]
    faces = normals if facing is None else unit_rows(facing, "normals of faces", len(centres))
    finding = plain_standpoints(caster, centres, faces) if plain else standpoints(caster, centres, faces, inward)
    places = Standpoints.joined((yield from _gathered("Placing the points", stopwatch.timed("place", finding))))
    standing = stopwatch.seconds["place"] - before

    shining = lights_of(scene)
    lights = shining if settings.direct_by == "shadow-rays" else []
    rays, by_rays = None, Irradiance.dark(len(centres))
    if lights or gathers:
        stands = Stands(centres, places.origins, None if np.allclose(faces, normals, 0, SAME) else faces)
        rays = DirectLight(scene, caster, stands, normals, settings, lights)
    if lights:
        # Direct light first: it needs no disc, and is what a user sees soonest.
        for _ in stopwatch.timed("shadow", rays.rounds(0, first_rounds(rays, settings, start))):
            yield Progress("Casting shadow rays", 0.0)
        by_rays = rays.irradiance
        yield Progress("Casting shadow rays", 0.0, _only_direct(by_rays, settings, places, rays, stopwatch))

    # What photons bring to discs at the points themselves; caustics, where surfaces turn light, are never gathered.
    kinds = ["direct"] if by_photons else []
    if settings.indirect_by == "photons" and settings.bounces > 0:
        kinds.append("indirect")
    if gathers and scene.specular is not None:
        kinds.append("caustic")

    records = None
    if gathers:
        with stopwatch("place"):
            landings = scouted(scene, caster, places.origins, faces, settings.seed)
            side = None if settings.radius is None else settings.radius / WIDTH
            held = Records(caster, landings, len(centres), settings.seed, side)
            records = RecordLight(scene, caster, held, settings, shining, by_photons)
        gathers = len(records) > 0
    if gathers:
        yield Progress("Placing the records", 0.0)
        of_records = ["direct"] if by_photons else []
        of_records += ["indirect"] if settings.bounces > 1 else []
        for _ in stopwatch.timed("place", records.place(of_records)):
            yield Progress("Placing the records", 0.0)
        for _ in stopwatch.timed("shadow", records.look_at_lights()):
            yield Progress("Lighting the records", 0.0)
        records.update()
        rays.gather(records.reflected, shining)

    yield Progress("Choosing the radius", 0.0)
    with stopwatch("radius"):
        if settings.radius is not None:
            disc = Disc(settings.radius, settings.expected_photons)
        else:
            disc = chosen_disc(scene, caster, centres, normals, settings, by_rays.value, kinds)
    with stopwatch("trace"):
        bounces = settings.bounces if settings.indirect_by != "off" else 0
        reach = max(disc.radius, records.radius if records is not None else 0.0)
        looking = (held.held.stands, held.held.normals) if gathers else (places.origins, normals)
        sought = kinds or gathers
        seen = seen_shares(shining, Shadows(scene, caster), *looking, settings.seed) if sought else None
        # Light that is to be reflected must meet a surface there; discs, which find the direct light, stick out.
        box = None if by_photons else wanted_box(looking[0], scene.bounds)
        tracer = PhotonTracer(scene, caster, scene.bounds.expanded(2 * reach), bounces, by_photons, seen, box)

    searches = []
    if kinds:
        discs = TangentDiscs.of_radius(centres, normals, disc.radius)
        if plain:
            placing = whole_discs(discs)
        else:
            placing = visible_discs(caster, discs, inward, look_in_every(settings, standing, start), faces)
        placed = VisibleDiscs.joined((yield from _gathered("Placing the discs", stopwatch.timed("place", placing))))
        searches = [PhotonSearch(kind, placed) for kind in kinds]
    covered = placed.area.hidden if kinds else np.zeros(len(centres), bool)
    own = list(searches)
    searches += records.searches if gathers else []
    photons = PhotonLight(tracer, searches, settings.seed) if searches else None
    names = "none", "No photons were searched."

    def part(kind: str) -> Irradiance:
        return sum((s.estimate.irradiance for s in own if s.kind == kind), Irradiance.dark(len(centres)))

    def found() -> tuple[BakeResult, Irradiance, Irradiance]:
        """What has been found, and of it what more rays, and what more photons would mend."""
        direct, indirect = by_rays + part("direct"), part("indirect") + part("caustic")
        at_points = sum((s.estimate.noise for s in own), Irradiance.dark(len(centres)))
        mended = by_rays, at_points
        if gathers:
            reflected, spread = rays.reflected, rays.reflected_spread(records.common_error)
            indirect = indirect + reflected + Irradiance(np.zeros_like(spread.value), spread.standard_error)
            mended = by_rays + reflected, at_points + spread
        light = direct + indirect
        hidden = hidden_points(covered, places.enclosed, light.value)
        result = BakeResult(
            direct=direct,
            indirect=indirect,
            seen=light if fit is None else fit.seen(light, np.where(hidden, 0.0, places.open), mended[0]),
            hidden=hidden,
            open=places.open,
            coarse=places.coarse,
            radius=disc.radius if kinds else records.radius if records is not None else 0.0,
            gatherer=names[0],
            reason=names[1],
            photons=photons.particles if photons is not None else 0,
            segments=photons.segments if photons is not None else 0,
            shadow_rays=(rays.rays if rays is not None else 0) + (records.rays if records is not None else 0),
            seconds=stopwatch.seconds,
            emitted_flux=tracer.emitted_flux,
            cut_flux=photons.cut_flux if photons is not None else np.zeros(3),
        )
        return result, *mended

    result, *mended = found()
    refinement = Refinement(settings, rays, photons, stopwatch, start, len(records) if gathers else 0)
    refinement.observe(*mended, result.seen)
    while (step := refinement.next()) is not None:
        if step.rounds:
            last = rays.done + step.rounds
            work = stopwatch.timed("shadow", rays.rounds(rays.done, last, part("indirect").value, refinement.missing))
            for _ in work:
                yield Progress("Casting rays", refinement.fraction)
            by_rays = rays.irradiance
        else:
            if photons.particles == 0:
                likely = refinement.likely(disc.photons if kinds else step.photons)
                preparing = _prepared(tracer, photons, searches, result.irradiance, settings, likely, stopwatch)
                names = yield from _during("Aiming the lights", refinement.fraction, preparing)
            if gathers and photons.particles:
                for _ in stopwatch.timed("shadow", records.look_at_lights(step.photons / photons.particles)):
                    yield Progress("Lighting the records", refinement.fraction)
            for phase in photons.batch(step.photons, stopwatch):
                yield Progress(phase, refinement.fraction)
            if gathers:
                records.update()
        result, *mended = found()
        refinement.observe(*mended, result.seen)
        yield Progress("Refining", refinement.fraction, result)
    return result


def _prepared(
    tracer: PhotonTracer,
    photons: PhotonLight,
    searches: list[PhotonSearch],
    light: np.ndarray,
    settings: BakeSettings,
    likely: int,
    stopwatch: Stopwatch,
) -> Generator[None, None, tuple[str, str]]:
    """Choose the searches' gatherers for so many ``likely`` photons, and aim the lights; the first one's name and why.

    ``light`` (N, 3) W/m^2 is known already at the points.
    """
    with stopwatch("gather"):
        pilot = tracer.trace(PILOT_PHOTONS, np.random.default_rng(settings.seed)).segments
        for search in searches:
            some = pilot.of_kind(search.kind)
            expected = max(1, search.count(likely) * len(some) // PILOT_PHOTONS)
            same = next((s.gatherer for s in searches if s.gatherer is not None and s.placed is search.placed), None)
            if same is None:
                search.gatherer, reason = make_gatherer(settings.gatherer, search.placed.discs, expected, some)
                names = search.gatherer.name, reason
            else:
                search.gatherer = same
    yield
    first = searches[0]
    known = light if first.half is None else np.zeros((len(first.placed.discs), 3))
    aiming = learn_guide(tracer, first.gatherer, first.placed, first.kind, known, settings.seed, likely)
    photons.aim((yield from stopwatch.timed("trace", aiming)))
    return names


def _only_direct(
    light: Irradiance, settings: BakeSettings, places: Standpoints, rays: DirectLight, stopwatch: Stopwatch
) -> BakeResult:
    """What is known before there are discs and photons: of indirect light, nothing."""
    nothing, unknown = np.zeros(3), np.inf if settings.indirect_by != "off" else 0.0
    indirect = Irradiance(np.zeros_like(light.value), np.full_like(light.value, unknown))
    return BakeResult(
        direct=light,
        indirect=indirect,
        seen=light + indirect,
        hidden=hidden_points(np.zeros_like(places.enclosed), places.enclosed, light.value),
        open=places.open,
        coarse=places.coarse,
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
