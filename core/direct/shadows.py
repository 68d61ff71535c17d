"""Shadows: what share of the light a straight way between two places lets through."""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType
from typing import NamedTuple

import numpy as np

from ..rays import FAR, Hits, RayCaster
from ..scene import Scene

#: Surfaces that a ray or particle may pass straight through, all together, before it is given up.
MOST_PASSAGES = 1024

#: A ray stops this many tolerances short of the light, which may be a surface of the scene itself.
STOP_SHORT = 4


class Met(NamedTuple):
    """What A rays met first: ``triangle`` (A,) int32, -1 for none, and barycentric ``u``, ``v`` (A,) float32."""

    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray


class Shadows:
    """Casts rays through the surfaces of ``scene`` as far as those let light pass straight (alpha, thin glass)."""

    def __init__(self, scene: Scene, caster: RayCaster):
        self._caster = caster
        # Most scenes let no light pass, and then pay nothing for it. A copy, since kernels take nothing read-only.
        self._transmittance = np.array(scene.transmittance) if scene.transmittance.any() else None

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
    def opaque(self) -> bool:
        """Whether no surface lets any light pass."""
        return self._transmittance is None

    @property
    def edged(self) -> np.ndarray:
        """A corner of each triangle and the two edges from it, (T, 9) m."""
        return self._caster.edged

    @property
    def frame(self) -> tuple[np.ndarray, float, float]:
        """The centre (3,) m and the scale of the scene as Embree sees it, and how short of the light rays end, m."""
        return self._caster.centre, self._caster.scale, STOP_SHORT * self._caster.tolerance

    def block(
        self, compiled: ModuleType, near: np.ndarray, towards: np.ndarray, reach: np.ndarray, arriving: np.ndarray
    ) -> np.ndarray:
        """Whether (R,) nothing comes through along rays as Embree has them; else ``arriving`` (R, 3) is dimmed.

        ``near`` (R, 3), ``towards`` (R, 3) and ``reach`` (R,) are float32, in the frame, R > 0.
        """
        if self._transmittance is None:
            return self._caster.blocked(near, towards, reach)
        blocked = np.ones(len(near), bool)
        for rows, met, share in self.walk(compiled, near, towards, reach):
            compiled.let_through(rows, met.triangle, share, blocked, arriving)
        return blocked

    def walk(self, compiled: ModuleType, near: np.ndarray, towards: np.ndarray, reach: np.ndarray):
        """As :meth:`surfaces`, by ``compiled`` kernels along R > 0 rays as for :meth:`block`.

        Yields rows (A,), what they Met, and the share (A, 3) of light.
        """
        caster, endless = self._caster, reach.min() >= FAR
        rows, share, starts, ways = np.arange(len(near)), np.ones((len(near), 3)), near, towards
        for _ in range(MOST_PASSAGES):
            met = Met(*caster.cast(starts, ways))
            if not endless:
                compiled.cut_beyond(
                    rows, met.triangle, met.u, met.v, caster.edged, near, reach, caster.centre, caster.scale
                )
            yield rows, met, share
            if self._transmittance is None:
                return
            behind = np.empty_like(rows), np.empty_like(share), np.empty_like(starts), np.empty_like(ways)
            going = compiled.passed(
                rows, met.triangle, met.u, met.v, caster.edged, caster.normals, self._transmittance, towards,
                caster.tolerance, caster.centre, caster.scale, share, *behind,
            )  # fmt: skip
            if going == 0:
                return
            rows, share, starts, ways = (part[:going] for part in behind)

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
