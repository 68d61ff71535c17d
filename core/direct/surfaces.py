"""All the surfaces that a ray meets one after another, as long as they let light pass straight (alpha, thin glass)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..rays import Hits, RayCaster

#: Surfaces that a ray or particle may pass straight through, all together, before it is given up.
MOST_PASSAGES = 1024


class Surfaces:
    """The triangles of ``caster``, of which each lets ``transmittance`` (T, 3) of the light pass; None: nothing."""

    def __init__(self, caster: RayCaster, transmittance: np.ndarray | None):
        self._caster = caster
        self._transmittance = transmittance

    def met(
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
            starts = self._past(hits.points[going], triangle[going], directions[rows])

    def _past(self, places: np.ndarray, triangle: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """The ``places`` (R, 3) of hits, moved just behind the surface."""
        normals = self._caster.normals[triangle]
        side = np.copysign(1.0, np.einsum("ij,ij->i", normals, directions))
        return places + (self._caster.tolerance(places) * side)[:, None] * normals
