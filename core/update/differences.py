"""By how much light differs between a scene and the same after a change, at places that the change does not touch.

What a place sees differs within the cones of the changed parts, into which rays are sent, in both scenes; elsewhere it
sees the same surfaces, but in another light. The difference is small beside the light, and so is its noise. It is always
one to the first scene, so that errors do not add up from update to update, and a scene that is again what it was has
exactly the light it had.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..direct.looks import Look
from ..direct.low_discrepancy import nets
from ..direct.nearby_light import NearbyLight
from ..direct.shadows import Shadows
from ..direct.spots import Spots
from ..gather.records import Records
from ..gather.reflected_light import MOST_FOLLOWED, ReflectedLight, Ways
from ..lights.light import SHADOW_DIMENSIONS, Light, Surroundings
from ..parallel import ordered_map, slices
from ..random_streams import random_stream
from ..rays import Hits, RayCaster
from ..sampling import cosine_hemisphere
from ..scene import Scene
from .changed_places import Balls, Rays, Sight

#: Rays from each point by chance whose landings are kept, a power of two; and to lights.
VIEWS, AIMED = 16, 4

#: The noise that rays into the changed parts' cones may leave, of all light.
NOISE = 0.02

#: Points whose rays are cast at a time.
POINTS_PER_CHUNK = 1 << 12


@dataclass(frozen=True)
class Surfaces:
    """A scene as rays see it: what lets light pass, and the lights that surround all."""

    shadows: Shadows
    surroundings: list[Surroundings]

    @classmethod
    def of(cls, scene: Scene, caster: RayCaster, lights: Sequence[Light]) -> Surfaces:
        """Of ``scene`` with its ``lights``."""
        return cls(Shadows(scene, caster), [light for light in lights if hasattr(light, "met")])


@dataclass(frozen=True)
class Places:
    """P places where light is wanted.

    origins  (P, 3) metres, clear of surfaces
    normals  (P, 3) unit
    facing   (P, 3) unit normals of the faces
    group    (P,) of what is known of the lamps
    """

    origins: np.ndarray
    normals: np.ndarray
    facing: np.ndarray
    group: np.ndarray

    def __len__(self) -> int:
        return len(self.origins)

    def taken(self, rows) -> Places:
        """Those ``rows`` (index array or slice) alone."""
        return Places(*(part[rows] for part in vars(self).values()))


class Sums:
    """Irradiance (P, 3) W/m^2 that rays bring to P places, and the square of its standard error (P, 3)."""

    def __init__(self, places: int):
        self.value, self.squared = np.zeros((2, places, 3))

    def add(self, row: np.ndarray, found: np.ndarray, count: np.ndarray | int) -> None:
        """Rays of places ``row`` (R,) brought ``found`` (R, 3): parts of the mean over ``count`` (P,) rays of each."""
        count = np.broadcast_to(count, len(self.value))
        wider = count / np.maximum(count - 1, 1)
        for channel, part in enumerate(found.T):
            total = np.bincount(row, part, len(count))
            squares = np.bincount(row, part**2, len(count))
            self.value[:, channel] += total
            self.squared[:, channel] += wider * np.maximum(squares - total**2 / np.maximum(count, 1), 0.0)


@dataclass(frozen=True)
class Views:
    """What P places see by VIEWS rays each that follow the cosine.

    directions  (P * VIEWS, 3) float32
    ray         (E,) of each landing on what sends light on, ascending
    cell        (E,) of the records that tell of the light there, -1 where none does
    share       (E, 3) of the light that is sent on, float32
    """

    directions: np.ndarray
    ray: np.ndarray
    cell: np.ndarray
    share: np.ndarray

    @classmethod
    def of(cls, places: Places, reflected: ReflectedLight, records: Records, seed: int) -> Views:
        """From ``places`` among surfaces that send ``reflected`` light on, as ``records`` tell."""

        def seen(rows: slice) -> tuple[np.ndarray, ...]:
            count = rows.stop - rows.start
            generator = random_stream(seed, "views", rows.start)
            spot = np.repeat(np.arange(rows.start, rows.stop), VIEWS)
            normals = places.normals.take(spot, axis=0)
            directions = cosine_hemisphere(normals, nets(VIEWS, count, generator))
            ahead = np.flatnonzero(np.einsum("ij,ij->i", places.facing.take(spot, axis=0), directions) > 0)
            origins = places.origins.take(spot.take(ahead), axis=0)
            ways = reflected.landed(origins, directions.take(ahead, axis=0))
            cell = records.find(ways.landings, ways.lengths)
            order = np.argsort(ways.owner, kind="stable")
            ray = rows.start * VIEWS + ahead.take(ways.owner.take(order))
            parts = directions, ways.weight.take(order, axis=0)
            return ray.astype(np.int32), cell.take(order).astype(np.int32), *(part.astype(np.float32) for part in parts)

        found = list(ordered_map(seen, slices(len(places), POINTS_PER_CHUNK)))
        ray, cell, directions, share = map(np.concatenate, zip(*found, strict=True))
        return cls(directions, ray, cell, share)

    def part(self, rows: slice) -> Views:
        """Of some of the places alone, their rays numbered from 0."""
        rays = slice(rows.start * VIEWS, rows.stop * VIEWS)
        landings = slice(*np.searchsorted(self.ray, (rays.start, rays.stop)))
        ray = self.ray[landings] - np.int32(rays.start)
        return Views(self.directions[rays], ray, self.cell[landings], self.share[landings])


class LightDifferences:
    """Finds how much more light comes straight from the lights after a change than ``before`` it.

    balls  hold all that changed, and ``parts`` cast rays at what is gone and at what is new, alone
    """

    def __init__(self, before: Surfaces, after: Surfaces, balls: Balls, parts: Sequence[RayCaster]):
        self.before, self.after, self.balls, self._parts = before, after, balls, parts

    def aimed(
        self,
        sight: Sight,
        places: Places,
        lamps: NearbyLight,
        count: int,
        generator: np.random.Generator,
    ) -> tuple[np.ndarray, np.ndarray]:
        """What ``count`` rays to each light bring more than before: the rows (R,) of places, and W/m^2 (R, 3), parts
        of the mean; of those rays alone that meet what changed.

        What rays into the cones of ``sight`` bring as well is left to these, by the balance heuristic. ``lamps`` are
        as the places' groups know them.
        """
        found = [(np.empty(0, np.int64), np.empty((0, 3)))]
        row = np.repeat(np.arange(len(places)), count)
        every = places.taken(row)
        if lamps.lamps:
            rays = lamps.rays(every.origins, every.normals, every.group, generator.random((len(row), 3)))
            lit = np.flatnonzero(rays.light.any(axis=1))
            found.append(self._more(None, sight, every, row, lit, rays, rays.light / count))
        for source in self.before.surroundings:
            if source.aimed:
                rays = source.shadow_rays(every.origins, generator.random((len(row), SHADOW_DIMENSIONS)))
                cosine = np.einsum("ij,ij->i", every.normals, rays.directions)
                lit = np.flatnonzero((cosine > 0) & rays.shines)
                ball = sight.ball(row.take(lit), rays.directions.take(lit, axis=0))
                lit, ball = lit[ball >= 0], ball[ball >= 0]
                chance = sight.chance(row.take(lit), ball, cosine.take(lit))
                light = np.zeros((len(row), 3))
                weight = cosine.take(lit) / (count * rays.density.take(lit) + chance)
                light[lit] = rays.radiance.take(lit, axis=0) * weight[:, None]
                found.append(self._more(source, sight, every, row, lit, rays, light))
        rows, light = zip(*found, strict=True)
        return np.concatenate(rows), np.concatenate(light)

    def by_chance(self, rays: Rays, places: Places, aimed: int) -> np.ndarray:
        """What ``rays`` from ``places`` see more of the lights that surround all, W/m^2 (R, 3), parts of the mean; they
        count beside ``aimed`` rays to each."""
        origins, found = places.origins.take(rays.row, axis=0), np.zeros((len(rays.row), 3))
        rows = np.flatnonzero(self.meets(origins, rays.directions, np.full(len(origins), np.inf)))
        origins, some = origins.take(rows, axis=0), rays.taken(rows)
        for side, sign in ((self.after, 1.0), (self.before, -1.0)):
            for surfaces, sources in side.shadows.ways(side.surroundings):
                for at, hits, share in surfaces.met(origins, some.directions):
                    found[rows.take(at)] += sign * emitted(sources, some, origins, at, hits, share, aimed)
        return found

    def _more(self, source, sight, every: Places, row, lit, rays, light) -> tuple[np.ndarray, np.ndarray]:
        """Of rays to lights, those ``lit`` ones that meet what changed, and what more of their ``light`` arrives."""
        lit = lit[sight.ball(row.take(lit), rays.directions.take(lit, axis=0)) >= 0]
        lit = lit[ahead(every, lit, rays.directions.take(lit, axis=0))]
        ways = every.origins.take(lit, axis=0), rays.directions.take(lit, axis=0), rays.distances.take(lit)
        met = np.flatnonzero(self.meets(*ways))
        lit, ways = lit.take(met), tuple(way.take(met, axis=0) for way in ways)
        shadows = [side.shadows if source is None else side.shadows.of(source) for side in (self.after, self.before)]
        after, before = (each.transmitted(*ways).astype(float) for each in shadows)
        return row.take(lit), light.take(lit, axis=0) * (after - before)

    def meets(self, origins: np.ndarray, directions: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """Whether (R,) rays over ``distances`` (R,) m meet what is gone or what is new, through whatever else."""
        found = np.zeros(len(origins), bool)
        for part in self._parts:
            found |= part.occluded(origins, directions, distances)
        return found


def emitted(sources, rays: Rays, origins, rows, hits: Hits, share, aimed: int) -> np.ndarray:
    """What the ``rows`` (K,) of rays from ``origins`` (R, 3) bring of the lights that they hit, W/m^2 (K, 3), parts of
    the mean: that ``share`` (K, 3) arrives."""
    light = np.zeros((len(rows), 3))
    for source in sources:
        mine = np.flatnonzero(source.among(hits.triangle))
        at, there = rows.take(mine), (hits.triangle.take(mine), hits.points.take(mine, axis=0))
        radiance, density = source.met(origins.take(at, axis=0), rays.directions.take(at, axis=0), *there)
        weight = rays.cosine.take(at) / (rays.chance.take(at) + aimed * density)
        light[mine] += radiance * share.take(mine, axis=0) * weight[:, None]
    return light


def ahead(places: Places, row: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Which of the rays from places ``row`` (R,) along ``directions`` (R, 3) lead before the faces there."""
    return np.flatnonzero(np.einsum("ij,ij->i", places.facing.take(row, axis=0), directions) > 0)


