"""Sums over the crossings of each disc, of those that lie in the part of it that its point can see."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..compiled import kernels
from ..discs import TangentDiscs
from ..gatherers.gatherer import Crossings
from ..parallel import ordered_map, slices, worker_count
from ..segments import Segments
from .rings import OUTSIDE
from .visible_area import VisibleArea

#: Crossings from which on threads pay, and that NumPy works on in one array.
SHARED = 1 << 14


class CrossingSums:
    """Adds the flux of ``segments`` up over their crossings of ``discs``, by the K rings of the ``visible`` area.

    Attributes ``total`` (N, K, 3) W and ``squares`` (N, K, 3) W^2: the sums of the flux and of its square.
    """

    def __init__(self, discs: TangentDiscs, segments: Segments, visible: VisibleArea):
        self._discs, self._segments, self._visible = discs, segments, visible
        self._shape = visible.nested.shape
        sums = np.zeros((*self._shape, 6))
        self.total, self.squares = sums[:, :, 0:3], sums[:, :, 3:6]
        # When there were many segments to search they are loaded.
        self._kernels = kernels(saving=0.0)
        if self._kernels is not None:
            # One row per disc with all that a crossing needs, as compiled.look has it.
            self._rows = np.zeros((len(discs), 8))
            self._rows[:, 0:3], self._rows[:, 3:6] = discs.centres, discs.normals
            self._rows[:, 6], self._rows[:, 7] = discs.radii**2, visible.partial
            self._sums = sums

    def add(self, crossings: Crossings) -> np.ndarray:
        """Count these crossings in, each pair of which must come once; returns which (C,) were counted."""
        if self._kernels is not None:
            return self._added_compiled(crossings)
        look = partial(self._visible.rings, self._discs, self._segments)
        found = ordered_map(look, map(crossings.taken, slices(len(crossings), SHARED)))
        ring = np.concatenate([np.empty(0, np.uint8), *found])
        kept = ring != OUTSIDE
        inside, (discs, rings) = crossings.taken(kept), self._shape
        place = inside.disc * rings + ring[kept]
        for channel in range(3):
            flux = self._segments.flux[:, channel].take(inside.segment)
            self.total[:, :, channel] += np.bincount(place, flux, discs * rings).reshape(discs, rings)
            flux *= flux
            self.squares[:, :, channel] += np.bincount(place, flux, discs * rings).reshape(discs, rings)
        return kept

    def _added_compiled(self, crossings: Crossings) -> np.ndarray:
        arrays = self._segments.origins, self._segments.ends, self._segments.flux, self._visible.reach
        origins, ends, flux, reach = (np.require(rows, np.float64, ["C", "W"]) for rows in arrays)
        segment, disc, ring = crossings.segment, crossings.disc, np.zeros(len(crossings), np.uint8)
        parts = worker_count() if len(crossings) >= SHARED else 1

        def look(part: int) -> None:
            rows = slice(part * len(ring) // parts, (part + 1) * len(ring) // parts)
            self._kernels.look(segment[rows], disc[rows], origins, ends, self._rows, reach, ring[rows])

        def add(part: int) -> None:
            self._kernels.add_up(segment, disc, ring, flux, self._sums, part, parts)

        if self._shape[1] > 1:
            list(ordered_map(look, range(parts)))
        list(ordered_map(add, range(parts)))
        return ring != OUTSIDE
