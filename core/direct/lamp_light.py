"""Light from lamps with extent, or from many lamps: some are chosen, and rays go to places on them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights.light import SHADOW_DIMENSIONS, Light
from .lamp_choice import LampChoice
from .low_discrepancy import scrambled_net
from .shadows import Shadows
from .spots import Spots


class LampLight:
    """Irradiance from ``lamps``, by ``rays`` (a power of two) in a round to all of them together."""

    def __init__(self, lamps: Sequence[Light], shadows: Shadows, rays: int):
        self._lamps, self._shadows, self._rays = lamps, shadows, rays
        self.rays_per_round = rays if lamps else 0

    def round(self, spots: Spots, choice: LampChoice, generator: np.random.Generator) -> np.ndarray:
        """One estimate (K, 3) of the light at ``spots``, of which ``choice`` chooses the lamps."""
        count = len(spots)
        chosen, probability = choice.chosen(self._rays, generator.random(count))
        shifts = generator.integers(0, 1 << 32, (count, SHADOW_DIMENSIONS), np.uint32)
        uniforms = scrambled_net(self._rays, shifts).reshape(-1, SHADOW_DIMENSIONS)
        points, normals = np.repeat(spots.points, self._rays, axis=0), np.repeat(spots.normals, self._rays, axis=0)
        found = np.zeros((len(points), 3))
        for number, lamp in enumerate(self._lamps):
            rows = np.flatnonzero(chosen == number) if len(self._lamps) > 1 else np.arange(len(chosen))
            if len(rows):
                light = light_of_lamp(self._shadows, lamp, points[rows], normals[rows], uniforms[rows])
                found[rows] += light / probability[rows, None]
        return found.reshape(count, self._rays, 3).mean(axis=1)


def light_of_lamp(shadows: Shadows, lamp: Light, points, normals, uniforms) -> np.ndarray:
    """Irradiance (K, 3) at ``points`` (K, 3) with ``normals`` (K, 3) by one shadow ray each to ``lamp``."""
    rays = lamp.shadow_rays(points, uniforms)
    cosine = np.einsum("ij,ij->i", normals, rays.directions)
    rows = np.flatnonzero((cosine > 0) & (rays.radiance != 0).any(axis=1))
    arriving = rays.radiance[rows] * (cosine[rows] / rays.density[rows])[:, None]
    arrived = np.zeros_like(points)
    arrived[rows] = arriving * shadows.transmitted(points[rows], rays.directions[rows], rays.distances[rows])
    return arrived
