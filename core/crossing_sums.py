"""Sums over the crossings of each disc, of those that lie in the part of it that its point can see."""

from __future__ import annotations

import numpy as np

from .compiled import kernels
from .discs import TangentDiscs
from .gatherers.gatherer import Crossings
from .parallel import ordered_map, worker_count
from .segments import Segments
from .visible_area import VisibleArea

#: Crossings from which on threads pay.
SHARED = 1 << 14


class CrossingSums:
    """Adds the flux of ``segments`` up over their crossings of ``discs``, as far as these lie in the ``visible`` area.

    Attributes ``total`` (N, 3) W and ``squares`` (N, 3) W^2: the sums of the flux and of its square.
    """

    def __init__(self, discs: TangentDiscs, segments: Segments, visible: VisibleArea):
        self._discs, self._segments, self._visible = discs, segments, visible
        self.total, self.squares = np.zeros((2, len(discs), 3))
        # When there were many segments to search they are loaded.
        self._kernels = kernels(saving=0.0)

    def add(self, crossings: Crossings) -> Crossings:
        """Count these crossings in, each pair of which must come once; returns those that were counted."""
        if self._kernels is not None:
            return self._added_compiled(crossings)
        kept = self._visible.kept(self._discs, self._segments, crossings)
        count = len(self.total)
        for channel in range(3):
            flux = self._segments.flux[:, channel].take(kept.segment)
            self.total[:, channel] += np.bincount(kept.disc, flux, count)
            flux *= flux
            self.squares[:, channel] += np.bincount(kept.disc, flux, count)
        return kept

    def _added_compiled(self, crossings: Crossings) -> Crossings:
        lines = [_plain(getattr(self._segments, name)) for name in ("origins", "ends", "flux")]
        discs = [_plain(rows) for rows in (self._discs.centres, self._discs.normals, self._visible.reach)]
        kept = np.empty(len(crossings), bool)
        parts = worker_count() if len(crossings) >= SHARED else 1

        def add(part: int) -> None:
            self._kernels.add_up(
                crossings.segment, crossings.disc, *lines, *discs, self._visible.partial, part, parts,
                self.total, self.squares, kept,
            )  # fmt: skip

        list(ordered_map(add, range(parts)))
        return crossings if kept.all() else Crossings(crossings.segment[kept], crossings.disc[kept])


def _plain(rows: np.ndarray) -> np.ndarray:
    return np.require(rows, np.float64, ["C", "W"])
