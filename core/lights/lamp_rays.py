"""Rays from points to lamps and what they bring: how light falls off, of lamps without extent and of any size."""

from __future__ import annotations

import numpy as np

from ..sampling import around
from .light import ShadowRays

#: Nearer than this many metres a point lies on the light, which then has no direction.
CLOSEST = 1e-100

#: A ball below this radius in metres is a point; its radiance would lead to numbers without meaning.
SMALLEST_RADIUS = 1e-12


def towards(vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions (K, 3), +Z where there is none, and lengths (K,) of ``vectors`` (K, 3)."""
    lengths = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    near = lengths <= CLOSEST
    directions = vectors / np.where(near, 1.0, lengths)[:, None]
    directions[near] = (0.0, 0.0, 1.0)
    return directions, lengths


def lit_rays(directions, distances, radiance, density, lit) -> ShadowRays:
    """Shadow rays that bring ``radiance`` (K, 3) where ``lit`` (K,); elsewhere nothing, with density 1."""
    return ShadowRays(directions, distances, np.where(lit[:, None], radiance, 0.0), np.where(lit, density, 1.0))


def rays_to_point(points: np.ndarray, position: np.ndarray, power: np.ndarray) -> ShadowRays:
    """To a lamp of intensity ``power`` (3,) / (4 pi) without extent; a point on it sees nothing."""
    directions, distances = towards(position - points)
    lit = distances > CLOSEST
    spread = 4.0 * np.pi * np.where(lit, distances, 1.0) ** 2
    return lit_rays(directions, distances, power / spread[:, None], np.ones(len(points)), lit)


def rays_to_ball(
    points: np.ndarray,
    position: np.ndarray,
    power: np.ndarray,
    radius: float | np.ndarray,
    soft: bool,
    uniforms: np.ndarray,
) -> ShadowRays:
    """To a sphere of radiance ``power`` (3,) / (4 pi^2 radius^2), or with ``soft`` to its disc that faces each point.

    Both fill a cone, in which directions are uniform by solid angle. A ray ends on the near side of the sphere, or on
    the disc. A point inside the sphere sees the far side of it all around, as in Cycles; particles shine there only
    once they have passed the disc through the centre. ``position`` and ``power`` may also be (K, 3), and ``radius``
    (K,): then each point has a lamp of its own.
    """
    axes, distances = towards(position - points)
    if soft:
        slant = np.hypot(distances, radius)
        fall = radius**2 / (slant * (slant + distances))
    else:
        inside = distances <= radius
        sine_squared = np.where(inside, 0.0, radius / np.where(inside, 1.0, distances)) ** 2
        fall = np.where(inside, 2.0, sine_squared / (1.0 + np.sqrt(1.0 - sine_squared)))
    part = fall * uniforms[:, 0]
    cosine = 1.0 - part
    if soft:
        reach = np.minimum(distances / np.maximum(cosine, np.finfo(float).tiny), slant)
    else:
        half_chord = np.sqrt(np.maximum(radius**2 - distances**2 * part * (2.0 - part), 0.0))
        far = distances * cosine + half_chord
        # near x far = D^2 - R^2, which keeps its digits close to the sphere as well as far away
        near = (distances - radius) * (
            (distances + radius) / np.where(inside, 1.0, np.maximum(far, distances - radius))
        )
        reach = np.where(inside, np.maximum(far, 0.0), near)
    radiance = power / ((2.0 * np.pi * np.asarray(radius)) ** 2)[..., None]
    radiance = np.array(np.broadcast_to(radiance, points.shape))
    return ShadowRays(around(axes, part, uniforms[:, 1]), reach, radiance, 1.0 / (2.0 * np.pi * fall))
