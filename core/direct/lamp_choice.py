"""Which lamps a point asks, when asking all of them would take too many rays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights.light import SHADOW_DIMENSIONS, Light

#: Shares of the choice by the light that the middle of a lamp would bring unshadowed, by the same without the cosine
#: (parts of a large lamp may shine although its middle does not), and by nothing at all (so that no light is lost).
BY_LIGHT, BY_STRENGTH, BY_NOTHING = 0.9, 0.09, 0.01


class LampChoice:
    """Chooses among ``lamps`` (L) for each of ``points`` (K, 3) with unit ``normals`` (K, 3), by brightness."""

    def __init__(self, lamps: Sequence[Light], points: np.ndarray, normals: np.ndarray):
        light, strength = _brightness(lamps, points, normals)
        even = np.ones_like(light)
        self._shares = sum(
            share * _normalised(weight)
            for share, weight in ((BY_LIGHT, light), (BY_STRENGTH, strength), (BY_NOTHING, even))
        )
        self._shares /= np.maximum(self._shares.sum(axis=1, keepdims=True), np.finfo(float).tiny)
        self._ends = np.cumsum(self._shares, axis=1)
        self._ends[:, -1] = 1.0

    def chosen(self, spot: np.ndarray, count: int, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """``count`` lamps for each sample at point ``spot`` (S,), systematically from ``offsets`` (S,) in [0, 1).

        Returns the lamps' numbers (S * count,) and the probability (S * count,) of each.
        """
        lamps = self._shares.shape[1]
        if lamps == 1:
            return np.zeros(len(spot) * count, np.int64), np.ones(len(spot) * count)
        steps = (np.arange(count) + offsets[:, None]) / count + spot[:, None]
        ends = self._ends + np.arange(len(self._ends))[:, None]
        place = np.searchsorted(ends.ravel(), steps.ravel(), side="right")
        begin = np.repeat(spot * lamps, count)
        place = np.minimum(place, begin + (lamps - 1))
        return place - begin, self._shares.ravel().take(place)


def _brightness(lamps, points, normals) -> tuple[np.ndarray, np.ndarray]:
    """What the middle of each lamp brings unshadowed (K, L), RGB sum, and the same without the cosine."""
    light, strength = np.empty((2, len(points), len(lamps)))
    middle = np.full((len(points), SHADOW_DIMENSIONS), 0.5)
    for number, lamp in enumerate(lamps):
        rays = lamp.shadow_rays(points, middle)
        strength[:, number] = np.abs(rays.radiance).sum(axis=1) / rays.density
        light[:, number] = strength[:, number] * np.maximum(np.einsum("ij,ij->i", normals, rays.directions), 0.0)
    return light, strength


def _normalised(weights: np.ndarray) -> np.ndarray:
    """Each row of ``weights`` (K, L) divided by its sum; rows without any stay zero."""
    total = weights.sum(axis=1, keepdims=True)
    return np.divide(weights, total, out=np.zeros_like(weights), where=total > 0)
