"""Sums over the crossings of each disc, of those that lie in the part of it that its point can see."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..discs import TangentDiscs
from ..gatherers.gatherer import Crossings
from ..parallel import ordered_map, slices
from ..segments import Segments
from .visible_area import VisibleArea

#: Crossings that are looked at in one array, side by side with others.
SHARED = 1 << 14


class CrossingSums:
    """Adds the flux of ``segments`` up over their crossings of ``discs`` in the ``visible`` area.

    Attributes ``total`` (N, 3) W and ``squares`` (N, 3) W^2: the sums of the flux and of its square.
    """

    def __init__(self, discs: TangentDiscs, segments: Segments, visible: VisibleArea):
        self._discs, self._segments, self._visible = discs, segments, visible
        self.total, self.squares = np.zeros((2, len(discs), 3))

    def add(self, crossings: Crossings) -> np.ndarray:
        """Count these crossings in, each pair of which must come once; returns which (C,) were counted."""
        look = partial(self._visible.inside, self._discs, self._segments)
        found = ordered_map(look, map(crossings.taken, slices(len(crossings), SHARED)))
        kept = np.concatenate([np.empty(0, bool), *found])
        inside, discs = crossings.taken(kept), len(self.total)
        for channel in range(3):
            flux = self._segments.flux[:, channel].take(inside.segment)
            self.total[:, channel] += np.bincount(inside.disc, flux, discs)
            flux *= flux
            self.squares[:, channel] += np.bincount(inside.disc, flux, discs)
        return kept
