"""What surfaces reflect towards points that look around: gather rays look it up in records, or are followed on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..direct.lit_scene import LitScene
from ..direct.nearby_lamps import NearbyLamps
from ..direct.surrounding_light import CONTRASTS, in_part
from ..group_sums import group_sums
from ..lights.light import SHADOW_DIMENSIONS, Surroundings, met_among
from ..rays import Hits, RayCaster
from ..rows import Rows
from ..sampling import cosine_hemisphere
from ..sides import BySide, any_side
from .records import Landings, RecordFinder

#: Rays are followed over so many landings at most; hardly any go on for so long.
MOST_FOLLOWED = 24

#: Rays of whose light less than this share would come back are followed in that proportion only.
SURE = 0.5


class ReflectedLight:
    """Light that the diffuse surfaces of ``scene`` send on, by ``records``; dark until :meth:`know`.

    Arrays of ten columns have RGB, and CONTRASTS: what halves of the photons differ by from that, RGB sum, each cut in
    another way. The first is between the two records of a cell, see records.py, which also lie in different places; the
    others have photons of both records in each half.

    Rays that land where no record tells of the light are followed on: one ray more looks around from there, and shadow
    rays go to the lights, ``surroundings`` and lamps (secondary gathering, Jensen 2001). At most ``bounces``
    reflections count. All rays of a look are followed together, landing by landing, and Russian roulette ends those of
    which little would come back (Arvo and Kirk 1990).
    """

    def __init__(self, lit: LitScene, records: RecordFinder, bounces: int):
        scene, caster = lit.scene, lit.caster
        self._caster, self._records, self._bounces = caster, records, bounces
        self.shadows, self.surroundings = lit.shadows, lit.surroundings
        # What surfaces send on of the light on the side that is met, and on the other one.
        self._sides = [_Side.of(1.0, scene.albedo, caster)]
        if scene.translucency is not None:
            self._sides.append(_Side.of(-1.0, scene.translucency, caster))
        self.know(*np.zeros((2, 2 * len(records), 6)))

    @property
    def known(self) -> np.ndarray:
        """All irradiance (C + 1, 3) W/m^2 that is looked up, by cells; the last row stands for no cell."""
        return self._all[:, :3]

    def know(self, direct: np.ndarray, indirect: np.ndarray) -> None:
        """The records' ``direct`` and ``indirect`` irradiance are these from now on, and what halves of their photons
        differ by in three ways, (2 C, 6) W/m^2."""
        self._direct, self._all = by_cells(direct), by_cells(direct + indirect)

    def sent(self, points, directions, rows, hits: Hits, group, nearby: NearbyLamps | None, generator) -> np.ndarray:
        """Radiosity (K, 10) W/m^2 of what ``rows`` (K,) of rays met at the K ``hits``, see :class:`.Reflections`."""
        found = np.zeros((len(rows), 3 + CONTRASTS))
        for side in self._sides:
            met, share, landings = self._landings(side, points, directions, rows, hits)
            cell = self._records.find(landings, landings.lengths)
            sent = in_part(self._known(1).take(cell, axis=0), share)
            left = np.flatnonzero(cell < 0)
            ways = Ways(left, share.take(left, axis=0), landings.lengths.take(left), landings.taken(left))
            sent += self._followed(ways, group.take(rows.take(met)), nearby, generator)
            found[met] += sent
        return found

    def landed(self, points: np.ndarray, directions: np.ndarray) -> Ways:
        """Where rays from ``points`` (R, 3) m along unit ``directions`` (R, 3) land on what sends light on."""
        found = []
        for rows, hits, share in self.shadows.between.surfaces.met(points, directions):
            for side in self._sides:
                met, part, landings = self._landings(side, points, directions, rows, hits)
                found.append(Ways(rows.take(met), share.take(met, axis=0) * part, landings.lengths, landings))
        return Ways.joined(found)

    def _known(self, reflections: int) -> np.ndarray:
        """The light (C + 1, 10) at records that counts where the next reflection is the one of that number."""
        return self._direct if reflections == self._bounces else self._all

    def _landings(self, side: _Side, points, directions, rows, hits: Hits):
        """Which of the ``rows`` (K,) of rays land where light from that side is sent on, what share (L, 3) of it, and
        how the rays land.

        They leave ``points`` (R, 3) along ``directions`` (R, 3).
        """
        met = np.flatnonzero(side.sends.take(hits.triangle, mode="wrap"))
        at, triangle, places = rows.take(met), hits.triangle.take(met), hits.points.take(met, axis=0)
        ahead = points.take(at, axis=0), directions.take(at, axis=0)
        return met, side.share.met(triangle, ahead[1]), Landings.of(self._caster, *ahead, triangle, places, side.sign)

    def _followed(self, ways: Ways, group: np.ndarray, nearby: NearbyLamps | None, generator) -> np.ndarray:
        """What comes back (K, 10) of K rays, from ``group`` (K,), that are followed along ``ways``."""
        owners, found = [np.empty(0, np.int64)], [np.empty((0, 3 + CONTRASTS))]
        last = min(self._bounces, MOST_FOLLOWED)
        for reflections in range(1, last + 1):
            ways = ways.thinned(generator)
            if len(ways.owner) == 0:
                break
            light, onward = self._around(ways, group.take(ways.owner), nearby, generator)
            owners.append(ways.owner)
            found.append(np.column_stack([ways.weight * light, np.zeros((len(light), CONTRASTS))]))
            if reflections == last:
                break
            cell = self._records.find(onward.landings, onward.lengths)
            known, left = np.flatnonzero(cell >= 0), np.flatnonzero(cell < 0)
            owners.append(onward.owner.take(known))
            light = self._known(reflections + 1).take(cell.take(known), axis=0)
            found.append(in_part(light, onward.weight.take(known, axis=0)))
            ways = onward.taken(left)
        owner, found = np.concatenate(owners), np.concatenate(found)
        return group_sums(found, owner, len(group))

    def _around(self, ways: Ways, group: np.ndarray, nearby: NearbyLamps | None, generator) -> tuple[np.ndarray, Ways]:
        """Direct irradiance (W, 3) at the ends of W ways, by a ray to each light and one by chance; and where that
        goes on to."""
        points, normals = ways.landings.stands, ways.landings.normals
        light = np.zeros((len(points), 3))
        for source in self.surroundings:
            if source.aimed:
                self._aim(source, points, normals, generator.random((len(points), SHADOW_DIMENSIONS)), light)
        if nearby is not None and nearby.kinds:
            self._ask_lamps(nearby, points, normals, group, generator.random((len(points), 3)), light)
        directions = cosine_hemisphere(normals, generator.random((len(points), 2)))
        cosine = np.einsum("ij,ij->i", normals, directions)
        onward = []
        for surfaces, sources in self.shadows.ways(self.surroundings):
            for rows, hits, share in surfaces.met(points, directions):
                for _, mine, radiance, density in met_among(sources, points, directions, rows, hits):
                    at = rows.take(mine)
                    light[at] += radiance * share.take(mine, axis=0) * _balanced(density, cosine.take(at))
                if surfaces is not self.shadows.between.surfaces:
                    continue
                for side in self._sides:
                    met, part, landings = self._landings(side, points, directions, rows, hits)
                    onward.append(ways.onward(rows.take(met), share.take(met, axis=0) * part, landings))
        return light, Ways.joined(onward)

    def _aim(self, source: Surroundings, points, normals, uniforms, light: np.ndarray) -> None:
        """Add to the ``light`` (K, 3) at points what rays chosen by that light bring."""
        rays = source.shadow_rays(points, uniforms)
        cosine = np.einsum("ij,ij->i", normals, rays.directions)
        lit = np.flatnonzero((cosine > 0) & rays.shines)
        ways = points.take(lit, axis=0), rays.directions.take(lit, axis=0), rays.distances.take(lit)
        weight = self.shadows.of(source).transmitted(*ways) * _balanced(rays.density.take(lit), cosine.take(lit))
        light[lit] += rays.radiance.take(lit, axis=0) * weight

    def _ask_lamps(self, nearby: NearbyLamps, points, normals, group, uniforms, light: np.ndarray) -> None:
        """Add to the ``light`` (K, 3) at points what a ray from each to a lamp brings."""
        lamps = nearby.rays(points, normals, group, uniforms)
        red, green, blue = lamps.light.T
        lit = np.flatnonzero((red != 0) | (green != 0) | (blue != 0))
        ways = points.take(lit, axis=0), lamps.directions.take(lit, axis=0), lamps.distances.take(lit)
        light[lit] += lamps.light.take(lit, axis=0) * self.shadows.transmitted(*ways)


@dataclass(frozen=True)
class _Side:
    """What T triangles send on, to who meets them, of light on one of their sides.

    sign   1 for the side that is met, -1 for the other one
    share  of each triangle, RGB, by the side that is met
    sends  (T + 1,) whether a triangle sends on any; the last row stands for no triangle
    """

    sign: float
    share: BySide
    sends: np.ndarray

    @classmethod
    def of(cls, sign: float, share: np.ndarray, caster: RayCaster) -> _Side:
        """Of a ``share`` (T, 3), or (2, T, 3), of the triangles of ``caster``."""
        return cls(sign, BySide(share, caster.normals), np.append(any_side(share), False))


@dataclass(frozen=True)
class Ways(Rows):
    """Where W rays have been followed to.

    owner     (W,) which ray it was
    weight    (W, 3) share of the irradiance at the landing that comes back
    lengths   (W,) metres from the point that looks around, over all landings
    landings  W, the last ones
    """

    owner: np.ndarray
    weight: np.ndarray
    lengths: np.ndarray
    landings: Landings

    def owned(self, owner: np.ndarray) -> Ways:
        """The same ways of that ``owner`` (W,)."""
        return Ways(owner, self.weight, self.lengths, self.landings)

    def weighted(self, weight: np.ndarray) -> Ways:
        """The same, of which so many times (W,) as much comes back."""
        return Ways(self.owner, self.weight * weight[:, None], self.lengths, self.landings)

    def onward(self, rows: np.ndarray, share: np.ndarray, landings: Landings) -> Ways:
        """On from the ends of these ``rows`` (R,) to R ``landings``, of which that ``share`` (R, 3) comes back."""
        lengths = self.lengths.take(rows) + landings.lengths
        return Ways(self.owner.take(rows), self.weight.take(rows, axis=0) * share, lengths, landings)

    def thinned(self, generator: np.random.Generator) -> Ways:
        """Without some of which little would come back; those that stay count the more."""
        red, green, blue = self.weight.T
        chance = np.minimum(np.maximum(np.maximum(red, green), blue) / SURE, 1.0)
        kept = np.flatnonzero(generator.random(len(chance)) < chance)
        some = self.taken(kept)
        return Ways(some.owner, some.weight / chance.take(kept)[:, None], some.lengths, some.landings)


def _balanced(density: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """What radiance counts (K, 1) by the balance heuristic, of one ray with that ``density`` and one by the cosine."""
    return (cosine / (density + cosine / np.pi))[:, None]


def by_cells(light: np.ndarray) -> np.ndarray:
    """Of light (2 C, 6) at records: (C + 1, 10), each cell's with its contrasts; the last row stands for no cell."""
    one, other = np.split(light, 2)
    mean, differ = 0.5 * (one + other), 0.5 * (one - other)
    cells = np.column_stack([mean[:, :3], differ[:, :3].sum(axis=1), mean[:, 3:], differ[:, 3:]])
    return np.concatenate([cells, np.zeros((1, 3 + CONTRASTS))])
