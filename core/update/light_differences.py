"""By how much light differs between a scene and the same after a change, at places that the change does not touch.

What a place sees differs within the cones of the changed parts, into which rays are sent, in both scenes; elsewhere it
sees the same surfaces, but in another light. The difference is small beside the light, and so is its noise. It is
always one to the first scene, so that errors do not add up from update to update, and a scene that is again what it was
has exactly the light it had.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from ..direct.low_discrepancy import nets
from ..direct.nearby_lamps import NearbyLamps
from ..gather.records import RecordFinder
from ..gather.reflected_light import MOST_FOLLOWED, ReflectedLight, Ways
from ..group_sums import group_sums
from ..lights.light import SHADOW_DIMENSIONS, met_among
from ..parallel import ordered_map, slices
from ..random_streams import random_stream
from ..rays import Hits, RayCaster
from ..rows import Rows
from ..sampling import cosine_hemisphere
from ..stages import collected
from .changed_places import Balls, Rays, Sight

#: Rays from each point by chance whose landings are kept, a power of two; and to lights.
VIEWS, AIMED = 16, 1

#: The noise that rays may leave which look for differences, over that of the first bake; and the least share of the
#: views that are followed on where no record tells of the difference.
NOISE, LEAST_FOLLOWED = 0.3, 1 / 32

#: Points whose rays are cast at a time.
POINTS_PER_CHUNK = 1 << 15


@dataclass(frozen=True)
class WantedPlaces(Rows):
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


class Sums:
    """Irradiance (P, 3) W/m^2 that rays bring to P places, and the square of its standard error (P, 3)."""

    def __init__(self, places: int):
        self.value, self.squared = np.zeros((2, places, 3))

    def add(self, row: np.ndarray, found: np.ndarray, count: np.ndarray | int) -> None:
        """Rays of places ``row`` (R,) brought ``found`` (R, 3): parts of the mean over ``count`` (P,) rays of each."""
        count = np.broadcast_to(count, len(self.value))
        # Of few rays, which may as well have been none, the squares tell all.
        less = np.where(count >= 2, 1.0 / np.maximum(count, 1), 0.0)
        total, squares = (group_sums(part, row, len(count)) for part in (found, found**2))
        self.value += total
        self.squared += np.maximum(squares - less[:, None] * total**2, 0.0) / (1.0 - less)[:, None]


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
    def of(
        cls, places: WantedPlaces, reflected: ReflectedLight, records: RecordFinder, seed: int
    ) -> Generator[object, None, Views]:
        """From ``places`` among surfaces that send ``reflected`` light on, as ``records`` tell; step by step."""

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

        found = yield from collected(ordered_map(seen, slices(len(places), POINTS_PER_CHUNK)))
        ray, cell, directions, share = map(np.concatenate, zip(*found, strict=True))
        return cls(directions, ray, cell, share)

    def taken(self, rows: np.ndarray) -> Views:
        """Of some of the places alone, ``rows`` (K,) that ascend."""
        rays = (rows[:, None] * VIEWS + np.arange(VIEWS)).ravel()
        begin, end = np.searchsorted(self.ray, (rays[0], rays[-1] + 1))
        number = np.full(rays[-1] + 1 - rays[0], -1, np.int32)
        number[rays - rays[0]] = np.arange(len(rays))
        ray = number.take(self.ray[begin:end] - rays[0])
        landings = np.flatnonzero(ray >= 0)
        parts = self.cell[begin:end].take(landings), self.share[begin:end].take(landings, axis=0)
        return Views(self.directions.take(rays, axis=0), ray.take(landings), *parts)


class LightDifferences:
    """Finds how much more light comes straight from the lights after a change than ``before`` it.

    balls  hold all that changed, and ``parts`` cast rays at what is gone and at what is new, alone
    """

    def __init__(self, before: ReflectedLight, after: ReflectedLight, balls: Balls, parts: Sequence[RayCaster]):
        self.before, self.after, self.balls, self._parts = before, after, balls, parts

    def aimed(
        self,
        sight: Sight,
        places: WantedPlaces,
        lamps: NearbyLamps,
        count: int,
        generator: np.random.Generator,
    ) -> tuple[np.ndarray, np.ndarray]:
        """What ``count`` rays to each light bring more than before: the rows (R,) of places, and W/m^2 (R, 3), parts
        of the mean; of those rays alone that meet what changed.

        What rays into the cones of ``sight`` bring as well is left to these, by the balance heuristic. ``lamps`` are
        as the places' groups know them.
        """
        found = [(np.empty(0, np.int64), np.empty((0, 3)))]
        # Before who has all cones behind it nothing changed.
        row = np.repeat(np.flatnonzero(sight.count.any(axis=0)), count)
        every = places.taken(row)
        if lamps.kinds:
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

    def by_chance(self, rays: Rays, places: WantedPlaces, aimed: int) -> np.ndarray:
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

    def _more(self, source, sight, every: WantedPlaces, row, lit, rays, light) -> tuple[np.ndarray, np.ndarray]:
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
    the mean: that ``share`` (K, 3) arrives. They count beside ``aimed`` rays to each."""
    light = np.zeros((len(rows), 3))
    for _, mine, radiance, density in met_among(sources, origins, rays.directions, rows, hits):
        at = rows.take(mine)
        weight = rays.cosine.take(at) / (rays.chance.take(at) + aimed * density)
        light[mine] += radiance * share.take(mine, axis=0) * weight[:, None]
    return light


