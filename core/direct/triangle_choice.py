"""Aiming at shining triangles: as a group of points has learnt to, with the density of that on either side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..lights.emissive import EmissiveTriangles
from ..lights.light import ShadowRays
from .emitter_choice import EmitterChoice
from .learnt_choice import LearntChoice


@dataclass(frozen=True)
class TriangleChoice:
    """How points choose among the triangles of ``light``; ``learnt`` takes what the groups in ``part`` see."""

    light: EmissiveTriangles
    choice: EmitterChoice
    learnt: LearntChoice
    part: slice
    rows: slice
    scale: np.ndarray

    def shadow_rays(self, spot: np.ndarray, points: np.ndarray, uniforms: np.ndarray) -> tuple[ShadowRays, np.ndarray]:
        """Rays from ``points`` (S, 3), of which each is that ``spot`` (S,), and the range (S,) that each goes to."""
        chosen, rest, column, probability = self.choice.chosen(spot, uniforms[:, 0])
        rays = self.light.rays_to(chosen, points, np.stack([rest, uniforms[:, 1]], axis=1))
        factor = self._over_power(chosen, probability)
        return ShadowRays(rays.directions, rays.distances, rays.radiance, rays.density * factor), column

    def factor(self, spot: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """Density (S,) with which each ``spot`` (S,) aims at the scene's ``triangle`` (S,), over that of the light."""
        number = self.light.number(triangle)
        return self._over_power(number, self.choice.probability(spot, number))

    def learn(self, spot, column, rows, arriving, density) -> None:
        """All rays went to that range ``column`` (S,); those in ``rows`` (R,) brought ``arriving`` (R, 3)."""
        share = self.choice.share[spot[rows], column[rows]]
        brought = np.zeros(len(spot))
        brought[rows] = np.abs(arriving).sum(axis=1) * share / density
        self.learnt.add(self.part, self.rows, self.choice, self.scale, spot, column, brought)

    def _over_power(self, number: np.ndarray, probability: np.ndarray) -> np.ndarray:
        by_power = self.light.chances[number]
        return np.divide(probability, by_power, out=np.ones_like(by_power), where=by_power > 0.0)
