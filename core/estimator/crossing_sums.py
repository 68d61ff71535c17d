"""Sums over the crossings of each disc, of those that lie in the part of it that its point can see."""

from __future__ import annotations

import numpy as np

from ..compiled import kernels
from ..discs import TangentDiscs
from ..gatherers.gatherer import Crossings
from ..parallel import ordered_map, worker_count
from ..segments import Segments
from .visible_area import VisibleArea

#: Crossings from which on threads pay.
SHARED = 1 << 14


class CrossingSums:
    """Adds the flux of ``segments`` up over their crossings of ``discs``, as far as these lie in the ``visible`` area.

    Attributes ``total`` (N, 3) W and ``squares`` (N, 3) W^2: the sums of the flux and of its square.
    """

    def __init__(self, discs: TangentDiscs, segments: Segments, visible: VisibleArea):
        self._discs, self._segments, self._visible = discs, segments, visible
        # One row per disc with all that a crossing needs, as compiled.look has it.
        self._rows = np.zeros((len(discs), 16))
        self._rows[:, 0:3], self._rows[:, 3:6], self._rows[:, 6] = discs.centres, discs.normals, visible.partial
        self.total, self.squares = self._rows[:, 8:11], self._rows[:, 11:14]
        # When there were many segments to search they are loaded.
        self._kernels = kernels(saving=0.0)

    def add(self, crossings: Crossings) -> np.ndarray:
        """Count these crossings in, each pair of which must come once; returns which (C,) were counted."""
        if self._kernels is not None:
            return self._added_compiled(crossings)
        kept = self._visible.kept(self._discs, self._segments, crossings)
        inside, count = crossings.taken(kept), len(self.total)
        for channel in range(3):
            flux = self._segments.flux[:, channel].take(inside.segment)
            self.total[:, channel] += np.bincount(inside.disc, flux, count)
            flux *= flux
            self.squares[:, channel] += np.bincount(inside.disc, flux, count)
        return kept

    def _added_compiled(self, crossings: Crossings) -> np.ndarray:
        arrays = self._segments.origins, self._segments.ends, self._segments.flux, self._visible.reach
        origins, ends, flux, reach = (np.require(rows, np.float64, ["C", "W"]) for rows in arrays)
        segment, disc, kept = crossings.segment, crossings.disc, np.ones(len(crossings), bool)
        parts = worker_count() if len(crossings) >= SHARED else 1

        def look(part: int) -> None:
            rows = slice(part * len(kept) // parts, (part + 1) * len(kept) // parts)
            self._kernels.look(segment[rows], disc[rows], origins, ends, self._rows, reach, kept[rows])

        def add(part: int) -> None:
            self._kernels.add_up(segment, disc, kept, flux, self._rows, part, parts)

        if reach.size:
            list(ordered_map(look, range(parts)))
        list(ordered_map(add, range(parts)))
        return kept
