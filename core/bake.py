"""The method on one page: rays for the direct light; photons to records where rays land; rays that gather over these;
and steps of either, until the error, the time or the photons that were asked for are reached."""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from .direct.direct_light import DirectLight
from .direct.lit_scene import LitScene
from .direct.stands import Stands
from .discs import TangentDiscs
from .estimator.enclosure import hidden_points
from .estimator.standpoints import Standpoints, plain_standpoints, standpoints
from .estimator.visible_area import VisibleDiscs, placing, whole_discs
from .fit.vertex_fit import ShownErrors, VertexFit
from .gather.record_light import RecordLight
from .gather.records import WIDTH, Records, scouted
from .irradiance import Irradiance
from .photons.distant_light import wanted_box
from .photons.light_shares import seen_shares
from .photons.photon_journal import PhotonJournal
from .photons.photon_light import PhotonLight, PhotonSearch
from .photons.tracing import PhotonTracer
from .points import Points
from .radius import check_radius, chosen_radius
from .rays import RayCaster
from .refinement import Refinement, first_rounds, look_in_every
from .result import BakeResult, Progress
from .scene import Scene
from .settings import BakeSettings
from .stages import Stopwatch, collected, finished

if TYPE_CHECKING:
    from .cluster.crew import Crew

Result = TypeVar("Result")
Stage = Generator[Progress, None, Result]


def baked(scene: Scene, points: Points, settings: BakeSettings | None = None) -> BakeResult:
    """The irradiance at ``points`` in one call; the rest is as for :func:`bake`."""
    return finished(bake(scene, points, settings or BakeSettings()))


def bake(
    scene: Scene, points: Points, settings: BakeSettings, fit: VertexFit | None = None, crew: Crew | None = None
) -> Stage[BakeResult]:
    """Estimate the irradiance at ``points``, step by step.

    Values that a ``fit`` makes of the light at the points are to have the error asked for; without one, the points
    themselves. The workers of a ``crew`` do the heavy work, if there is one; the light is the same.

    Yields a Progress often (a user interface calls next() between redraws; closing the generator cancels) and
    returns a BakeResult. Memory is bounded by the batch. Raises NoLightError without light, InvalidSettingError and
    InvalidArrayError on bad input.
    """
    return (yield from Baking(scene, points, settings, fit, crew).stages())


