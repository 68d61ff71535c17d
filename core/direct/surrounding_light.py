"""Light that surrounds a point: a world, shining triangles. Rays are aimed at it, and go where light was found.

Both kinds of rays are weighed by the balance heuristic (Veach and Guibas 1995), so that neither a small bright window
nor a lamp that touches the point is noisy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..lights.light import Surroundings
from .direction_guide import DirectionChoice, Sightings
from .looks import Look, Reflections
from .low_discrepancy import nets
from .nearby_lamps import NearbyLamps
from .rays_around import RaysAround
from .round_sums import RoundSums, batches, net_means
from .shadows import Shadows
from .spots import Spots
from .triangle_choice import TriangleChoice


class SurroundingLight:
    """Irradiance from ``lights``, by ``rays`` (a power of two) in a round to each of them and ``rays`` by chance.

    Surfaces farther than ``reach`` metres do not shade a point from the world. Attribute ``lit``: whether there are
    lights; ``gathers``: whether rays by chance also bring what surfaces reflect.
    """

    def __init__(self, lights: Sequence[Surroundings], shadows: Shadows, reach: float, rays: int):
        self._lights, self._rays, self._chances = lights, rays, rays
        self._around = RaysAround(lights, shadows, reach)
        self.lit, self.gathers = bool(lights), False

    def gather(self, reflected: Reflections, rays: int) -> None:
        """Let ``rays`` rays by chance (a power of two) in a round bring ``reflected`` light from now on."""
        self._around.reflected, self._chances, self.gathers = reflected, rays, True

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
        spread: RoundSums,
        seen: list[Sightings] | None,
        aims: dict[int, TriangleChoice],
        nearby: NearbyLamps | None,
        first: int,
    ) -> None:
        """Add to the sums of the K ``spots`` what ``rounds`` (K,) rounds of rays from each of them find.

        ``spread`` sums up by how much the reflected light of the records' halves is off from their mean, RGB sum. What
        was seen goes into the list ``seen``; the rest is as in :class:`.Look`.
        """
        for batch in batches(rounds):
            spot, aimed, chances = batch.spot, batch.size * self._rays, batch.size * self._chances
            total, ratio = np.zeros((len(spot), 3)), self._chances / self._rays
            look = Look(spots, spot, aimed, ratio, guide, generator, seen, total, aims, nearby, first)
            for light in self._lights:
                if light.aimed:
                    self._around.aimed(light, look, nets(aimed, len(spot), generator))
            look = replace(look, count=chances)
            found, sent = self._around.by_chance(look, nets(chances, len(spot), generator))
            if self.lit:
                direct.add(batch, total + net_means(found, chances))
            if sent is not None:
                halves = net_means(sent, chances)
                reflected.add(batch, 0.5 * (halves[:, :3] + halves[:, 3:]))
                spread.add(batch, 0.5 * (halves[:, :3] - halves[:, 3:]).sum(axis=1, keepdims=True))
