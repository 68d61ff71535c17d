"""What surfaces reflect towards points that look around: gather rays look it up in records, or are followed on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..direct.looks import Look
from ..direct.looks_by_numpy import LooksByNumPy
from ..direct.shadows import Shadows
from ..direct.spots import Spots
from ..lights.light import SHADOW_DIMENSIONS, Light
from ..rays import RayCaster
from ..sampling import frames
from ..scene import Scene
from ..sides import BySide
from .records import Landings, Records

#: Rays are followed over so many landings at most; the light that is left there is next to nothing.
MOST_FOLLOWED = 8


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
        self._looks = LooksByNumPy(self._surroundings, self._shadows, np.inf)
        self._looks.reflected = self
        # What surfaces send on of the light on the side that is met, and on the other one.
        self._sides = [(1.0, BySide(scene.albedo, caster.normals))]
        if scene.translucency is not None:
            self._sides.append((-1.0, BySide(scene.translucency, caster.normals)))
        self.know(np.zeros((2 * len(records), 3)), np.zeros((2 * len(records), 3)))

    def know(self, direct: np.ndarray, indirect: np.ndarray) -> None:
        """The records' ``direct`` and ``indirect`` irradiance (2 C, 3) W/m^2 are these from now on."""
        self._direct, self._all = _by_halves(direct), _by_halves(direct + indirect)

    def sent(self, look: Look, rows: np.ndarray, directions, triangle, places) -> np.ndarray:
        """Radiosity (K, 6) W/m^2 of each ``triangle`` (K,), -1 for none, met at ``places`` (K, 3), in two halves.

        The ``rows`` (K,) of the look's rays met them, along unit ``directions`` (K, 3).
        """
        found = np.zeros((len(triangle), 6))
        if look.followed >= min(self._bounces, MOST_FOLLOWED):
            return found
        for side, shares in self._sides:
            met = np.flatnonzero((triangle >= 0) & shares.met(triangle, directions).any(axis=1))
            ray, way, hit = rows.take(met), directions.take(met, axis=0), triangle.take(met)
            begin = look.rays.points.take(ray, axis=0)
            landings = Landings.of(self._caster, begin, way, hit, places.take(met, axis=0), side)
            found[met] += self._irradiance(look, landings, ray) * np.tile(shares.met(hit, way), 2)
        return found

    def _irradiance(self, look: Look, landings: Landings, rows: np.ndarray) -> np.ndarray:
        """Irradiance (K, 6) at the ``landings`` (K) of those ``rows`` (K,) of a look."""
        cell = self._records.find(landings)
        known = self._direct if look.followed == self._bounces - 1 else self._all
        irradiance = known.take(cell, axis=0)
        unknown = np.flatnonzero(cell < 0)
        if len(unknown):
            irradiance[unknown] = self._around(look, landings.taken(unknown), rows.take(unknown))
        return irradiance

    def _around(self, look: Look, landings: Landings, rows: np.ndarray) -> np.ndarray:
        """Irradiance (K, 6) at the ``landings`` (K) of those ``rows`` (K,) of a look, by a ray to each light."""
        points, normals, generator = landings.stands, landings.normals, look.generator
        group = look.rays.group.take(rows) + look.first
        spots = Spots(points, normals, *frames(normals), group)
        count, total = np.arange(len(points)), np.zeros((len(points), 3))
        onward = Look(spots, count, 1, 1.0, None, generator, None, total, {}, look.nearby, 0, look.followed + 1)
        for light in self._surroundings:
            if light.aimed:
                self._looks.aimed(light, onward, generator.random((len(points), SHADOW_DIMENSIONS)))
        found, sent = self._looks.by_chance(onward, generator.random((len(points), 2)))
        if look.nearby is not None and look.nearby.lamps:
            lamps = look.nearby.rays(points, normals, group, generator.random((len(points), 3)))
            shining = np.flatnonzero(lamps.light.any(axis=1))
            ways = points[shining], lamps.directions[shining], lamps.distances[shining]
            total[shining] += lamps.light[shining] * self._shadows.transmitted(*ways)
        return sent + np.tile(found + total, 2)


def _by_halves(irradiance: np.ndarray) -> np.ndarray:
    """Of irradiance (2 C, 3) at records: (C + 1, 6), each cell's by both halves; the last row stands for no cell."""
    cells = len(irradiance) // 2
    return np.concatenate([np.concatenate([irradiance[:cells], irradiance[cells:]], axis=1), np.zeros((1, 6))])