class Baking:
    """A bake as it goes on: its stages, each of which leaves to the next ones what it has found.

    A ``journal`` keeps what its photons do. Attributes, once :meth:`place_discs` is done: ``radius``, metres, of discs
    at the points themselves, ``tracer``, and in ``tracing`` what that was made of beside the scene; at the end also
    ``common_rounds`` of rays, which all points cast.
    """

    def __init__(
        self,
        scene: Scene,
        points: Points,
        settings: BakeSettings,
        fit: VertexFit | None = None,
        crew: Crew | None = None,
        journal: PhotonJournal | None = None,
    ):
        if settings.radius is not None:
            check_radius(settings.radius, scene)
        self._scene, self._points, self._settings = scene, points, settings
        self.shown = None if fit is None else ShownErrors(fit)
        self._crew, self._journal = crew, journal
        self._start = time.perf_counter()
        self._stopwatch = Stopwatch("radius", "place", "shadow", "trace", "gather")
        self._plain, self._by_photons = settings.estimator == "plain", settings.direct_by == "photons"
        self._bounces = settings.bounces if settings.indirect_by != "off" else 0
        self.gathers = settings.indirect_by == "gather" and settings.bounces > 0
        self.rays: DirectLight | None = None
        self.records: RecordLight | None = None
        self.searches: list[PhotonSearch] = []  # at the points themselves
        self.photons: PhotonLight | None = None
        self._names = "none", "No photons were searched."
        self._by_rays = Irradiance.dark(len(points))
        self._doubtful: np.ndarray | None = None
        self._emitted = np.zeros(3)

    def stages(self) -> Stage[BakeResult]:
        """All of them, one after the other."""
        yield from self.place_points()
        yield from self.cast_first_rays()
        yield from self.place_records()
        yield from self.place_discs()
        return (yield from self.refine())

    def place_points(self) -> Stage[None]:
        """Find where the points can look around from."""
        points, timed = self._points, self._stopwatch.timed
        yield Progress("Placing the points", 0.0)
        with self._stopwatch("place"):
            self.caster = RayCaster(self._scene.corners, points.centres)
        began = self._stopwatch.seconds["place"]
        if self._crew is not None:
            finding = self._crew.standpoints()
        elif self._plain:
            finding = plain_standpoints(self.caster, points.centres, points.facing)
        else:
            finding = standpoints(self.caster, points.centres, points.facing, points.inward)
        found = yield from during("Placing the points", 0.0, timed("place", collected(finding)))
        self.places = Standpoints.joined(found)
        self._standing = self._stopwatch.seconds["place"] - began

    def cast_first_rays(self) -> Stage[None]:
        """Direct light first: it needs no photons, and is what a user sees soonest."""
        points, settings = self._points, self._settings
        self.lit = LitScene(self._scene, self.caster)
        shines = bool(self.lit.lights) and settings.direct_by == "shadow-rays"
        if shines or self.gathers:
            stands = Stands(points.centres, self.places.origins, None if points.flat else points.facing)
            self.rays = DirectLight(self.lit, stands, points.normals, settings, shines, self._crew)
        if shines:
            rounds = self.rays.rounds(0, first_rounds(self.rays, settings, self._start))
            yield from during("Casting shadow rays", 0.0, self._stopwatch.timed("shadow", rounds))
            self._by_rays = self.rays.irradiance
            yield Progress("Casting shadow rays", 0.0, self._only_direct())

    def place_records(self) -> Stage[None]:
        """Find where gather rays land, and what lights shine there."""
        if not self.gathers:
            return
        settings, timed = self._settings, self._stopwatch.timed
        with self._stopwatch("place"):
            landings = scouted(self.lit, self.places.origins, self._points.facing, settings.seed)
            side = None if settings.radius is None else settings.radius / WIDTH
            held = Records(self.caster, landings, len(self._points), settings.seed, side)
            self.records = RecordLight(self.lit, held, settings, self._by_photons, self._crew)
        self.gathers = len(held) > 0
        if not self.gathers:
            return
        yield Progress("Placing the records", 0.0)
        kinds = ["direct"] if self._by_photons else []
        kinds += ["indirect"] if settings.bounces > 1 else []
        yield from during("Placing the records", 0.0, timed("place", self.records.place(kinds)))
        yield from during("Lighting the records", 0.0, timed("shadow", self.records.look_at_lights()))
        self.records.update()
        self.rays.gather(self.records.reflected)

    def place_discs(self) -> Stage[None]:
        """Make ready for photons: the discs that are at points themselves, and where photons are worth tracing."""
        scene, points, settings, caster = self._scene, self._points, self._settings, self.caster
        kinds = self._kinds()
        yield Progress("Choosing the radius", 0.0)
        with self._stopwatch("radius"):
            self.radius = settings.radius
            if self.radius is None:
                found = self._by_rays.value
                self.radius = chosen_radius(scene, caster, points.centres, points.normals, settings, found, kinds)
        with self._stopwatch("trace"):
            looking = self.records.looking if self.gathers else (self.places.origins, points.normals)
            seen = None
            if kinds or self.gathers:
                seen = seen_shares(self.lit.lights, self.lit.shadows, *looking, settings.seed)
            # Light that is to be reflected must meet a surface there; discs, which find the direct light, stick out.
            box = None if self._by_photons else wanted_box(looking[0], scene.bounds)
            reach = max(self.radius, self.records.radius if self.records is not None else 0.0)
            bounds = scene.bounds.expanded(2 * reach)
            self.tracing = bounds, self._bounces, self._by_photons, seen, box
            tracer = PhotonTracer(scene, caster, *self.tracing)
            self.tracer = tracer if self._journal is None else tracer.keeping_all()
            self._emitted = self.tracer.emitted_flux
        if kinds:
            discs = TangentDiscs.of_radius(points.centres, points.normals, self.radius)
            if self._plain:
                parts = whole_discs(discs)
            else:
                every = look_in_every(settings, self._standing, self._start)
                parts = placing(caster, self._crew)(discs, points.inward, every, points.facing)
            parts = self._stopwatch.timed("place", collected(parts))
            placed = VisibleDiscs.joined((yield from during("Placing the discs", 0.0, parts)))
            self.searches = [PhotonSearch(kind, placed) for kind in kinds]
        searches = self.searches + (self.records.searches if self.gathers else [])
        self.photons = PhotonLight(self.tracer, searches, settings.seed, self._tracing_crew) if searches else None
        if self.photons is not None:
            self.photons.journal = self._journal

    @property
    def _tracing_crew(self) -> Crew | None:
        """Who traces photons: this process, where it is to keep what they do."""
        return self._crew if self._journal is None else None

    def _kinds(self) -> list[str]:
        """What photons bring to discs at the points: caustics, where surfaces turn light, are never gathered."""
        kinds = ["direct"] if self._by_photons else []
        if self._settings.indirect_by == "photons" and self._settings.bounces > 0:
            kinds.append("indirect")
        if self._settings.indirect_by == "gather" and self._settings.bounces > 0 and self._scene.specular is not None:
            kinds.append("caustic")
        return kinds

    def refine(self) -> Stage[BakeResult]:
        """Cast more rays or trace more photons, whatever mends more in its time, until it is enough."""
        cells = len(self.records) if self.gathers else 0
        refinement = Refinement(self._settings, self.rays, self.photons, self._stopwatch, self._start, cells)
        result, *mended = self._found()
        refinement.observe(*mended, result.seen, result.ending_error)
        while (step := refinement.next()) is not None:
            if step.rounds:
                yield from self._cast(step.rounds, refinement)
            else:
                yield from self._trace(step.photons, refinement)
            result, *mended = self._found()
            refinement.observe(*mended, result.seen, result.ending_error)
            yield Progress("Refining", refinement.fraction, result)
        self.common_rounds = refinement.rule.common_rounds
        return result

    def _cast(self, rounds: int, refinement: Refinement) -> Stage[None]:
        """Cast so many ``rounds`` of rays more from the points."""
        rays = self.rays
        work = rays.rounds(rays.done, rays.done + rounds, refinement.rule.missing)
        yield from during("Casting rays", refinement.fraction, self._stopwatch.timed("shadow", work))
        self._by_rays = rays.irradiance

    def _trace(self, photons: int, refinement: Refinement) -> Stage[None]:
        """Trace so many ``photons`` more."""
        done = self.photons.particles
        if done == 0:
            with self._stopwatch("gather"):
                self._names = self.photons.make_gatherers(self._settings.gatherer)
                if self._tracing_crew is not None:
                    self._crew.know_searches(self.tracing, self.photons.searches)
            yield Progress("Tracing photons", refinement.fraction)
        elif self.gathers:
            looking = self._stopwatch.timed("shadow", self.records.look_at_lights(photons / done))
            yield from during("Lighting the records", refinement.fraction, looking)
        for phase in self.photons.batch(photons, self._stopwatch):
            yield Progress(phase, refinement.fraction)
        if self.gathers:
            self.records.update()

    def _part(self, kind: str) -> Irradiance:
        """That ``kind`` of light by discs at the points themselves."""
        found = (s.estimate.irradiance for s in self.searches if s.kind == kind)
        return sum(found, Irradiance.dark(len(self._points)))

    def _found(self) -> tuple[BakeResult, Irradiance, Irradiance]:
        """What has been found, and of it what more rays, and what more photons would mend."""
        direct, indirect = self._by_rays + self._part("direct"), self._part("indirect") + self._part("caustic")
        at_points = sum((s.estimate.noise for s in self.searches), Irradiance.dark(len(self._points)))
        mended = self._by_rays, at_points
        if self.gathers:
            reflected, spread = self.rays.reflected, self.rays.reflected_spread(self.records.common_error)
            indirect = indirect + reflected + Irradiance(np.zeros_like(spread.value), spread.standard_error)
            mended = self._by_rays + reflected, at_points + spread
        light = direct + indirect
        hidden, seen = self._hidden(light), light
        if self.shown is not None:
            seen = self.shown.seen(light, np.where(hidden, 0.0, self.places.open), mended[0])
        if self._doubtful is None and light.value.any() and np.isfinite(seen.standard_error).all():
            # Once for all: what has become sure counts as reached, and what single rays lit since then does not count.
            self._doubtful = seen.doubtful
        return self._result(direct, indirect, seen, hidden), *mended

    def _only_direct(self) -> BakeResult:
        """What is known before there are discs and photons: of indirect light, nothing."""
        light, unknown = self._by_rays, np.inf if self._settings.indirect_by != "off" else 0.0
        indirect = Irradiance(np.zeros_like(light.value), np.full_like(light.value, unknown))
        return self._result(light, indirect, light + indirect, self._hidden(light))

    def _hidden(self, light: Irradiance) -> np.ndarray:
        """Which points (N,) no light can reach, where ``light`` has been found."""
        covered = self.searches[0].placed.area.hidden if self.searches else np.zeros(len(self._points), bool)
        return hidden_points(covered, self.places.enclosed, light.value)

    def _result(self, direct: Irradiance, indirect: Irradiance, seen: Irradiance, hidden: np.ndarray) -> BakeResult:
        photons, records = self.photons, self.records
        radius = self.radius if self.searches else records.radius if records is not None else 0.0
        return BakeResult(
            direct=direct,
            indirect=indirect,
            seen=seen,
            doubtful=np.ones(len(hidden), bool) if self._doubtful is None else self._doubtful,
            hidden=hidden,
            open=self.places.open,
            coarse=self.places.coarse,
            radius=radius,
            gatherer=self._names[0],
            reason=self._names[1],
            photons=0 if photons is None else photons.particles,
            segments=0 if photons is None else photons.segments,
            shadow_rays=sum(cast.rays for cast in (self.rays, records) if cast is not None),
            seconds=self._stopwatch.seconds,
            emitted_flux=self._emitted,
            cut_flux=np.zeros(3) if photons is None else photons.cut_flux,
        )


def during(phase: str, done: float, steps: Generator[object, None, Result]) -> Stage[Result]:
    """Progress in that ``phase``, with so much ``done``, for each of the ``steps``; returns what they return."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
        yield Progress(phase, done)
