"""What surfaces reflect towards points that look around: gather rays look it up in records, or are followed on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..direct.lamp_light import LampLight
from ..direct.looks import Look
from ..direct.looks_by_numpy import LooksByNumPy
from ..direct.shadows import Shadows
from ..direct.spots import Spots
from ..lights.light import SHADOW_DIMENSIONS, Light
from ..rays import RayCaster
from ..sampling import frames
from ..scene import Scene
from .records import Landings, Records

#: Rays are followed over so many landings at most; the light that is left there is next to nothing.
MOST_FOLLOWED = 8


class ReflectedLight:
    """Light that the diffuse surfaces of ``scene`` send on, by ``records``; dark until :meth:`know`.

    It is known in two independent halves, see records.py: arrays of six columns have RGB by the first one and by the
    second. Rays that land where no record tells of the light are followed on: one ray more looks around from there,
    and shadow rays go to ``lights`` (secondary gathering, Jensen 2001). At most ``bounces`` reflections count.
    """

    def __init__(self, scene: Scene, caster: RayCaster, lights: Sequence[Light], records: Records, bounces: int):
        self._caster, self._records, self._bounces = caster, records, bounces
        shadows = Shadows(scene, caster)
        self._lamps = LampLight([light for light in lights if not hasattr(light, "met")], shadows, 1)
        self._surroundings = [light for light in lights if hasattr(light, "met")]
        self._looks = LooksByNumPy(self._surroundings, shadows, np.inf)
        self._looks.reflected = self
        self._albedo = np.concatenate([scene.albedo, scene.albedo], axis=1)
        self._reflects = scene.albedo.any(axis=1)
        self.know(np.zeros((2 * len(records), 3)), np.zeros((2 * len(records), 3)))

    def know(self, direct: np.ndarray, indirect: np.ndarray) -> None:
        """The records' ``direct`` and ``indirect`` irradiance (2 C, 3) W/m^2 are these from now on."""
        self._direct, self._all = _by_halves(direct), _by_halves(direct + indirect)

    def sent(self, points, directions, triangle, places, generator: np.random.Generator, followed: int = 0):
        """Radiosity (K, 6) W/m^2 of each ``triangle`` (K,), -1 for none, where rays from ``points`` (K, 3) met it.

        The rays have unit ``directions`` (K, 3) and met it at ``places`` (K, 3). ``followed`` counts the rays before.
        """
        found = np.zeros((len(triangle), 6))
        if followed >= min(self._bounces, MOST_FOLLOWED):
            return found
        met = np.flatnonzero((triangle >= 0) & self._reflects[triangle])
        points, directions, triangle, places = (
            part.take(met, axis=0) for part in (points, directions, triangle, places)
        )
        landings = Landings.of(self._caster, points, directions, triangle, places)
        cell = self._records.find(landings)
        known = self._direct if followed == self._bounces - 1 else self._all
        irradiance = known.take(cell, axis=0)
        rows = np.flatnonzero(cell < 0)
        if len(rows):
            onward = landings.taken(rows)
            irradiance[rows] = self._around(onward.stands, onward.normals, generator, followed + 1)
        irradiance *= self._albedo.take(triangle, axis=0)
        found[met] = irradiance
        return found

    def _around(self, points, normals, generator: np.random.Generator, followed: int) -> np.ndarray:
        """Irradiance (K, 6) at ``points`` (K, 3) with ``normals`` (K, 3), by one ray each to each kind of light."""
        spots = Spots(points, normals, *frames(normals), np.zeros(len(points), np.int64))
        rows = np.arange(len(points))
        look = Look(spots, rows, 1, 1.0, None, generator, None, np.zeros((len(points), 3)), followed)
        for light in self._surroundings:
            if light.aimed:
                self._looks.aimed(light, look, generator.random((len(points), SHADOW_DIMENSIONS)))
        found, sent = self._looks.by_chance(look, generator.random((len(points), 2)))
        return sent + np.tile(found + look.total + self._lamps.by_one_ray(points, normals, generator), 2)


def _by_halves(irradiance: np.ndarray) -> np.ndarray:
    """Of irradiance (2 C, 3) at records: (C + 1, 6), each cell's by both halves; the last row stands for no cell."""
    cells = len(irradiance) // 2
    return np.concatenate([np.concatenate([irradiance[:cells], irradiance[cells:]], axis=1), np.zeros((1, 6))])
