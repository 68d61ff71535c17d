"""Light that surrounds a point: a world, shining triangles. Rays are aimed at it, and go where light was found.

Both kinds of rays are weighed by the balance heuristic (Veach and Guibas 1995), so that neither a small bright window
nor a lamp that touches the point is noisy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..lights.light import SHADOW_DIMENSIONS, Surroundings
from .direction_guide import DirectionChoice, Sightings
from .looks import Look, ReflectedLight
from .looks_by_numpy import LooksByNumPy
from .low_discrepancy import scrambled_net
from .round_sums import RoundSums, batches, net_means
from .shadows import Shadows
from .spots import Spots


class SurroundingLight:
    """Irradiance from ``lights``, by ``rays`` (a power of two) in a round to each of them and ``rays`` by chance.

    Surfaces farther than ``reach`` metres do not shade a point from the world. Attribute ``lit``: whether there are
    lights; ``gathers``: whether rays by chance also bring what surfaces reflect.
    """

    def __init__(self, lights: Sequence[Surroundings], shadows: Shadows, reach: float, rays: int):
        self._lights, self._rays, self._chances = lights, rays, rays
        self._looks = LooksByNumPy(lights, shadows, reach)
        self.lit, self.gathers = bool(lights), False

    def gather(self, reflected: ReflectedLight, rays: int) -> None:
        """Let ``rays`` rays by chance (a power of two) in a round bring ``reflected`` light from now on."""
        self._looks.reflected, self._chances, self.gathers = reflected, rays, True

    @property
    def rays_per_round(self) -> int:
        """Rays from each point in a round."""
        if not (self.lit or self.gathers):
            return 0
        return self._chances + self._rays * sum(light.aimed for light in self._lights)

    def cast(
        self,
        spots: Spots,
        rounds: np.ndarray,
        guide: DirectionChoice | None,
        generator: np.random.Generator,
        direct: RoundSums,
        reflected: RoundSums,
        spread: np.ndarray,
        seen: list[Sightings] | None = None,
    ) -> None:
        """Add to the sums of the K ``spots`` what ``rounds`` (K,) rounds of rays from each of them find.

        ``spread`` (2, K) sums up by how much the reflected light of the records' halves differs, and the rounds. What
        was seen goes into the list ``seen``.
        """
        for rows, spot in batches(rounds):
            total, chances = np.zeros((len(spot), 3)), self._chances / self._rays
            look = Look(spots, spot, self._rays, chances, guide, generator, seen, total)
            for light in self._lights:
                if light.aimed:
                    self._looks.aimed(light, look, self._uniforms(len(spot), self._rays, generator))
            look = replace(look, count=self._chances)
            found, sent = self._looks.by_chance(look, self._uniforms(len(spot), self._chances, generator))
            if self.lit:
                direct.add(rows, rounds[rows], total + net_means(found, look.count))
            if sent is not None:
                halves = net_means(sent, look.count)
                reflected.add(rows, rounds[rows], 0.5 * (halves[:, :3] + halves[:, 3:]))
                differ = 0.5 * (halves[:, :3].sum(axis=1) - halves[:, 3:].sum(axis=1))
                spread[0] += np.bincount(spot, differ, len(spots))
                spread[1, rows] += rounds[rows]

    def _uniforms(self, count: int, rays: int, generator: np.random.Generator) -> np.ndarray:
        """Low-discrepancy pairs for each of ``count`` points, (count * rays, 2)."""
        shifts = generator.integers(0, 1 << 32, (count, SHADOW_DIMENSIONS), np.uint32)
        return scrambled_net(rays, shifts).reshape(-1, SHADOW_DIMENSIONS)
