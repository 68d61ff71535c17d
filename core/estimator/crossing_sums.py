"""Sums over the crossings of each disc, of those that lie in the part of it that its point can see."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..discs import TangentDiscs
from ..gatherers.gatherer import Crossings
from ..parallel import ordered_map, slices
from ..segments import Segments
from .rings import OUTSIDE
from .visible_area import VisibleArea

#: Crossings that are looked at in one array, side by side with others.
SHARED = 1 << 14


class CrossingSums:
    """Adds the flux of ``segments`` up over their crossings of ``discs``, by the K rings of the ``visible`` area.

    Attributes ``total`` (N, K, 3) W and ``squares`` (N, K, 3) W^2: the sums of the flux and of its square.
    """

    def __init__(self, discs: TangentDiscs, segments: Segments, visible: VisibleArea):
        self._discs, self._segments, self._visible = discs, segments, visible
        self._shape = visible.nested.shape
        self.total, self.squares = np.zeros((2, *self._shape, 3))

    def add(self, crossings: Crossings) -> np.ndarray:
        """Count these crossings in, each pair of which must come once; returns which (C,) were counted."""
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
