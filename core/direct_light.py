"""Direct light by shadow rays: from each point to the lights, and by chance where light surrounds it.

Lamps are aimed at. A world or shining triangles are aimed at as well as met by rays that follow the cosine, and the two
are weighed by the balance heuristic (Veach and Guibas 1995), so that neither a small bright window nor a lamp
that touches the point is noisy.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .emission import lights_of
from .irradiance import Irradiance
from .lamp_choice import LampChoice
from .lights.light import SHADOW_DIMENSIONS, Light
from .low_discrepancy import scrambled_net
from .parallel import ordered_map
from .rays import RayCaster
from .sampling import cosine_hemisphere
from .scene import Scene
from .settings import BakeSettings
from .shadows import Shadows

#: Rays from each point in one round to the lamps, to each of the surroundings, and by chance; a power of two.
RAYS_PER_ROUND = 4

#: Up to so many lamps without extent are all asked, exactly; of more, as of lamps with extent, some are chosen.
MOST_SHARP_LAMPS = 32

#: Points whose rays are cast at a time.
POINTS_PER_CHUNK = 1 << 12


class DirectLight:
    """Direct irradiance at ``points`` (N, 3) m, which lie clear of surfaces, with unit ``normals`` (N, 3).

    What one ray tells exactly is found once; the rest is the mean over rounds of rays, each of which is an independent
    estimate. Equal seeds give equal results on any number of threads. Surfaces farther than the settings' shadow
    distance do not shade a point from the world.

    Attribute ``done``: how many rounds there were.
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
        self._total, self._squares = np.zeros_like(points), np.zeros_like(points)
        self.done = 0

    @property
    def exact(self) -> bool:
        """Whether no further round would change anything after the first."""
        return not self._lamps and not self._surroundings

    @property
    def rays_per_round(self) -> int:
        """Rays that one round casts, of all points."""
        kinds = bool(self._lamps) + bool(self._surroundings) + sum(light.aimed for light in self._surroundings)
        return RAYS_PER_ROUND * len(self._points) * kinds

    @property
    def irradiance(self) -> Irradiance:
        """What has been found so far.

        Few rounds that happen to agree do not prove that all would: to their own variance one of that relative size is
        added which the rounds have at all points on average (an empirical Bayes estimate with the weight of one round).
        """
        rounds = max(self.done, 1)
        mean = self._total / rounds
        value = mean + self._exact
        if self.exact or self.done < 2:
            return Irradiance(value, np.full_like(value, 0.0 if self.exact else np.inf))
        variance = np.maximum(self._squares / rounds - mean**2, 0.0) * (rounds / (rounds - 1))
        relative = np.divide(variance, value**2, out=np.zeros_like(value), where=value > 0)
        usual = np.minimum(relative, 1.0).mean(axis=0) * value**2
        return Irradiance(value, np.sqrt(((rounds - 1) * variance + usual) / rounds**2))

    def rounds(self, first: int, last: int) -> Iterator[float]:
        """Cast the rays of the rounds from ``first`` to before ``last``, yielding the share of them done (0..1)."""
        starts = range(0, len(self._points), POINTS_PER_CHUNK)
        chunks = [slice(start, start + POINTS_PER_CHUNK) for start in starts]
        found = ordered_map(lambda rows: self._sums(rows, first, last), chunks)
        for rows, (exact, sum_, sum_of_squares) in zip(chunks, found, strict=True):
            self._exact[rows] += exact
            self._total[rows] += sum_
            self._squares[rows] += sum_of_squares
            yield min(rows.stop / len(self._points), 1.0)
        self.done = last

    def _sums(self, rows: slice, first: int, last: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of K points, what is exact (K, 3), found in the first round, and sums of the rounds and of their squares."""
        points, normals = self._points[rows], self._normals[rows]
        exact, total, squares = (np.zeros_like(points) for _ in range(3))
        if first == 0:
            for lamp in self._sharp:
                exact += self._aimed(lamp, points, normals, np.zeros((len(points), SHADOW_DIMENSIONS)))
        if not self.exact:
            choice = LampChoice(self._lamps, points, normals)
            for number in range(first, last):
                sample = self._round(choice, points, normals, self._generator(number, rows.start))
                total += sample
                squares += sample**2
        return exact, total, squares

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
