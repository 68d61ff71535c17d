"""The light at records after a change: photons that met it are traced on anew, and records near it placed anew."""

from __future__ import annotations

from collections.abc import Generator, Iterator

import numpy as np

from ..direct.lit_scene import LitScene
from ..estimator.crossing_sums import BatchSums, CrossingSums
from ..estimator.estimate import IrradianceEstimate
from ..estimator.standpoints import Standpoints
from ..gather.record_light import RecordLight
from ..gather.records import LOOKOUTS, Landings, RecordFinder, Records, scouted
from ..gather.reflected_light import ReflectedLight
from ..gatherers.choose import make_gatherer
from ..group_sums import group_sums
from ..parallel import ordered_map, slices
from ..photons.photon_light import PhotonSearch
from ..photons.tracing import PhotonTracer
from ..random_streams import random_stream
from ..segments import Segments
from ..stages import collected, finished
from .changed_places import Sight
from .first_bake import FirstBake
from .light_differences import POINTS_PER_CHUNK, LightDifferences, WantedPlaces

#: Rays that look for where records are needed around what changed, and from each lookout to the lights: at first, and
#: where one of these meets what changed.
SCOUTS, FIRST_RAYS, MORE_RAYS = 1 << 16, 1, 32 // LOOKOUTS


class ChangedRecords:
    """The records of the ``first`` bake in the scene ``lit`` after ``changes``.

    Attributes, once all stages are done: ``reflected``, the light that surfaces send on; ``delta`` (C + 1, 3) by how
    much there is more irradiance at each cell of the first bake, and whether (C + 1,) that is known.
    """

    def __init__(self, first: FirstBake, lit: LitScene, changes: LightDifferences):
        self._first, self._lit, self._changes = first, lit, changes

    def trace(self) -> Iterator[None]:
        """Trace the photons anew that meet what changed, from there on, step by step."""
        changes, paths = self._changes, self._first.paths

        def meets(origins: np.ndarray, directions: np.ndarray, lengths: np.ndarray) -> np.ndarray:
            found = changes.balls.crossed(origins, directions, lengths)
            rows = np.flatnonzero(found)
            found[rows] = changes.meets(origins[rows], directions[rows], lengths[rows])
            return found

        before, since = yield from paths.touched(meets)
        tracer = PhotonTracer(self._lit.scene, self._lit.caster, *self._first.tracing).keeping_all()
        _, first = np.unique(since.particle, return_index=True)
        begun = since.taken(np.sort(first))
        onward = tracer.resumed(
            begun, paths.lights.take(begun.particle), random_stream(self._first.settings.seed, "changes", 2)
        )
        self._gone, self._come = Segments.joined([before, since]), Segments.joined([before, onward])
        touched = np.zeros(len(paths.lights), bool)
        touched[begun.particle] = True
        kept = paths.segments.taken(np.flatnonzero(~touched.take(paths.segments.particle)))
        self._all, self._particles = Segments.joined([kept, self._come]), len(paths.lights)

    def place(self, kept: WantedPlaces, anew: Standpoints | None, facing: np.ndarray) -> Iterator[object]:
        """Place records where those of the first bake no longer hold, and where points look that are found ``anew``,
        step by step.

        ``kept`` are the other points' places; ``facing`` are the normals of those ``anew``.
        """
        records, balls, settings = self._first.records, self._changes.balls, self._first.settings
        margin = np.maximum(records.radii, np.tile(records.sides, 2))
        gone = balls.reach(records.held.places, margin).reshape(2, -1).any(axis=0)
        around = yield from self._seen_around(kept, settings.seed)
        # As far as the sides of the cells that rays look into which landed so.
        reached = balls.reach(around.places, records.finder.sides_of(around.lengths))
        landings = [around.taken(np.flatnonzero(reached))]
        if anew is not None:
            seen = scouted(self._lit, anew.origins, facing, settings.seed, least=0)
            cell = records.finder.find(seen, seen.lengths)
            landings.append(seen.taken(np.flatnonzero((cell < 0) | gone.take(cell))))
        fresh = Records(self._lit.caster, Landings.joined(landings), len(kept), settings.seed, beside=records.finder)
        self._fresh = RecordLight(self._lit, fresh, settings, False)
        self._patched = PatchedRecords(records.finder, fresh.finder, ~gone)
        if len(fresh):
            kinds = sorted({search.kind for search in self._first.searches})
            yield from self._fresh.place(kinds)

    def _seen_around(self, kept: WantedPlaces, seed: int) -> Generator[object, None, Landings]:
        """Where rays from ``kept`` places land that go towards what changed."""
        some = kept.taken(slice(None, None, -(-len(kept) * max(len(self._changes.balls), 1) // SCOUTS) or 1))

        def seen(rows: slice) -> Landings:
            places = some.taken(rows)
            rays = Sight.of(self._changes.balls, places.origins, places.normals).rays(
                random_stream(seed, "changes", 3, rows.start)
            )
            return self._changes.after.landed(places.origins.take(rays.row, axis=0), rays.directions).landings

        found = yield from collected(ordered_map(seen, slices(len(some), POINTS_PER_CHUNK)))
        return Landings.joined(found) if found else Landings(*np.zeros((3, 0, 3)), np.zeros(0))

    def light(self) -> Iterator[None]:
        """Find the light of all records, and by how much it changed, step by step."""
        first, fresh, patched = self._first, self._fresh, self._patched
        records, settings = first.records, first.settings
        exchanged = {}
        for search in first.searches:
            exchanged[search.kind, search.half] = self._exchanged(search)
            yield
        for search in fresh.searches:
            # The hybrid's other half: the first bake's discs keep theirs, see _exchanged.
            discs = search.placed.discs
            search.gatherer, _ = make_gatherer(settings.gatherer, discs, np.ones(len(discs), bool))
            samples = next(s.estimate.samples for s in first.searches if s.half == search.half)
            sums = self._sums(search, self._all)
            search.estimate = self._estimate(sums, search.placed.area.nested, samples)
            yield
        yield from fresh.look_at_lights()
        cells, found = len(records.sides), {"direct": records.direct.copy(), "indirect": records.indirect.copy()}
        for (kind, half), (rows, value) in exchanged.items():
            found[kind][half * cells + rows] = value
        found["direct"][:, :3] += yield from self._more_from_lights(settings.seed)
        more = fresh.found
        self.reflected = ReflectedLight(self._lit, patched, settings.bounces)
        self.reflected.know(*(patched.joined(found[name], more[name]) for name in ("direct", "indirect")))
        known = patched.after >= 0
        delta = self.reflected.known.take(patched.after, axis=0) - first.reflected.known
        self.delta = np.where(known[:, None], delta, 0.0), known

    def _exchanged(self, search: PhotonSearch) -> tuple[np.ndarray, np.ndarray]:
        """The discs (K,) of ``search`` that photons cross on their old or new ways, and the irradiance there
        with what halves of the photons differ by (K, 6)."""
        if len(self._gone) == 0:
            return np.zeros(0, np.int64), np.zeros((0, 6))
        sums, rings = [self._sums(search, part) for part in (self._gone, self._come)], search.estimate.areas.shape[1]
        rows = np.unique(np.concatenate([each.place for each in sums]) // rings)
        whole = search.estimate.taken(rows)
        gone, come = (self._estimate(each.among(rows, rings), whole.areas, whole.samples) for each in sums)
        return rows, whole.exchanged(gone, come).with_contrasts

    def _sums(self, search: PhotonSearch, segments: Segments) -> CrossingSums:
        """What ``segments`` bring to the discs of ``search``."""
        return finished(search.gathered(segments.weighted(1.0 / self._particles)))

    def _estimate(self, sums: CrossingSums, areas: np.ndarray, samples: int) -> IrradianceEstimate:
        """What ``sums`` tell of discs of those nested ``areas`` (N, K), of some of ``samples`` particles."""
        batch = BatchSums(areas)
        batch.add(sums)
        return batch.estimate(samples)

    def _more_from_lights(self, seed: int) -> Generator[None, None, np.ndarray]:
        """How much more (2 C, 3) W/m^2 comes straight from the lights to the records of the first bake."""
        first, changes = self._first.records, self._changes
        if first.lamps is None or len(changes.balls) == 0:
            return np.zeros((len(first.held.places), 3))
        lookouts = first.lookouts
        more = np.zeros((len(lookouts.places), 3))
        lamps = first.lamps.among(self._first.lit.lights)
        places = WantedPlaces(lookouts.stands, lookouts.normals, lookouts.normals, first.lamps.group)

        def found(task: tuple[int, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
            count, rows = task
            some = places.taken(rows)
            generator = random_stream(seed, "changes", 4, count, rows[0])
            sight = Sight.of(changes.balls, some.origins, some.normals, None if count < MORE_RAYS else 0.1)
            row, light = changes.aimed(sight, some, lamps, count, generator)
            if count > FIRST_RAYS:
                sent = sight.rays(generator)
                row = np.concatenate([row, sent.row])
                light = np.concatenate([light, changes.by_chance(sent, some, count)])
            return np.bincount(row, light.any(axis=1), len(rows)) > 0, group_sums(light, row, len(rows))

        # What the first rays tell only chooses who casts more: else a shadow that they missed would be lost.
        rows, hit = np.arange(len(more)), np.zeros(len(more), bool)
        blocks = [rows[part] for part in slices(len(rows), POINTS_PER_CHUNK)]
        for part, (changed, _) in zip(blocks, ordered_map(found, [(FIRST_RAYS, b) for b in blocks]), strict=True):
            hit[part] = changed
            yield
        for count, mine in ((FIRST_RAYS + 1, rows[~hit]), (MORE_RAYS, rows[hit])):
            blocks = [mine[part] for part in slices(len(mine), POINTS_PER_CHUNK)]
            for part, (_, sums) in zip(blocks, ordered_map(found, [(count, b) for b in blocks]), strict=True):
                more[part] = sums
                yield
        return more.reshape(-1, LOOKOUTS, 3).mean(axis=1)


class PatchedRecords:
    """The cells of ``base`` that are ``kept`` (C,), and behind all of its rows those of ``fresh`` records.

    Attribute ``after`` (C + 1,): the row here of each cell of ``base``, -1 where none tells of its light any more.
    """

    def __init__(self, base: RecordFinder, fresh: RecordFinder, kept: np.ndarray):
        self._base, self._fresh, self._kept = base, fresh, np.append(kept, False)
        anew = fresh.rows(base.numbers)
        anew[anew >= 0] += len(base)
        self.after = np.append(np.where(kept, np.arange(len(base)), anew), -1)

    def __len__(self) -> int:
        return len(self._base) + len(self._fresh)

    def find(self, landings: Landings, lengths: np.ndarray) -> np.ndarray:
        """The cell (K,) whose records tell of the light at ``landings`` (K), see :meth:`.RecordFinder.find`."""
        cell = self._base.find(landings, lengths)
        cell[~self._kept.take(cell)] = -1
        left = np.flatnonzero(cell < 0)
        anew = self._fresh.find(landings.taken(left), lengths.take(left))
        cell[left] = np.where(anew < 0, -1, anew + len(self._base))
        return cell

    def joined(self, base: np.ndarray, fresh: np.ndarray) -> np.ndarray:
        """Values (2 C, 6) at all records, from those at ``base`` and at ``fresh`` ones, half by half."""
        halves = (np.split(base, 2), np.split(fresh, 2))
        return np.concatenate([part[half] for half in (0, 1) for part in halves])
