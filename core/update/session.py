"""A bake that can be updated: after a change of the scene what it touches is found anew, and the rest is kept.

Every update goes back to the first bake, so that errors do not add up, nothing of where things were in between remains,
and a scene that is again what it was has its first light.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..bake import Baking, during
from ..direct.direct_light import DirectLight
from ..direct.lit_scene import LitScene
from ..direct.stands import Stands
from ..errors import InvalidSettingError, NotUpdatableError
from ..estimator.enclosure import hidden_points
from ..estimator.standpoints import Standpoints, standpoints
from ..fit.followed import PlacesLight, followed
from ..fit.settled import Settled
from ..fit.vertex_fit import ShownErrors, VertexFit, seen_errors
from ..gather.reflected_light import ReflectedLight
from ..irradiance import Irradiance
from ..parallel import ordered_map, slices
from ..photons.photon_journal import PhotonJournal
from ..points import Points
from ..random_streams import random_stream
from ..rays import RayCaster
from ..result import BakeResult, Progress
from ..rows import Rows
from ..scene import Scene
from ..settings import BakeSettings
from ..stages import Stopwatch, collected
from ..stop_rule import FEW, TIMES, far_off
from .changed_light import ChangedRecords
from .changed_places import Balls, Sight
from .first_bake import FirstBake
from .light_differences import NOISE, POINTS_PER_CHUNK, Differences, LightDifferences
from .unchanged import light_scale, same_lights, same_points, same_triangles

if TYPE_CHECKING:
    from ..cluster.crew import Crew

#: Bytes of light paths that a session keeps at most.
LIMIT = 1 << 31

#: Points nearer to what changed than so many of its radii are found anew, and those of which one of so many rays to the
#: lights meets it; there are more in the neighbourhood of such points.
NEAR, PILOTS, MORE_PILOTS = 1.5, 1, 8

#: Bounces that a session's photons and rays may take at least: of what is cut off, too much would have to be kept.
LEAST_BOUNCES = 24

#: The scene may grow by this share of its radius: lights far away send their photons at the scene as it was.
GROWTH = 1e-6

#: Why scenes with metals and glass are not updated.
SPECULAR = "light off mirrors and through glass cannot be updated"

#: Points that are found anew may cast so many rays, over those of all points in the first bake. Where they cast more,
#: an update takes as long as a bake, and that is why there is none.
WORTH, DEAR = 0.9, "so much is near to what changed that an update would take as long as a bake"

Stage = Generator[Progress, None, BakeResult]


class BakeSession:
    """Bakes ``points`` in ``scene`` once, and then after each change what that touches.

    Only gathered light can be updated, and light that comes by shadow rays: InvalidSettingError for other settings, and
    NotUpdatableError for scenes with metals or glass.
    Of more than ``limit`` bytes of light paths none is kept, and there is no update.

    Attribute: its ``settings``.
    """

    def __init__(self, scene: Scene, points: Points, settings: BakeSettings, limit: int = LIMIT):
        ways = settings.direct_by, settings.indirect_by, settings.estimator
        if ways != ("shadow-rays", "gather", "visible") or settings.bounces < LEAST_BOUNCES:
            raise InvalidSettingError(
                f"Only bakes with shadow rays, gathered light and at least {LEAST_BOUNCES} bounces can be updated."
            )
        if settings.shadow_distance is not None:
            raise InvalidSettingError("A bake with a limited distance of shadows cannot be updated.")
        if scene.specular is not None:
            raise NotUpdatableError(SPECULAR)
        self._scene, self._points, self.settings = scene, points, settings
        self._journal = PhotonJournal(limit)
        self._first: FirstBake | None = None
        self._dark = False

    @classmethod
    def of(cls, first: FirstBake) -> BakeSession:
        """A session whose ``first`` bake was made by another one."""
        session = cls(first.scene, first.points, first.settings)
        session._first = first
        return session

    @property
    def kept(self) -> FirstBake:
        """What is kept of the first bake; raises as :meth:`check`."""
        self.check()
        return self._first

    def bake(self, fit: VertexFit | None = None, crew: Crew | None = None) -> Stage:
        """The first bake, as :func:`..bake.bake` does it; the light is the same."""
        work = Baking(self._scene, self._points, self.settings, fit, crew, self._journal)
        result = yield from work.stages()
        if fit is not None:
            open = np.where(result.hidden, 0.0, result.open)
            found = fit.fitted(result.light, open, result.direct)
            settled = Settled(found.value, found.part, found.known, fit.placed, work.shown.left)
            result = replace(result, settled=settled)
        self._dark = not work.gathers
        if not (self._journal.full or self._dark):
            given = self._scene, self._points, self.settings
            self._first = FirstBake.of(*given, work, self._journal.paths(), result)
        return result

    def check(self) -> None:
        """Raise NotUpdatableError where no bake or nothing of it is kept, and SessionTooLargeError where it was too
        much."""
        self._journal.check()
        if self._dark:
            raise NotUpdatableError("nothing in the scene reflects light")
        if self._first is None:
            raise NotUpdatableError("there is no finished bake to update")

    def update(self, scene: Scene, points: Points, fit: VertexFit | None = None, dear: bool = False) -> Stage:
        """The light at ``points`` in a ``scene`` that differs from the first one, wherever it does.

        What is the same in both is found by itself. Yields a Progress often, and may be closed at any time. Raises
        NotUpdatableError before nearly all work where nothing can be kept, or, unless it may be ``dear``, so little
        that it takes as long as a bake, and as :meth:`check`; then a new bake is due.
        """
        self.check()
        return (yield from _Update(self._first, scene, points, fit).steps(dear))


class _Update:
    """One update of the ``first`` bake, stage by stage."""

    def __init__(self, first: FirstBake, scene: Scene, points: Points, fit: VertexFit | None):
        # Light is in proportion to the strength of its sources, so that no other is to be found.
        scale = light_scale(first.scene.lights, scene.lights)
        self._scale = None if scale is None or (scale == 1.0).all() else scale
        if self._scale is not None and not scene.emission.any():
            scene = replace(scene, lights=first.scene.lights)
        self._first = first
        self._scene, self._points, self._fit = scene, points, fit
        self._lit = LitScene(scene, RayCaster(scene.corners, first.points.centres))
        self._stopwatch = Stopwatch("radius", "place", "shadow", "trace", "gather")
        if scene.specular is not None:
            raise NotUpdatableError(SPECULAR)
        if not same_lights(first.lit.lights, self._lit.lights):
            raise NotUpdatableError("the lights have changed, so that all light is another")
        self._find_changes()

    def _find_changes(self) -> None:
        first, scene = self._first, self._scene
        same = same_triangles(first.scene, scene)
        gone = np.setdiff1d(np.arange(len(first.scene.triangles)), same)
        come = np.flatnonzero(same < 0)
        corners = scene.corners[come].reshape(-1, 3)
        room = first.scene.bounds.expanded(GROWTH * first.scene.bounds.radius)
        if len(come) and ((corners < room.lower) | (corners > room.upper)).any():
            raise NotUpdatableError("something has left the box that held the whole scene")
        balls = Balls.around(first.scene.corners[gone], scene.corners[come])
        parts = [c.part(rows) for c, rows in ((first.lit.caster, gone), (self._lit.caster, come)) if len(rows)]
        after = ReflectedLight(self._lit, first.records.finder, 1)
        self._changes = LightDifferences(first.reflected, after, balls, parts)
        self._same = same_points(first.points, self._points)

    def steps(self, dear: bool) -> Stage:
        first = self._first
        anew = yield from self._stage("Looking for what changed", 0.0, "shadow", self._to_find_anew())
        if len(self._changes.balls) == 0 and np.array_equal(self._same, np.arange(len(first.points))):
            return self._in_scale(replace(first.result, seconds=self._stopwatch.seconds))
        rows, (of_each, of_all) = np.flatnonzero(anew), first.ray_count
        if not dear and len(rows) * first.common_rounds * of_each > WORTH * of_all:
            raise NotUpdatableError(DEAR)
        places = yield from self._stage("Placing the points", 0.05, "place", self._stand(rows))
        records = ChangedRecords(first, self._lit, self._changes)
        yield from self._stage("Tracing photons", 0.1, "trace", records.trace())
        kept = first.wanted.taken(np.unique(self._same[~anew]))
        placing = records.place(kept, places, self._points.facing[rows])
        yield from self._stage("Placing the records", 0.2, "place", placing)
        yield from self._stage("Lighting the records", 0.3, "gather", records.light())
        found = yield from self._stage("Casting rays", 0.5, "shadow", self._find_anew(rows, places, records))
        more = yield from self._stage("Gathering", 0.7, "gather", self._differences(records, ~anew))
        yield Progress("Fitting the values", 0.95)
        return self._joined(anew, places, found, more)

    def _stage(self, phase: str, share: float, kind: str, work: Generator) -> Generator[Progress, None, Any]:
        """Do the ``work``, whose time counts for that ``kind``; returns what it returns."""
        yield Progress(phase, share)
        return (yield from during(phase, share, self._stopwatch.timed(kind, work)))

    def _to_find_anew(self) -> Generator[None, None, np.ndarray]:
        """Which points (N,) are new, near to what changed, see much of it, or are in light that comes straight from a
        light and changed."""
        first, balls = self._first, self._changes.balls
        anew = self._same < 0
        anew |= balls.reach(self._points.centres, 0.0, NEAR)
        if len(balls) == 0:
            return anew
        lamps, group = first.nearby_lamps, first.wanted.group[self._same]
        # Of two scenes, differences take twice the rays.
        dear, noise = 0.5 * first.common_rounds * first.ray_count[0], NOISE * first.noise
        rows = np.flatnonzero(~anew)
        for part in slices(len(rows), POINTS_PER_CHUNK):
            some = first.wanted.taken(self._same[rows[part]])
            anew[rows[part]] = Sight.of(balls, some.origins, some.normals, noise).count.sum(axis=0) > dear

        def shaded(task: tuple[int, np.ndarray]) -> np.ndarray:
            count, rows = task
            some = first.wanted.taken(self._same[rows])
            generator = random_stream(first.settings.seed, "changes", 0, count, rows[0])
            sight = Sight.of(balls, some.origins, some.normals)
            row, light = self._changes.aimed(sight, some, lamps, count, generator)
            return rows[np.unique(row[light.any(axis=1)])]

        rows = np.flatnonzero(~anew)
        for count in (PILOTS, MORE_PILOTS):
            blocks = [rows[part] for part in slices(len(rows), POINTS_PER_CHUNK)]
            for found in ordered_map(shaded, [(count, block) for block in blocks]):
                anew[found] = True
                yield
            around = np.zeros(group.max() + 1, bool)
            around[group[rows[anew[rows]]]] = True
            rows = rows[around[group[rows]] & ~anew[rows]]
        return anew

    def _stand(self, rows: np.ndarray) -> Generator[object, None, Standpoints | None]:
        """Where the points ``rows`` look from."""
        if len(rows) == 0:
            return None
        points = self._points
        inward = None if points.inward is None else points.inward[rows]
        finding = standpoints(self._lit.caster, points.centres[rows], points.facing[rows], inward)
        return Standpoints.joined((yield from collected(finding)))

    def _find_anew(
        self, rows: np.ndarray, places: Standpoints | None, records: ChangedRecords
    ) -> Generator[float, None, tuple[Irradiance, Irradiance, Irradiance] | None]:
        """Direct and reflected light at the points ``rows``, and both with the errors by rays alone; None without
        any."""
        if places is None:
            return None
        first, points = self._first, self._points
        facing = None if points.flat else points.facing[rows]
        stands = Stands(points.centres[rows], places.origins, facing)
        rays = DirectLight(self._lit, stands, points.normals[rows], first.settings)
        rays.gather(records.reflected)
        goal = first.settings.aimed_noise
        yield from rays.rounds(0, first.common_rounds)
        while True:
            spread = rays.reflected_spread(first.records.common_error)
            noise = Irradiance(np.zeros_like(spread.value), spread.standard_error)
            direct, reflected = rays.irradiance, rays.reflected
            found = direct, reflected + noise, direct + reflected
            if goal is None or rays.done >= first.most_rounds:
                return found
            # As the first bake did, it works on where light is hard to find.
            missing = far_off(found[0] + found[1], TIMES * goal, rays)
            if missing.sum() <= FEW * len(points):
                return found
            yield from rays.rounds(rays.done, min(2 * rays.done, first.most_rounds), where=missing)

    def _differences(
        self, records: ChangedRecords, kept: np.ndarray
    ) -> Generator[object, None, tuple[Irradiance, Irradiance]]:
        """By how much direct and indirect light differ at the ``kept`` points (N,)."""
        first = self._first
        reflected = records.reflected, first.reflected
        known = first.records.finder, *records.delta, first.nearby_lamps
        differences = Differences(self._changes, reflected, *known)
        yield from first.look()
        # In the order of the first bake, whose views are kept.
        olds = self._same[kept]
        wanted = np.zeros(len(first.points), bool)
        wanted[olds] = True
        usual = first.result.irradiance.sum(axis=1)

        def found(rows: slice):
            generator = random_stream(first.settings.seed, "changes", 1, rows.start)
            some, light = rows.start + np.flatnonzero(wanted[rows]), np.zeros((4, rows.stop - rows.start, 3))
            if len(some):
                places, views = first.wanted.taken(some), first.views.taken(some)
                sums = differences.at(places, views, usual[some], first.noise, generator)
                light[:, some - rows.start] = [part for each in sums for part in (each.value, each.squared)]
            return light

        parts = yield from collected(ordered_map(found, slices(len(first.points), POINTS_PER_CHUNK)))
        direct, direct_error, indirect, indirect_error = np.concatenate(parts, axis=1)[:, olds]
        return Irradiance(direct, np.sqrt(direct_error)), Irradiance(indirect, np.sqrt(indirect_error))

    def _joined(self, anew: np.ndarray, places: Standpoints | None, found, more) -> BakeResult:
        first, olds = self._first, self._same[~anew]

        order = np.empty(len(anew), np.int64)
        order[~anew], order[anew] = np.arange(len(olds)), np.arange(len(olds), len(anew))

        def merged(kept: Rows, come: Rows | None) -> Rows:
            """Of all points what is ``kept`` of some, and what has ``come`` of those that were found anew."""
            return (kept if come is None else type(kept).joined([kept, come])).taken(order)

        more = (*more, more[0] + more[1])
        before = (first.result.direct, first.result.indirect, first.by_rays)
        lights = [
            merged(old.taken(olds) + change, new)
            for old, change, new in zip(before, more, found or 3 * [None], strict=True)
        ]
        stood = merged(first.places.taken(olds), places)
        light = lights[0] + lights[1]
        hidden = hidden_points(np.zeros(len(anew), bool), stood.enclosed, light.value)
        seen, settled = self._shown(light, lights, anew, np.where(hidden, 0.0, stood.open))
        seconds = self._stopwatch.seconds
        doubtful = np.where(self._same >= 0, first.result.doubtful.take(self._same), seen.doubtful)
        light = {"direct": lights[0], "indirect": lights[1], "seen": seen, "doubtful": doubtful, "settled": settled}
        light |= {"hidden": hidden, "open": stood.open, "coarse": stood.coarse}
        return self._in_scale(replace(first.result, **light, seconds=seconds))

    def _shown(
        self, light: Irradiance, lights: list[Irradiance], anew: np.ndarray, open: np.ndarray
    ) -> tuple[Irradiance, Settled | None]:
        """The ``light`` with the errors that are left where it is shown, and the values that show it; ``lights`` are
        direct and indirect light and all by rays, and points count as far as they are ``open`` (N,)."""
        if self._fit is None:
            return light, None
        before, same, own = self._first.result, self._same, lights[2]
        if before.settled is None:
            shown = ShownErrors(self._fit)
            return shown.seen(light, open, own), None
        more, part = (
            np.where((same >= 0)[:, None], found.value - was.value.take(same, axis=0), found.value)
            for found, was in ((light, before.light), (lights[0], before.direct))
        )
        had = before.standard_error.sum(axis=1).take(same)
        now = PlacesLight(light, lights[0], own, open, more, part, had, anew)
        settled = followed(self._fit, before.settled, same, now)
        return seen_errors(light, settled.left, own.standard_error), settled

    def _in_scale(self, found: BakeResult) -> BakeResult:
        """What was ``found`` of lights as strong as in the first bake, of lights as strong as they are."""
        if self._scale is None:
            return found
        scale, lights = self._scale, {}
        for name in ("direct", "indirect", "seen"):
            light = getattr(found, name)
            lights[name] = Irradiance(light.value * scale, light.standard_error * np.abs(scale))
        if found.settled is not None:
            settled = found.settled
            lights["settled"] = replace(settled, value=settled.value * scale, part=settled.part * scale)
        return replace(found, **lights, emitted_flux=found.emitted_flux * scale, cut_flux=found.cut_flux * scale)
