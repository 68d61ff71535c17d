"""All the surfaces that a ray meets one after another, as long as they let light pass straight (alpha, thin glass)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..rays import Hits, RayCaster
from ..sides import BySide, any_side

#: Surfaces that a ray or particle may pass straight through, all together, before it is given up.
MOST_PASSAGES = 1024

#: Rays are given up of whose light less than this share would come through.
LEAST_SHARE = 1e-6

#: So are those that so many passages in a row have brought no farther than rounding tells, each by less than so many
#: tolerances: they meet the same needle, or corner, again and again.
MOST_IDLE, IDLE = 8, 2.0


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
        nothing, and the share (R, 3) of the light from there that reaches the origins. Rays that rounding holds fast
        meet nothing more, as if what holds them were opaque.
        """
        rows, share = np.arange(len(origins)), np.ones((len(origins), 3))
        reach = np.broadcast_to(reach, len(origins))
        starts, along, endless = origins, directions, np.isinf(reach).all()
        last, idle = origins, np.zeros(len(origins), np.int64)
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
            places = hits.points.take(going, axis=0)
            onward = np.einsum("ij,ij->i", places - last.take(going, axis=0), along.take(going, axis=0))
            idle = np.where(onward < IDLE * self._caster.tolerance(places), idle.take(going) + 1, 0)
            left = np.flatnonzero((share > LEAST_SHARE).any(axis=1) & (idle < MOST_IDLE))
            if len(left) == 0:
                return
            going, share, idle, last = (
                going.take(left),
                share.take(left, axis=0),
                idle.take(left),
                places.take(left, axis=0),
            )
            rows, along = rows.take(going), along.take(going, axis=0)
            starts = self._past(last, triangle.take(going), along)

    def _past(self, places: np.ndarray, triangle: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """The ``places`` (R, 3) of hits, moved just behind the surface."""
        normals = self._caster.normals[triangle]
        side = np.copysign(1.0, np.einsum("ij,ij->i", normals, directions))
        return places + (self._caster.tolerance(places) * side)[:, None] * normals
