"""Which lights the places see that photons are for, so that a small lamp gets its share beside a large one outside."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..direct.shadows import Shadows
from ..lights.light import SHADOW_DIMENSIONS, Light, ShadowRays
from ..random_streams import random_stream
from ..sampling import cosine_hemisphere

#: Rays that ask, of all places to all lights, and fewer places than these tell nothing.
RAYS, LEAST_PLACES = 1 << 16, 64

#: Places that are asked from at most.
MOST_PLACES = 1 << 10


def seen_shares(
    lights: Sequence[Light], shadows: Shadows, places: np.ndarray, normals: np.ndarray, seed: int
) -> np.ndarray | None:
    """The part (J,) of each of the ``lights`` in the direct light at ``places`` (N, 3) with ``normals`` (N, 3).

    It is the mean over the places, which all count alike however bright they are: so do their errors. None where no
    light is seen, or there are too many lights to ask.
    """
    count = min(MOST_PLACES, RAYS // max(len(lights), 1), len(places))
    if count < min(LEAST_PLACES, len(places)):
        return None
    generator = random_stream(seed, "shares")
    rows = np.sort(generator.permutation(len(places))[:count])
    places, normals = places[rows], normals[rows]
    found = np.empty((count, len(lights)))
    for column, light in enumerate(lights):
        rays = _rays(light, places, normals, generator.random((count, SHADOW_DIMENSIONS)))
        cosine = np.maximum(np.einsum("ij,ij->i", normals, rays.directions), 0.0)
        through = shadows.of(light).transmitted(places, rays.directions, rays.distances)
        found[:, column] = np.abs(rays.radiance * through).sum(axis=1) * cosine / rays.density
    whole = found.sum(axis=1)
    lit = np.flatnonzero(whole > 0)
    return (found[lit] / whole[lit, None]).mean(axis=0) if len(lit) else None


def _rays(light: Light, places: np.ndarray, normals: np.ndarray, uniforms: np.ndarray) -> ShadowRays:
    """A ray from each of ``places`` (K, 3) to the ``light``, along the cosine if it aims at none."""
    if getattr(light, "aimed", True):
        return light.shadow_rays(places, uniforms)
    directions, nothing = cosine_hemisphere(normals, uniforms), np.full(len(places), -1)
    cosine = np.einsum("ij,ij->i", normals, directions)
    radiance, _ = light.met(places, directions, nothing, places)
    density = np.maximum(cosine, np.finfo(float).tiny) / np.pi
    return ShadowRays(directions, np.full(len(places), np.inf), radiance, density)
