"""Light that surrounds a point: a world, shining triangles. Rays are aimed at it, and go where light was found.

Both kinds of rays are weighed by the balance heuristic (Veach and Guibas 1995), so that neither a small bright window
nor a lamp that touches the point is noisy.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights.light import SHADOW_DIMENSIONS, Surroundings
from .direction_guide import DirectionChoice, Sightings
from .looks import Look
from .looks_by_numpy import LooksByNumPy
from .low_discrepancy import scrambled_net
from .round_sums import RoundSums, batches, net_means
from .shadows import Shadows
from .spots import Spots


class SurroundingLight:
    """Irradiance from ``lights``, by ``rays`` (a power of two) in a round to each of them and ``rays`` by chance.

    Surfaces farther than ``reach`` metres do not shade a point from the world.
    """

    def __init__(self, lights: Sequence[Surroundings], shadows: Shadows, reach: float, rays: int):
        self._lights, self._rays = lights, rays
        self._looks = LooksByNumPy(lights, shadows, reach)
        self.rays_per_round = rays * (1 + sum(light.aimed for light in lights)) if lights else 0

    def cast(
        self,
        spots: Spots,
        rounds: np.ndarray,
        guide: DirectionChoice | None,
        generator: np.random.Generator,
        sums: RoundSums,
        seen: list[Sightings] | None = None,
    ) -> None:
        """Add to the ``sums`` of the K ``spots`` what ``rounds`` (K,) rounds of rays from each of them find.

        What was seen goes into the list ``seen``.
        """
        for rows, spot in batches(rounds):
            found = np.zeros((len(spot) * self._rays, 3))
            look = Look(spots, spot, self._rays, guide, found, seen)
            for light in self._lights:
                if light.aimed:
                    self._looks.aimed(light, look, self._uniforms(len(spot), generator))
            self._looks.by_chance(look, self._uniforms(len(spot), generator))
            sums.add(rows, rounds[rows], net_means(found, self._rays))

    def _uniforms(self, count: int, generator: np.random.Generator) -> np.ndarray:
        """Low-discrepancy pairs for each of ``count`` points, (count * rays, 2)."""
        shifts = generator.integers(0, 1 << 32, (count, SHADOW_DIMENSIONS), np.uint32)
        return scrambled_net(self._rays, shifts).reshape(-1, SHADOW_DIMENSIONS)
