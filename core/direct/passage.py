"""All the surfaces that a ray meets one after another, as long as they let light pass straight (alpha, thin glass)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..rays import Hits, RayCaster
from ..sides import BySide, any_side

#: Surfaces that a ray or particle may pass straight through, all together, before it is given up.
MOST_PASSAGES = 1024


class SeeThrough:
    """The triangles of ``caster``, of which each lets ``transmittance`` of the light pass, None: nothing.

    That is (T, 3), or (2, T, 3) by the side that a ray meets (see :class:`.Scene`).
    """

    def __init__(self, caster: RayCaster, transmittance: np.ndarray | None):
        self._caster = caster
        self._transmittance = None
        if transmittance is not None:
            self._transmittance = BySide(transmittance, caster.normals)
            # The last row stands for no triangle.
            self._clear = np.append(any_side(transmittance), False)

    def met(
        self, origins: np.ndarray, directions: np.ndarray, reach: np.ndarray | float = np.inf
    ) -> Iterator[tuple[np.ndarray, Hits, np.ndarray]]:
        """Everything that rays meet one after another within ``reach`` (K,) m, until no light would come through.

        Yields, for the first surfaces, the second ones and so on: the rays' rows (R,), what they meet, which may be
        nothing, and the share (R, 3) of the light from there that reaches the origins.
        """
        rows, share = np.arange(len(origins)), np.ones((len(origins), 3))
        reach = np.broadcast_to(reach, len(origins))
        starts, along, endless = origins, directions, np.isinf(reach).all()
        for _ in range(MOST_PASSAGES):
            hits = self._caster.first_hits(starts, along)
            triangle = hits.triangle
            if not endless:
                beyond = np.linalg.norm(hits.points - origins[rows], axis=1) >= reach[rows]
                triangle = np.where(beyond, -1, triangle)
            yield rows, Hits(triangle, hits.points), share
            if self._transmittance is None:
                return
            going = np.flatnonzero(self._clear.take(triangle, mode="wrap"))
            passing = self._transmittance.met(triangle.take(going), along.take(going, axis=0))
            share = share.take(going, axis=0) * passing
            left = np.flatnonzero((share > 0).any(axis=1))
            going, share = going.take(left), share.take(left, axis=0)
            if len(going) == 0:
                return
            rows, along = rows.take(going), along.take(going, axis=0)
            starts = self._past(hits.points.take(going, axis=0), triangle.take(going), along)

    def _past(self, places: np.ndarray, triangle: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """The ``places`` (R, 3) of hits, moved just behind the surface."""
        normals = self._caster.normals[triangle]
        side = np.copysign(1.0, np.einsum("ij,ij->i", normals, directions))
        return places + (self._caster.tolerance(places) * side)[:, None] * normals
