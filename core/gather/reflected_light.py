"""What surfaces reflect towards points that look around: gather rays look it up in records, or are followed on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..direct.looks import Look
from ..direct.nearby_light import NearbyLight
from ..direct.shadows import Shadows
from ..lights.light import SHADOW_DIMENSIONS, Light
from ..rays import RayCaster
from ..sampling import cosine_hemisphere
from ..scene import Scene
from .records import Landings, Records

#: Rays are followed over so many landings at most; the light that is left there is next to nothing.
MOST_FOLLOWED = 8

#: Rays of which less than this share would come back are followed on only in that proportion (Russian roulette).
SURE = 0.5


class ReflectedLight:
    """Light that the diffuse surfaces of ``scene`` send on, by ``records``; dark until :meth:`know`.

    It is known in two independent halves, see records.py: arrays of six columns have RGB by the first one and by the
    second. Rays that land where no record tells of the light are followed on: one ray more looks around from there,
    and shadow rays go to the lights, ``surroundings`` and lamps (secondary gathering, Jensen 2001). At most ``bounces``
    reflections count.
    """

    def __init__(self, scene: Scene, caster: RayCaster, lights: Sequence[Light], records: Records, bounces: int):
        self._caster, self._records, self._bounces = caster, records, bounces
        self._shadows = Shadows(scene, caster)
        self._surroundings = [light for light in lights if hasattr(light, "met")]
        self._albedo = np.concatenate([scene.albedo, scene.albedo], axis=1)
        # The last row stands for no triangle.
        self._reflects = np.append(scene.albedo.any(axis=1), False)
        self.know(np.zeros((2 * len(records), 3)), np.zeros((2 * len(records), 3)))

    def know(self, direct: np.ndarray, indirect: np.ndarray) -> None:
        """The records' ``direct`` and ``indirect`` irradiance (2 C, 3) W/m^2 are these from now on."""
        self._direct, self._all = _by_halves(direct), _by_halves(direct + indirect)

    def sent(self, look: Look, rows: np.ndarray, directions, triangle, places) -> np.ndarray:
        """Radiosity (K, 6) W/m^2 of each ``triangle`` (K,), -1 for none, met at ``places`` (K, 3), in two halves.

        The ``rows`` (K,) of the look's rays met them, along unit ``directions`` (K, 3).
        """
        found = np.zeros((len(triangle), 6))
        met = np.flatnonzero(self._reflects.take(triangle, mode="wrap"))
        rows, directions, triangle, places = (part.take(met, axis=0) for part in (rows, directions, triangle, places))
        landings = Landings.of(self._caster, look.rays.points.take(rows, axis=0), directions, triangle, places)
        cell = self._records.find(landings, landings.lengths)
        irradiance = self._known(1).take(cell, axis=0)
        unknown = np.flatnonzero(cell < 0)
        if len(unknown):
            group = look.rays.group.take(rows.take(unknown)) + look.first
            irradiance[unknown] = self._followed(landings.taken(unknown), group, look.nearby, look.generator)
        irradiance *= self._albedo.take(triangle, axis=0)
        found[met] = irradiance
        return found

    def _known(self, reflections: int) -> np.ndarray:
        """What counts of the light (C + 1, 6) at records after which there are so many ``reflections``."""
        return self._direct if reflections == self._bounces else self._all

    def _followed(self, landings: Landings, group, nearby: NearbyLight | None, generator) -> np.ndarray:
        """Irradiance (K, 6) at ``landings`` (K) of rays from ``group`` (K,), by one path from each."""
        ways = _Ways(np.arange(len(group)), np.ones((len(group), 3)), landings.lengths, landings)
        owners, found = [], []
        for reflections in range(1, min(self._bounces, MOST_FOLLOWED) + 1):
            light, onward = self._around(ways.landings, group.take(ways.owner), nearby, generator)
            owners.append(ways.owner)
            found.append(np.tile(ways.weight * light, 2))
            if reflections == min(self._bounces, MOST_FOLLOWED):
                break
            ways = ways.onward(onward, self._albedo[:, :3])
            cell = self._records.find(ways.landings, ways.lengths)
            known = np.flatnonzero(cell >= 0)
            owners.append(ways.owner.take(known))
            irradiance = self._known(reflections + 1).take(cell.take(known), axis=0)
            found.append(np.tile(ways.weight.take(known, axis=0), 2) * irradiance)
            ways = ways.going(np.flatnonzero(cell < 0), generator)
            if len(ways.owner) == 0:
                break
        owner, found = np.concatenate(owners), np.concatenate(found)
        return np.stack([np.bincount(owner, column, len(group)) for column in found.T], axis=1)

    def _around(self, landings: Landings, group, nearby: NearbyLight | None, generator):
        """Direct irradiance (K, 3) at the ``landings`` (K), by a ray to each light and one by chance."""
        points, normals, count = landings.stands, landings.normals, len(group)
        light = np.zeros((count, 3))
        for source in self._surroundings:
            if source.aimed:
                rays = source.shadow_rays(points, generator.random((count, SHADOW_DIMENSIONS)))
                cosine = np.einsum("ij,ij->i", normals, rays.directions)
                lit = np.flatnonzero((cosine > 0) & rays.shines)
                cosine = cosine.take(lit)
                through = self._shadows.transmitted(
                    points.take(lit, axis=0), rays.directions.take(lit, axis=0), rays.distances.take(lit)
                )
                weight = cosine / (rays.density.take(lit) + cosine / np.pi)
                light[lit] += rays.radiance.take(lit, axis=0) * (through * weight[:, None])
        if nearby is not None and nearby.lamps:
            lamps = nearby.rays(points, normals, group, generator.random((count, 3)))
            red, green, blue = lamps.light.T
            shining = np.flatnonzero((red != 0) | (green != 0) | (blue != 0))
            ways = points.take(shining, axis=0), lamps.directions.take(shining, axis=0), lamps.distances.take(shining)
            light[shining] += lamps.light.take(shining, axis=0) * self._shadows.transmitted(*ways)
        directions = cosine_hemisphere(normals, generator.random((count, 2)))
        cosine = np.einsum("ij,ij->i", normals, directions)
        onward = []
        for rows, hits, share in self._shadows.surfaces.met(points, directions):
            for source in self._surroundings:
                mine = np.flatnonzero(source.among(hits.triangle))
                at = rows.take(mine)
                there = hits.triangle.take(mine), hits.points.take(mine, axis=0)
                radiance, density = source.met(points.take(at, axis=0), directions.take(at, axis=0), *there)
                weight = cosine.take(at) / (density + cosine.take(at) / np.pi)
                light[at] += radiance * (share.take(mine, axis=0) * weight[:, None])
            met = np.flatnonzero(self._reflects.take(hits.triangle, mode="wrap"))
            ray, triangle, share = rows.take(met), hits.triangle.take(met), share.take(met, axis=0)
            places = hits.points.take(met, axis=0)
            ahead = points.take(ray, axis=0), directions.take(ray, axis=0)
            onward.append((ray, share, triangle, Landings.of(self._caster, *ahead, triangle, places)))
        if len(onward) == 1:
            return light, onward[0]
        rows, share, triangle, landings = zip(*onward, strict=True)
        return light, (*map(np.concatenate, (rows, share, triangle)), Landings.joined(landings))