def ahead(places: WantedPlaces, row: np.ndarray, directions: np.ndarray) -> np.ndarray:
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
        records: RecordFinder,
        delta: np.ndarray,
        known: np.ndarray,
        lamps: NearbyLamps,
    ):
        self._lights, self._balls, self._lamps = lights, lights.balls, lamps
        self._reflected, self._records, self._delta, self._known = reflected, records, delta, known

    def at(
        self, places: WantedPlaces, views: Views, light: np.ndarray, noise: float, generator: np.random.Generator
    ) -> tuple[Sums, Sums]:
        """Direct and indirect light at ``places``, which have these ``views`` and had ``light`` (P,), RGB sum, with
        about that relative ``noise``."""
        noise, usual = NOISE * noise, NOISE * noise * light
        direct, indirect = Sums(len(places)), Sums(len(places))
        sight = Sight.of(self._balls, places.origins, places.normals, noise)
        row, light = self._lights.aimed(sight, places, self._lamps, AIMED, generator)
        direct.add(row, light, AIMED)
        rays = sight.rays(generator)
        rays = rays.taken(ahead(places, rays.row, rays.directions))
        differing, same = self._parted(np.arange(len(rays.row)), np.ones((len(rays.row), 3)), rays, places)
        seen, chance, ways = self._by_views(sight, places, views, usual, generator)
        # Both kinds of rays go on together, those by chance behind the others.
        views_row = np.repeat(np.arange(len(places)), VIEWS)
        group = places.group.take(np.concatenate([rays.row, views_row]))
        ways = Ways.joined([same, ways.owned(len(rays.row) + ways.owner)])
        more, others = self._followed(ways, group, generator)
        first, light, sent = self._seen_twice([differing, *others], generator)
        sent_by_first = more[: len(rays.row)]
        found = np.zeros_like(sent_by_first)
        found[differing.owner] = light[:first]
        sent_by_first[differing.owner] += sent[:first]
        later = np.concatenate([np.empty(0, np.int64), *(each.owner for each in others)])
        weight = np.concatenate([np.empty((0, 3)), *(each.weight for each in others)])
        scale = np.concatenate([np.empty(0), *(each.rays.scale for each in others)])
        more += group_sums(weight * (light[first:] + sent[first:] * scale[:, None]), later, len(more))
        sent_by_first *= rays.scale[:, None]
        for ball, count in enumerate(sight.count):
            mine = np.flatnonzero(rays.ball == ball)
            for sums, part in ((direct, found), (indirect, sent_by_first)):
                sums.add(rays.row.take(mine), part.take(mine, axis=0), count)
        seen += more[len(rays.row) :] / chance[:, None]
        indirect.add(views_row, seen / VIEWS, VIEWS)
        return direct, indirect

    def _parted(self, owner: np.ndarray, weight: np.ndarray, rays: Rays, places: WantedPlaces):
        """``rays`` that may see what changed, and the ways of the others, on which both scenes are alike; the rays
        belong to ``owner`` (R,), to whom a ``weight`` (R, 3) of what they see comes back."""
        origins = places.origins.take(rays.row, axis=0)
        differ = self._lights.meets(origins, rays.directions, np.full(len(origins), np.inf))
        rows, others = np.flatnonzero(differ), np.flatnonzero(~differ)
        some = rays.taken(rows)
        known = owner.take(rows), weight.take(rows, axis=0), some
        differing = Differing(*known, origins.take(rows, axis=0), places.group.take(some.row))
        ways = self._reflected[0].landed(origins.take(others, axis=0), rays.directions.take(others, axis=0))
        return differing, ways.owned(others.take(ways.owner))

    def _seen_twice(self, differing: Sequence[Differing], generator) -> tuple[int, np.ndarray, np.ndarray]:
        """How many rays the first of ``differing`` has, and what all of them see more in the one scene than in the
        other: light W/m^2 (R, 3), parts of the mean, and radiosity (R, 3)."""
        rays = Differing.joined(differing)
        light, sent = np.zeros((2, len(rays.owner), 3))
        state = generator.bit_generator.state
        for reflected, sign in zip(self._reflected, (1.0, -1.0), strict=True):
            # Where both scenes are the same, both rays go the same ways on.
            generator.bit_generator.state = state
            lights, others = self._seen(reflected, rays, generator)
            light += sign * lights
            sent += sign * others
        return len(differing[0].owner), light, sent

    def _seen(self, reflected: ReflectedLight, differing: Differing, generator) -> tuple[np.ndarray, np.ndarray]:
        """The light (R, 3) W/m^2, parts of the mean, and the radiosity (R, 3), that rays see in one scene."""
        origins, rays, shadows = differing.origins, differing.rays, reflected.shadows
        light, sent = np.zeros((2, len(origins), 3))
        for surfaces, sources in shadows.ways(reflected.surroundings):
            for rows, hits, share in surfaces.met(origins, rays.directions):
                light[rows] += emitted(sources, rays, origins, rows, hits, share, AIMED)
                if surfaces is shadows.between.surfaces:
                    ways = origins, rays.directions, rows, hits
                    found = reflected.sent(*ways, differing.group, self._lamps, generator)
                    sent[rows] += share * found[:, :3]
        return light, sent

    def _by_views(
        self, sight: Sight, places: WantedPlaces, views: Views, noise: np.ndarray, generator
    ) -> tuple[np.ndarray, np.ndarray, Ways]:
        """By how much the radiosity (P * VIEWS, 3) differs where rays meet the same surfaces in both scenes, as far as
        records tell; the ways of those that are to be followed; and with what chance (P * VIEWS,) they are.

        Where the difference is small beside ``noise`` (P,), RGB sum, few rays are followed that no record tells of.
        """
        row = np.repeat(np.arange(len(places)), VIEWS)
        outside = sight.ball(row, views.directions) < 0
        known = self._known.take(views.cell)
        unknown = np.zeros(len(row), bool)
        unknown[views.ray[~known]] = True
        used = np.flatnonzero((outside & ~unknown).take(views.ray))
        more = self._delta.take(views.cell.take(used), axis=0) * views.share.take(used, axis=0)
        found = group_sums(more, views.ray.take(used), len(row))
        usual = np.abs(found).sum(axis=1).reshape(-1, VIEWS).mean(axis=1) / np.maximum(noise, 1e-300)
        chance = np.clip(np.minimum(usual, 1.0) ** 2, LEAST_FOLLOWED, 1.0).take(row)
        again = np.flatnonzero(outside & unknown & (generator.random(len(row)) < chance))
        directions = views.directions.take(again, axis=0).astype(float)
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        ways = self._reflected[0].landed(places.origins.take(row.take(again), axis=0), directions)
        return found, chance, ways.owned(again.take(ways.owner))

    def _followed(self, ways: Ways, group: np.ndarray, generator) -> tuple[np.ndarray, list[Differing]]:
        """What more comes back (R, 3) of rays from ``group`` (R,) over ``ways`` that are alike in both scenes, and the
        rays at their ends that may see what changed."""
        owners, found, differing = [np.empty(0, np.int64)], [np.empty((0, 3))], []
        for _ in range(MOST_FOLLOWED):
            cell = self._records.find(ways.landings, ways.lengths)
            known = self._known.take(cell)
            rows = np.flatnonzero(known)
            owners.append(ways.owner.take(rows))
            found.append(ways.weight.take(rows, axis=0) * self._delta.take(cell.take(rows), axis=0))
            ways = ways.taken(np.flatnonzero(~known)).thinned(generator)
            if len(ways.owner) == 0:
                break
            ways, some, owner, light = self._around(ways, group.take(ways.owner), generator)
            differing.append(some)
            owners.append(owner)
            found.append(light)
        return group_sums(np.concatenate(found), np.concatenate(owners), len(group)), differing

    def _around(self, ways: Ways, group: np.ndarray, generator) -> tuple[Ways, Differing, np.ndarray, np.ndarray]:
        """Where rays from the ends of ``ways`` go on to, and those that may see what changed; and to which owners (K,)
        what more (K, 3) comes back straight from the lights."""
        normals = ways.landings.normals
        places = WantedPlaces(ways.landings.stands, normals, normals, group)
        sight = Sight.of(self._balls, places.origins, normals)
        row, light = self._lights.aimed(sight, places, self._lamps, AIMED, generator)
        owner, light = ways.owner.take(row), ways.weight.take(row, axis=0) * light
        rays = sight.rays(generator)
        weight = ways.weight.take(rays.row, axis=0)
        differing, same = self._parted(ways.owner.take(rays.row), weight, rays, places)
        onward = [same.weighted(rays.scale.take(same.owner)).owned(rays.row.take(same.owner))]
        directions = cosine_hemisphere(normals, generator.random((len(places), 2)))
        outside = np.flatnonzero(sight.ball(np.arange(len(places)), directions) < 0)
        past = self._reflected[0].landed(places.origins.take(outside, axis=0), directions.take(outside, axis=0))
        onward.append(past.owned(outside.take(past.owner)))
        going = [ways.onward(part.owner, part.weight, part.landings) for part in onward]
        return Ways.joined(going), differing, owner, light


@dataclass(frozen=True)
class Differing(Rows):
    """R rays that may see what changed.

    owner    (R,) whom they tell of it, and the ``weight`` (R, 3) of what they see that comes back there
    rays     where they go
    origins  (R, 3) metres
    group    (R,) of what is known of the lamps
    """

    owner: np.ndarray
    weight: np.ndarray
    rays: Rays
    origins: np.ndarray
    group: np.ndarray
