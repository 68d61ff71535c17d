"""Uniform world: the same radiance from every direction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..bounds import Bounds
from ..checks import fill, vector
from ..sampling import choose, cosine_hemisphere, face_points
from .light import Particles, Sky


@dataclass(frozen=True, eq=False)
class UniformWorld(Sky):
    """A sky and ground of one colour. ``radiance`` (3,) is in W/(m^2 sr), RGB.

    Raises InvalidArrayError when it is not three finite numbers. Uniform radiance enters a convex box through each
    piece of its surface alike and cosine-distributed.
    """

    radiance: np.ndarray
    aimed: ClassVar[bool] = False

    def __post_init__(self):
        fill(self, radiance=vector(self.radiance, "The world's radiance"))

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W that enters the box: pi times radiance times surface."""
        return self.radiance * (2.0 * np.pi * bounds.face_areas.sum())

    def met(self, points: np.ndarray, directions: np.ndarray, triangle: np.ndarray, places: np.ndarray):
        """Its radiance (K, 3) along the rays that left the scene, and density (K,) zero: nobody aims at it."""
        return np.where(triangle[:, None] < 0, self.radiance, 0.0), np.zeros(len(points))

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Particles of equal flux on the box's surface; uniforms (P, 4): face and origin 2, direction 2."""
        face, first = choose(np.cumsum(np.tile(bounds.face_areas, 2)), uniforms[:, 0])
        axis, upper = face % 3, face >= 3
        origins = face_points(bounds, axis, upper, np.stack([first, uniforms[:, 1]], axis=1))
        inward = np.eye(3)[axis] * np.where(upper, -1.0, 1.0)[:, None]
        directions = cosine_hemisphere(inward, uniforms[:, 2:])
        return Particles(origins, directions, np.tile(self.flux(bounds) / len(uniforms), (len(uniforms), 1)))
