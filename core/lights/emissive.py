"""Emissive triangles: surfaces of the scene that shine."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..bounds import Bounds
from ..checks import float_rows
from ..errors import InvalidArrayError
from ..sampling import choose, cosine_hemisphere, triangle
from ..triangles import normals_and_areas
from .light import Particles


@dataclass(frozen=True)
class EmissiveTriangles:
    """Lambertian emitters on both sides of each triangle, together one light.

    corners   (T, 3 corners, 3) metres; a triangle without area gives nothing
    radiance  (T, 3) W/(m^2 sr), RGB; negative takes light away

    Raises InvalidArrayError on other shapes, no triangle or non-finite values.
    """

    corners: np.ndarray
    radiance: np.ndarray
    _normals: np.ndarray = field(init=False, repr=False)
    _areas: np.ndarray = field(init=False, repr=False)
    _shares: np.ndarray = field(init=False, repr=False)

    def __post_init__(self):
        shape = np.shape(self.corners)
        if shape[1:] != (3, 3) or shape[0] == 0:
            raise InvalidArrayError(f"Emissive corners must have the shape (n, 3, 3) with n > 0, not {shape}.")
        corners = float_rows(np.reshape(self.corners, (-1, 3)), "emissive corners").reshape(-1, 3, 3)
        radiance = float_rows(self.radiance, "emitted radiance", 3, len(corners))
        normals, areas = normals_and_areas(corners)
        shares = np.cumsum(np.abs(radiance).max(axis=1, initial=0.0) * areas)
        for name, value in (
            ("corners", corners),
            ("radiance", radiance),
            ("_normals", normals),
            ("_areas", areas),
            ("_shares", shares),
        ):
            object.__setattr__(self, name, value)

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W of both sides: 2 pi times the sum of radiance times area."""
        return 2.0 * np.pi * (self._areas @ self.radiance)

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Particles of equal flux in their strongest channel; uniforms (P, 4): triangle and origin 2, direction 2.

        The origins lie on the triangles themselves, to rounding.
        """
        chosen, first = choose(self._shares, uniforms[:, 0])
        weights = triangle(np.stack([first, uniforms[:, 1]], axis=1))
        origins = np.einsum("pc,pcx->px", weights, self.corners[chosen])
        back = uniforms[:, 2] >= 0.5
        about = np.stack([2.0 * uniforms[:, 2] - back, uniforms[:, 3]], axis=1)
        directions = cosine_hemisphere(np.where(back[:, None], -1.0, 1.0) * self._normals[chosen], about)
        radiance = self.radiance[chosen]
        strength = np.abs(radiance).max(axis=1, keepdims=True)
        colour = np.divide(radiance, strength, out=np.zeros_like(radiance), where=strength > 0.0)
        return Particles(origins, directions, colour * (2.0 * np.pi * self._shares[-1] / len(uniforms)))
