"""Direct light by shadow rays: from each point to the lights, and by chance where light surrounds it.

Lamps are aimed at. A world or shining triangles are aimed at as well as met by rays that follow the cosine, and the two
are weighed by the balance heuristic (Veach and Guibas 1995), so that neither a small bright window nor a lamp
that touches the point is noisy.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .emission import lights_of
from .estimate import Irradiance, IrradianceEstimate
from .lamp_choice import LampChoice
from .lights.light import SHADOW_DIMENSIONS, Light
from .low_discrepancy import scrambled_net
from .rays import RayCaster
from .sampling import cosine_hemisphere
from .scene import Scene
from .settings import BakeSettings
from .shadows import Shadows

#: Rays from each point in one round to the lamps, to each of the surroundings, and by chance; a power of two.
RAYS_PER_ROUND = 16

#: Up to so many lamps without extent are all asked, exactly; of more, as of lamps with extent, some are chosen.
MOST_SHARP_LAMPS = 32

#: Points whose rays are cast at a time.
POINTS_PER_CHUNK = 1 << 12


class DirectLight:
    """Direct irradiance at ``points`` (N, 3) m, which lie clear of surfaces, with unit ``normals`` (N, 3).

    What one ray tells exactly is found once; the rest is the mean over rounds of rays, each of which is an independent
    estimate. Equal seeds give equal results on any number of threads. Surfaces farther than the settings' shadow
    distance do not shade a point from the world.
    """

    def __init__(
        self, scene: Scene, caster: RayCaster, points: np.ndarray, normals: np.ndarray, settings: BakeSettings
    ):
        self._points, self._normals, self._seed = points, normals, settings.seed
        self._reach = settings.shadow_distance or np.inf
        self._shadows = Shadows(scene, caster)
        lights = lights_of(scene)
        self._surroundings = [light for light in lights if hasattr(light, "met")]
        lamps = [light for light in lights if not hasattr(light, "met")]
        sharp = [lamp for lamp in lamps if lamp.sharp]
        self._sharp = sharp if len(sharp) <= MOST_SHARP_LAMPS else []
        self._lamps = [lamp for lamp in lamps if lamp not in self._sharp]
        self._exact = np.zeros_like(points)
        self._estimate = IrradianceEstimate.empty(len(points))

    @property
    def exact(self) -> bool:
        """Whether no further round would change anything after the first."""
        return not self._lamps and not self._surroundings

    @property
    def irradiance(self) -> Irradiance:
        """What has been found so far."""
        found = self._estimate.irradiance
        return Irradiance(found.value + self._exact, np.zeros_like(self._exact) if self.exact else found.standard_error)

    def rounds(self, first: int, last: int) -> Iterator[float]:
        """Cast the rays of the rounds from ``first`` to before ``last``, yielding the share of them done (0..1)."""
        total, squares = np.zeros_like(self._points), np.zeros_like(self._points)
        starts = range(0, len(self._points), POINTS_PER_CHUNK)
        for start in starts:
            rows = slice(start, start + POINTS_PER_CHUNK)
            points, normals = self._points[rows], self._normals[rows]
            if first == 0:
                for lamp in self._sharp:
                    self._exact[rows] += self._aimed(lamp, points, normals, np.zeros((len(points), SHADOW_DIMENSIONS)))
            choice = LampChoice(self._lamps, points, normals)
            for number in range(first, last):
                if not self.exact:
                    sample = self._round(choice, points, normals, self._generator(number, start))
                    total[rows] += sample
                    squares[rows] += sample**2
                yield (start + len(points) * (number + 1 - first) / (last - first)) / len(self._points)
        self._estimate = self._estimate.merged(IrradianceEstimate(total, squares, last - first))

    def _generator(self, number: int, start: int) -> np.random.Generator:
        return np.random.default_rng(np.random.SeedSequence(self._seed, spawn_key=(2, number, start)))

    def _round(self, choice: LampChoice, points, normals, generator: np.random.Generator) -> np.ndarray:
        """One estimate (K, 3) from RAYS_PER_ROUND rays of each kind."""
        count = len(points)
        centre, normal = np.repeat(points, RAYS_PER_ROUND, axis=0), np.repeat(normals, RAYS_PER_ROUND, axis=0)
        found = np.zeros((count * RAYS_PER_ROUND, 3))
        if self._lamps:
            chosen, probability = choice.chosen(RAYS_PER_ROUND, generator.random(count))
            uniforms = _uniforms(count, generator)
            for number, lamp in enumerate(self._lamps):
                rows = np.flatnonzero(chosen == number)
                if len(rows):
                    light = self._aimed(lamp, centre[rows], normal[rows], uniforms[rows])
                    found[rows] += light / probability[rows, None]
        for light in self._surroundings:
            if light.aimed:
                found += self._aimed(light, centre, normal, _uniforms(count, generator))
        if self._surroundings:
            found += self._by_chance(centre, normal, _uniforms(count, generator))
        return found.reshape(count, RAYS_PER_ROUND, 3).mean(axis=1)

    def _aimed(self, light: Light, points, normals, uniforms) -> np.ndarray:
        """Irradiance (K, 3) by one shadow ray from each point, weighed against rays by chance if those meet it too."""
        rays = light.shadow_rays(points, uniforms)
        cosine = np.maximum(np.einsum("ij,ij->i", normals, rays.directions), 0.0)
        density = rays.density + cosine / np.pi if light in self._surroundings else rays.density
        arriving = rays.radiance * (cosine / density)[:, None]
        rows = np.flatnonzero((arriving != 0).any(axis=1))
        through = self._shadows.transmitted(points[rows], rays.directions[rows], rays.distances[rows])
        arrived = np.zeros_like(arriving)
        arrived[rows] = arriving[rows] * through
        return arrived

    def _by_chance(self, points, normals, uniforms) -> np.ndarray:
        """Irradiance (K, 3) from the surroundings by one cosine-distributed ray from each point."""
        directions = cosine_hemisphere(normals, uniforms)
        cosine = np.maximum(np.einsum("ij,ij->i", normals, directions), np.finfo(float).tiny)
        found = np.zeros_like(points)
        for rows, hits, share in self._shadows.surfaces(points, directions, self._reach):
            for light in self._surroundings:
                radiance, density = light.met(points[rows], directions[rows], hits.triangle, hits.points)
                weight = cosine[rows] / (density + cosine[rows] / np.pi)
                found[rows] += radiance * share * weight[:, None]
        return found


def _uniforms(count: int, generator: np.random.Generator) -> np.ndarray:
    """RAYS_PER_ROUND low-discrepancy pairs for each of ``count`` points, (count * RAYS_PER_ROUND, 2)."""
    shifts = generator.integers(0, 1 << 32, (count, SHADOW_DIMENSIONS), np.uint32)
    return scrambled_net(RAYS_PER_ROUND, shifts).reshape(-1, SHADOW_DIMENSIONS)
