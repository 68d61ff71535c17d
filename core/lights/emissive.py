"""Emissive triangles: surfaces of the scene that shine."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from ..bounds import Bounds
from ..checks import fill, float_rows, index_rows
from ..errors import InvalidArrayError
from ..sampling import choose, cosine_hemisphere, triangle
from ..sides import BySide, sided_rows
from ..triangles import normals_and_areas
from .lamp_rays import CLOSEST, towards
from .light import Particles, ShadowRays

#: Below this cosine a triangle is seen edge-on and gives nothing: what is left of it is rounding.
_EDGE_ON = 1e-9


@dataclass(frozen=True, eq=False)
class EmissiveTriangles:
    """Lambertian emitters on the sides of triangles, together one light.

    corners   (T, 3 corners, 3) metres; a triangle without area gives nothing
    radiance  (T, 3) W/(m^2 sr), RGB, of both sides, or (2, T, 3) of fronts and backs; negative takes light away
    rows      (T,) which of the scene's triangles they are, ascending; without it the first T

    Attributes ``normals`` (T, 3) and ``areas`` (T,) m^2 of the triangles, and ``shares`` (T,), the running sum of their
    strongest channels, on average of both sides, times their areas.

    Raises InvalidArrayError on other shapes, no triangle, non-finite values, or rows that do not ascend.
    """

    corners: np.ndarray
    radiance: np.ndarray
    rows: np.ndarray | None = None
    sharp: ClassVar[bool] = False
    aimed: ClassVar[bool] = True
    distant: ClassVar[bool] = False
    normals: np.ndarray = field(init=False, repr=False)
    areas: np.ndarray = field(init=False, repr=False)
    shares: np.ndarray = field(init=False, repr=False)
    _strength: np.ndarray = field(init=False, repr=False)
    _front: np.ndarray = field(init=False, repr=False)
    _seen_on: BySide = field(init=False, repr=False)

    def __post_init__(self):
        shape = np.shape(self.corners)
        if shape[1:] != (3, 3) or shape[0] == 0:
            raise InvalidArrayError(f"Emissive corners must have the shape (n, 3, 3) with n > 0, not {shape}.")
        corners = float_rows(np.reshape(self.corners, (-1, 3)), "emissive corners").reshape(-1, 3, 3)
        radiance = sided_rows(self.radiance, "emitted radiance", len(corners))
        rows = np.arange(len(corners)) if self.rows is None else self.rows
        rows = index_rows(rows, "rows of emissive triangles", None, np.iinfo(np.int64).max, len(corners))
        if (np.diff(rows) <= 0).any():
            raise InvalidArrayError("The rows of emissive triangles must ascend.")
        normals, areas = normals_and_areas(corners)
        sides = np.abs(radiance).max(axis=-1, initial=0.0).reshape(-1, len(corners))
        strength = sides.mean(axis=0)
        fill(self, corners=corners, radiance=radiance, rows=rows, normals=normals, areas=areas, _strength=strength)
        front = np.divide(sides[0], 2.0 * strength, out=np.full(len(corners), 0.5), where=strength > 0.0)
        fill(self, shares=np.cumsum(strength * areas), _front=front, _seen_on=BySide(radiance, normals))

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W of both sides: pi times the sum of radiance times area of each."""
        sides = np.broadcast_to(self.radiance, (2, *self.radiance.shape[-2:]))
        return np.pi * (self.areas @ sides.sum(axis=0))

    def shadow_rays(self, points: np.ndarray, uniforms: np.ndarray) -> ShadowRays:
        """To a place uniform on a triangle, chosen in proportion to its strongest channel times its area."""
        chosen, first = choose(self.shares, uniforms[:, 0])
        return self.rays_to(chosen, points, np.stack([first, uniforms[:, 1]], axis=1))

    def rays_to(self, chosen: np.ndarray, points: np.ndarray, uniforms: np.ndarray) -> ShadowRays:
        """To places uniform on the ``chosen`` (K,) of the triangles, with the density of :meth:`shadow_rays`."""
        places = self._places(chosen, uniforms)
        directions, distances = towards(places - points)
        radiance, density = self._seen(chosen, directions, distances)
        return ShadowRays(directions, distances, radiance, density)

    @cached_property
    def chances(self) -> np.ndarray:
        """Probability (T,) with which :meth:`shadow_rays` chooses each triangle; zero where all are dark."""
        return np.diff(self.shares, prepend=0.0) / max(self.shares[-1], np.finfo(float).tiny)

    def number(self, triangle: np.ndarray) -> np.ndarray:
        """Which of these each of the scene's ``triangle`` (K,), -1 for none, is; -1 where it is none of them."""
        return self._numbers.take(triangle + 1, mode="clip")

    @cached_property
    def _numbers(self) -> np.ndarray:
        """Which of these the scene's triangle of one row less is, up to the first behind all of them; -1 for none."""
        numbers = np.full(self.rows[-1] + 3, -1)
        numbers[self.rows + 1] = np.arange(len(self.rows))
        return numbers

    def among(self, triangle: np.ndarray) -> np.ndarray:
        """Whether each of the scene's ``triangle`` (K,), -1 for none, is one of these."""
        return self.number(triangle) >= 0

    def met(self, points: np.ndarray, directions: np.ndarray, triangle: np.ndarray, places: np.ndarray):
        """Radiance (K, 3) of the triangles that the rays met, and the density (K,) of being aimed at there."""
        found = self.number(triangle)
        mine, way = found >= 0, places - points
        way[~mine] = 0.0
        radiance, density = self._seen(found, directions, np.sqrt(np.einsum("ij,ij->i", way, way)))
        radiance[~mine], density[~mine] = 0.0, 0.0
        return radiance, density

    def _seen(self, chosen, directions, distances) -> tuple[np.ndarray, np.ndarray]:
        """Radiance and density per steradian: that per area, strength / total, times r^2 / cos; 0 and 1 if edge-on."""
        cosine = np.abs(np.einsum("pi,pi->p", self.normals.take(chosen, axis=0, mode="wrap"), directions))
        radiance = self._seen_on.met(chosen, directions)
        strength, areas = self._strength.take(chosen, mode="wrap"), self.areas.take(chosen, mode="wrap")
        lit = (cosine > _EDGE_ON) & (distances > CLOSEST) & (strength > 0.0) & (areas > 0.0)
        density = np.ones(len(cosine))
        np.divide(strength * distances**2, cosine * self.shares[-1], out=density, where=lit)
        radiance[~lit] = 0.0
        return radiance, density

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Particles of equal flux in their strongest channel; uniforms (P, 4): triangle and origin 2, direction 2.

        The origins lie on the triangles themselves, to rounding.
        """
        flux = 2.0 * np.pi * self.shares[-1] / len(uniforms)
        chosen, first = choose(self.shares, uniforms[:, 0])
        origins = self._places(chosen, np.stack([first, uniforms[:, 1]], axis=1))
        share = self._front.take(chosen)
        behind = uniforms[:, 2] >= share
        along = np.where(behind, uniforms[:, 2] - share, uniforms[:, 2]) / np.where(behind, 1.0 - share, share)
        normals = np.where(behind, -1.0, 1.0)[:, None] * self.normals.take(chosen, axis=0)
        # What leaves a side is met against its way.
        radiance = self._seen_on.met(chosen, -normals)
        strength = np.abs(radiance).max(axis=1)
        colours = radiance / np.where(strength > 0.0, strength, 1.0)[:, None]
        directions = cosine_hemisphere(normals, np.stack([along, uniforms[:, 3]], axis=1))
        return Particles(origins, directions, flux * colours)

    def _places(self, chosen: np.ndarray, uniforms: np.ndarray) -> np.ndarray:
        """Places (K, 3) uniform on the ``chosen`` (K,) triangles."""
        return np.einsum("pc,pcx->px", triangle(uniforms), self.corners.take(chosen, axis=0))