class Differences:
    """Finds by how much all light differs, that of ``lights`` and what is ``reflected`` after and before the change.

    records  tell of the light before; ``delta`` (C + 1, 3) W/m^2 by how much it is more afterwards, where that is
             ``known`` (C + 1,)
    lamps    as groups of places know them
    """

    def __init__(
        self,
        lights: LightDifferences,
        reflected: tuple[ReflectedLight, ReflectedLight],
        records: Records,
        delta: np.ndarray,
        known: np.ndarray,
        lamps: NearbyLight,
    ):
        self._lights, self._balls, self._lamps = lights, lights.balls, lamps
        self._scenes = (lights.after, lights.before)
        self._reflected, self._records, self._delta, self._known = reflected, records, delta, known

    def at(self, places: Places, views: Views, generator: np.random.Generator) -> tuple[Sums, Sums]:
        """Direct and indirect light at ``places``, which have these ``views``."""
        direct, indirect = Sums(len(places)), Sums(len(places))
        sight = Sight.of(self._balls, places.origins, places.normals, NOISE)
        row, light = self._lights.aimed(sight, places, self._lamps, AIMED, generator)
        direct.add(row, light, AIMED)
        rays = sight.rays(generator)
        rays = rays.taken(ahead(places, rays.row, rays.directions))
        light, sent, ways = self._into_cones(rays, places, AIMED, generator)
        sent += self._followed(ways, len(sent), places.group.take(rays.row), generator)
        sent *= (rays.cosine / (np.pi * rays.chance))[:, None]
        for ball, count in enumerate(sight.count):
            mine = np.flatnonzero(rays.ball == ball)
            for sums, found in ((direct, light), (indirect, sent)):
                sums.add(rays.row.take(mine), found.take(mine, axis=0), count)
        seen = self._by_views(sight, places, views, generator)
        indirect.add(np.repeat(np.arange(len(places)), VIEWS), seen / VIEWS, VIEWS)
        return direct, indirect

    def _into_cones(self, rays: Rays, places: Places, aimed: int, generator) -> tuple[np.ndarray, np.ndarray, Ways]:
        """What ``rays`` bring more: of lights W/m^2 (R, 3), parts of the mean, of surfaces that they meet in one scene
        only the radiosity (R, 3), and the ways of the others."""
        origins = places.origins.take(rays.row, axis=0)
        light, sent = np.zeros((2, len(origins), 3))
        differ = self._lights.meets(origins, rays.directions, np.full(len(origins), np.inf))
        rows, others = np.flatnonzero(differ), np.flatnonzero(~differ)
        some, state = rays.taken(rows), generator.bit_generator.state
        group = places.group.take(some.row)
        for side, reflected, sign in zip(self._scenes, self._reflected, (1.0, -1.0), strict=True):
            # Where both scenes are the same, both rays go the same ways on.
            generator.bit_generator.state = state
            lights, others_sent = self._seen(side, reflected, some, origins.take(rows, axis=0), group, aimed, generator)
            light[rows] += sign * lights
            sent[rows] += sign * others_sent
        ways = self._reflected[0].landed(origins.take(others, axis=0), rays.directions.take(others, axis=0))
        return light, sent, ways.owned(others.take(ways.owner))

    def _seen(
        self, side: Surfaces, reflected, rays: Rays, origins, group, aimed: int, generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """The light (R, 3) W/m^2, a part of the mean, and the radiosity (R, 3), that ``rays`` see in one scene."""
        count = len(origins)
        spots = Spots(origins, rays.directions, rays.directions, rays.directions, group)
        look = Look(
            spots, np.arange(count), 1, 1.0, None, generator, None, np.zeros((count, 3)), nearby=self._lamps
        )  # fmt: skip
        light, sent = np.zeros((2, count, 3))
        for surfaces, sources in side.shadows.ways(side.surroundings):
            for rows, hits, share in surfaces.met(origins, rays.directions):
                light[rows] += emitted(sources, rays, origins, rows, hits, share, aimed)
                if surfaces is side.shadows.between.surfaces:
                    halves = reflected.sent(look, rows, rays.directions, hits.triangle, hits.points)
                    sent[rows] += share * (0.5 * (halves[:, :3] + halves[:, 3:]))
        return light, sent

    def _by_views(self, sight: Sight, places: Places, views: Views, generator) -> np.ndarray:
        """By how much the radiosity (P * VIEWS, 3) differs that rays see which meet the same surfaces in both scenes."""
        row = np.repeat(np.arange(len(places)), VIEWS)
        outside = sight.ball(row, views.directions) < 0
        known = self._known.take(views.cell)
        unknown = np.zeros(len(row), bool)
        unknown[views.ray[~known]] = True
        found = np.zeros((len(row), 3))
        used = np.flatnonzero((outside & ~unknown).take(views.ray))
        more = self._delta.take(views.cell.take(used), axis=0) * views.share.take(used, axis=0)
        for channel in range(3):
            found[:, channel] = np.bincount(views.ray.take(used), more[:, channel], len(row))
        again = np.flatnonzero(outside & unknown)
        directions = views.directions.take(again, axis=0).astype(float)
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        ways = self._reflected[0].landed(places.origins.take(row.take(again), axis=0), directions)
        ways = ways.owned(again.take(ways.owner))
        return found + self._followed(ways, len(row), places.group.take(row), generator)

    def _followed(self, ways: Ways, rays: int, group: np.ndarray, generator) -> np.ndarray:
        """What more comes back (R, 3) of ``rays`` from ``group`` (R,) over ``ways`` that are the same in both scenes."""
        owners, found = [np.empty(0, np.int64)], [np.empty((0, 3))]
        for _ in range(MOST_FOLLOWED):
            cell = self._records.find(ways.landings, ways.lengths)
            known = self._known.take(cell)
            rows = np.flatnonzero(known)
            owners.append(ways.owner.take(rows))
            found.append(ways.weight.take(rows, axis=0) * self._delta.take(cell.take(rows), axis=0))
            ways = ways.taken(np.flatnonzero(~known)).thinned(generator)
            if len(ways.owner) == 0:
                break
            owner, light, onward = self._around(ways, group.take(ways.owner), generator)
            owners.append(owner)
            found.append(light)
            ways = onward
        owner, found = np.concatenate(owners), np.concatenate(found)
        return np.stack([np.bincount(owner, column, rays) for column in found.T], axis=1)

    def _around(self, ways: Ways, group: np.ndarray, generator) -> tuple[np.ndarray, np.ndarray, Ways]:
        """What more comes back from the ends of ``ways``, by whom it is owned, and where it goes on to."""
        normals = ways.landings.normals
        places = Places(ways.landings.stands, normals, normals, group)
        sight = Sight.of(self._balls, places.origins, normals)
        row, light = self._lights.aimed(sight, places, self._lamps, 1, generator)
        rays = sight.rays(generator)
        lights, sent, same = self._into_cones(rays, places, 1, generator)
        scale = rays.cosine / (np.pi * rays.chance)
        owners = [ways.owner.take(row), ways.owner.take(rays.row)]
        found = [ways.weight.take(row, axis=0) * light]
        found.append(ways.weight.take(rays.row, axis=0) * (lights + sent * scale[:, None]))
        onward = [same.weighted(scale.take(same.owner)).owned(rays.row.take(same.owner))]
        directions = cosine_hemisphere(normals, generator.random((len(places), 2)))
        outside = np.flatnonzero(sight.ball(np.arange(len(places)), directions) < 0)
        past = self._reflected[0].landed(places.origins.take(outside, axis=0), directions.take(outside, axis=0))
        onward.append(past.owned(outside.take(past.owner)))
        going = [ways.onward(part.owner, part.weight, part.landings) for part in onward]
        return np.concatenate(owners), np.concatenate(found), Ways.joined(going)
