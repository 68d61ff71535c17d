"""Shadows: what share of the light a straight way between two places lets through."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..rays import FAR, Hits, RayCaster
from ..scene import Scene

#: Surfaces that a ray or particle may pass straight through, all together, before it is given up.
MOST_PASSAGES = 1024

#: A ray stops this many tolerances short of the light, which may be a surface of the scene itself.
STOP_SHORT = 4


class Shadows:
    """Casts rays through the surfaces of ``scene`` as far as those let light pass straight (alpha, thin glass)."""

    def __init__(self, scene: Scene, caster: RayCaster):
        self._caster = caster
        # Most scenes let no light pass, and then pay nothing for it.
        self._transmittance = scene.transmittance if scene.transmittance.any() else None

    def transmitted(self, origins: np.ndarray, directions: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """Share of the light, RGB 0..1, that comes through: (K, 3), or (K, 1) when no surface lets any pass.

        From ``origins`` (K, 3), clear of surfaces by the caster's tolerance, along unit ``directions`` (K, 3) over
        ``distances`` (K,) metres, which may be inf.
        """
        reach = distances - STOP_SHORT * self._caster.tolerance
        if self._transmittance is None:
            return ~self._caster.occluded(origins, directions, reach)[:, None]
        share = np.zeros((len(origins), 3))
        for rows, hits, through in self.surfaces(origins, directions, reach):
            arrived = hits.triangle < 0
            share[rows[arrived]] = through[arrived]
        return share

    @property
    def frame(self) -> tuple[np.ndarray, float, float]:
        """The centre (3,) m and the scale of the scene as Embree sees it, and how short of the light rays end, m."""
        return self._caster.centre, self._caster.scale, STOP_SHORT * self._caster.tolerance

    def block(self, near: np.ndarray, towards: np.ndarray, reach: np.ndarray, arriving: np.ndarray) -> np.ndarray:
        """Whether (R,) nothing comes through along rays as Embree has them; else ``arriving`` (R, 3) is dimmed.

        ``near`` (R, 3), ``towards`` (R, 3) and ``reach`` (R,) are float32, in the frame, R > 0.
        """
        if self._transmittance is None:
            return self._caster.blocked(near, towards, reach)
        caster = self._caster
        origins, ways = near / caster.scale + caster.centre, towards.astype(np.float64)
        far = np.where(reach >= FAR, np.inf, reach / np.float64(caster.scale) + STOP_SHORT * caster.tolerance)
        arriving *= self.transmitted(origins, ways, far)
        return np.zeros(len(near), bool)

    def surfaces(
        self, origins: np.ndarray, directions: np.ndarray, reach: np.ndarray | float = np.inf
    ) -> Iterator[tuple[np.ndarray, Hits, np.ndarray]]:
        """Everything that rays meet one after another within ``reach`` (K,) m, until no light would come through.

        Yields, for the first surfaces, the second ones and so on: the rays' rows (R,), what they meet, which may be
        nothing, and the share (R, 3) of the light from there that reaches the origins.
        """
        rows, share = np.arange(len(origins)), np.ones((len(origins), 3))
        reach = np.broadcast_to(reach, len(origins))
        starts, endless = origins, np.isinf(reach).all()
        for _ in range(MOST_PASSAGES):
            hits = self._caster.first_hits(starts, directions[rows])
            triangle = hits.triangle
            if not endless:
                beyond = np.linalg.norm(hits.points - origins[rows], axis=1) >= reach[rows]
                triangle = np.where(beyond, -1, triangle)
            yield rows, Hits(triangle, hits.points), share
            if self._transmittance is None:
                return
            share = share * self._transmittance[triangle]
            going = np.flatnonzero((triangle >= 0) & (share > 0).any(axis=1))
            if len(going) == 0:
                return
            rows, share = rows[going], share[going]
            starts = hits.points[going] + self._past(triangle[going], directions[rows])

    def _past(self, triangle: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """What leads (R, 3) from a hit to just behind the surface."""
        normals = self._caster.normals[triangle]
        side = np.copysign(1.0, np.einsum("ij,ij->i", normals, directions))
        return (self._caster.tolerance * side)[:, None] * normals