@dataclass(frozen=True)
class _Ways:
    """Ways that are followed on, W of them.

    owner     (W,) which ray each belongs to
    weight    (W, 3) share of the light at its end that comes back to where following began
    lengths   (W,) metres from the point on, over all landings
    landings  W, their ends
    """

    owner: np.ndarray
    weight: np.ndarray
    lengths: np.ndarray
    landings: Landings

    def onward(self, met, albedo: np.ndarray) -> _Ways:
        rows, share, triangle, landings = met
        weight = self.weight.take(rows, axis=0) * share * albedo.take(triangle, axis=0)
        return _Ways(self.owner.take(rows), weight, self.lengths.take(rows) + landings.lengths, landings)

    def going(self, rows: np.ndarray, generator) -> _Ways:
        weight = self.weight.take(rows, axis=0)
        red, green, blue = weight.T
        chance = np.minimum(np.maximum(np.maximum(red, green), blue) / SURE, 1.0)
        kept = np.flatnonzero(generator.random(len(rows)) < chance)
        rows = rows.take(kept)
        weight = weight.take(kept, axis=0) / chance.take(kept)[:, None]
        return _Ways(self.owner.take(rows), weight, self.lengths.take(rows), self.landings.taken(rows))


def _by_halves(irradiance: np.ndarray) -> np.ndarray:
    """Of irradiance (2 C, 3) at records: (C + 1, 6), each cell's by both halves; the last row stands for no cell."""
    cells = len(irradiance) // 2
    return np.concatenate([np.concatenate([irradiance[:cells], irradiance[cells:]], axis=1), np.zeros((1, 6))])
