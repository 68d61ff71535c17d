"""Light from lamps with extent, or from many lamps: some are chosen, and rays go to places on them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights.light import SHADOW_DIMENSIONS, Light
from .lamp_choice import LampChoice
from .low_discrepancy import scrambled_net
from .round_sums import RoundSums, batches, net_means
from .shadows import Shadows

#: Chances of points to choose lamps that are kept from one step to the next, about; each takes 16 bytes.
MOST_CHANCES = 1 << 22


class LampLight:
    """Irradiance from ``lamps``, by ``rays`` (a power of two) in a round to all of them together."""

    def __init__(self, lamps: Sequence[Light], shadows: Shadows, rays: int):
        self._lamps, self._shadows, self._rays = lamps, shadows, rays
        self._choices: dict[int, LampChoice] = {}
        self.rays_per_round = rays if lamps else 0

    def exact(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance (K, 3) at ``points`` (K, 3) with ``normals`` (K, 3) from lamps that are all without extent."""
        found = np.zeros_like(points)
        for number in range(len(self._lamps)):
            spot, chosen = np.arange(len(points)), np.full(len(points), number)
            places = np.zeros((len(points), SHADOW_DIMENSIONS))
            found += self._samples(points, normals, spot, chosen, np.ones(len(points)), places)
        return found

    def cast(
        self,
        points: np.ndarray,
        normals: np.ndarray,
        rounds: np.ndarray,
        generator: np.random.Generator,
        sums: RoundSums,
        chunk: int,
    ) -> None:
        """Add to the ``sums`` of K points what ``rounds`` (K,) rounds of rays from each of them find.

        Points of an equal number ``chunk`` are always the same.
        """
        choice = self._choices.get(chunk)
        if choice is None:
            choice = LampChoice(self._lamps, points, normals)
            if (len(self._choices) + 1) * len(points) * len(self._lamps) <= MOST_CHANCES:
                self._choices[chunk] = choice
        for rows, spot in batches(rounds):
            chosen, probability = choice.chosen(spot, self._rays, generator.random(len(spot)))
            shifts = generator.integers(0, 1 << 32, (len(spot), SHADOW_DIMENSIONS), np.uint32)
            uniforms = scrambled_net(self._rays, shifts).reshape(-1, SHADOW_DIMENSIONS)
            sums.add(rows, rounds[rows], self._samples(points, normals, spot, chosen, probability, uniforms))

    def by_one_ray(self, points: np.ndarray, normals: np.ndarray, generator: np.random.Generator) -> np.ndarray:
        """Irradiance (K, 3) at ``points`` (K, 3) with ``normals`` (K, 3), by one ray from each to a lamp it chooses."""
        if not self._lamps or len(points) == 0:
            return np.zeros((len(points), 3))
        spot, uniforms = np.arange(len(points)), generator.random((len(points), SHADOW_DIMENSIONS + 1))
        chosen, probability = LampChoice(self._lamps, points, normals).chosen(spot, 1, uniforms[:, 0])
        return self._samples(points, normals, spot, chosen, probability, uniforms[:, 1:])

    def _samples(self, points, normals, spot, chosen, probability, uniforms) -> np.ndarray:
        """Irradiance (S, 3) at each ``spot`` (S,) of the points by rays to the ``chosen`` lamps (S * some,)."""
        count = len(chosen) // len(spot)
        order = np.argsort(chosen, kind="stable")
        ends = np.searchsorted(chosen[order], np.arange(len(self._lamps) + 1))
        parts = []
        for lamp, begin, end in zip(self._lamps, ends[:-1], ends[1:], strict=True):
            if end > begin:
                parts.append(_aimed(lamp, points, normals, spot, order[begin:end], count, probability, uniforms))
        rays, directions, distances, arriving = (np.concatenate(part) for part in zip(*parts, strict=True))
        found = np.zeros((len(chosen), 3))
        origins = points.take(spot.take(rays // count), axis=0)
        found[rays] = arriving * self._shadows.transmitted(origins, directions, distances)
        return net_means(found, count)


def _aimed(lamp, points, normals, spot, rays, count, probability, uniforms):
    """Of the ``rays`` to this lamp: those that bring light unless blocked, where they go, and how much they bring."""
    at = spot.take(rays // count)
    shadow_rays = lamp.shadow_rays(points.take(at, axis=0), uniforms.take(rays, axis=0))
    cosine = np.einsum("ij,ij->i", normals.take(at, axis=0), shadow_rays.directions)
    lit = np.flatnonzero((cosine > 0) & shadow_rays.shines)
    rays = rays.take(lit)
    weight = cosine.take(lit) / (shadow_rays.density.take(lit) * probability.take(rays))
    arriving = shadow_rays.radiance.take(lit, axis=0) * weight[:, None]
    return rays, shadow_rays.directions.take(lit, axis=0), shadow_rays.distances.take(lit), arriving
