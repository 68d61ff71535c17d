"""Surroundings as arrays, for the compiled kernels: how rays are aimed at them, and what rays meet of them."""

from __future__ import annotations

import numpy as np

from ..lights.emissive import EmissiveTriangles
from ..lights.environment import EnvironmentWorld
from ..lights.light import Surroundings
from ..lights.world import UniformWorld
from .looks import Look
from .surfaces import Met


class PictureTable:
    """A world, whose radiance is ``picture`` (H, W, 3), chosen by ``sums`` (H * W,) and row ``ends`` (H,) of strength.

    Nobody aims where these are infinite.
    """

    def __init__(self, picture: np.ndarray, sums: np.ndarray, sines: np.ndarray):
        # A copy, since kernels take nothing that is read-only.
        self._picture, self._sums, self._sines = np.array(picture), sums, sines
        self._ends = np.ascontiguousarray(sums[picture.shape[1] - 1 :: picture.shape[1]])
        self._whole = max(float(sums[-1]), np.finfo(float).tiny)

    def aim(self, compiled, look: Look, uniforms: np.ndarray, chosen: tuple[np.ndarray, ...]) -> None:
        """Write what shadow_rays would return to ``chosen``."""
        compiled.aim_at_picture(self._picture, self._sums, self._ends, self._sines, uniforms, *chosen)

    def meet(self, compiled, look: Look, directions, rows, met: Met, radiance, density) -> None:
        """Write the ``radiance`` and ``density`` (A, ...) along the ``rows`` (A,) of directions, which ``met`` that."""
        compiled.picture_met(self._picture, self._whole, directions, rows, met.triangle, radiance, density)


class TriangleTable:
    """Shining triangles, of a scene whose triangles are ``edged`` (T, 9)."""

    def __init__(self, light: EmissiveTriangles, edged: np.ndarray):
        self._edged, self._shares = edged, light.shares
        # Copies, since kernels take nothing that is read-only.
        self._corners, self._seen = np.array(light.corners), (light.normals, light.areas, np.array(light.radiance))
        self._number = np.full(len(edged), -1)
        self._number[light.rows] = np.arange(len(light.rows))

    def aim(self, compiled, look: Look, uniforms: np.ndarray, chosen: tuple[np.ndarray, ...]) -> None:
        """Write what shadow_rays would return to ``chosen``."""
        whose = look.spots.points, look.spot, look.count
        compiled.aim_at_triangles(self._corners, *self._seen, self._shares, *whose, uniforms, *chosen)

    def meet(self, compiled, look: Look, directions, rows, met: Met, radiance, density) -> None:
        """Write the ``radiance`` and ``density`` (A, ...) along the ``rows`` (A,) of directions, which ``met`` that."""
        whose = look.spots.points, look.spot, look.count
        shining = self._number, *self._seen, self._shares[-1]
        compiled.triangles_met(*shining, *whose, directions, self._edged, rows, *met, radiance, density)


def table_of(light: Surroundings, edged: np.ndarray) -> PictureTable | TriangleTable | None:
    """The table of ``light`` in a scene of triangles ``edged`` (T, 9); None for another kind of light."""
    if type(light) is UniformWorld:
        return PictureTable(light.radiance.reshape(1, 1, 3), np.array([np.inf]), np.array([-1.0, 1.0]))
    if type(light) is EnvironmentWorld:
        return PictureTable(light.radiance, light.strength_sums, light.sines)
    if type(light) is EmissiveTriangles:
        return TriangleTable(light, edged)
    return None
