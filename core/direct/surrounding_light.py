"""Light that surrounds a point: a world, shining triangles. Rays are aimed at it, and go where light was found.

Both kinds of rays are weighed by the balance heuristic (Veach and Guibas 1995), so that neither a small bright window
nor a lamp that touches the point is noisy.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights.light import Surroundings
from .direction_guide import DirectionChoice, Sightings
from .looks import Look
from .looks_by_numpy import LooksByNumPy
from .low_discrepancy import nets
from .round_sums import RoundSums, batches, net_means
from .shadows import Shadows
from .spots import Spots
from .triangle_choice import TriangleChoice


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
        aims: dict[int, TriangleChoice] | None = None,
    ) -> None:
        """Add to the ``sums`` of the K ``spots`` what ``rounds`` (K,) rounds of rays from each of them find.

        What was seen goes into the list ``seen``; ``aims`` are those of :class:`.Look`.
        """
        for batch in batches(rounds):
            spot, count = batch.spot, batch.size * self._rays
            found = np.zeros((len(spot) * count, 3))
            look = Look(spots, spot, count, guide, found, seen, aims or {})
            for light in self._lights:
                if light.aimed:
                    self._looks.aimed(light, look, nets(count, len(spot), generator))
            self._looks.by_chance(look, nets(count, len(spot), generator))
            sums.add(batch, net_means(found, count))
