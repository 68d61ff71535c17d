"""Particles that cross one disc more than once: what that adds to the variance of the estimate."""

from __future__ import annotations

import numpy as np

from ..gatherers.gatherer import Crossings
from ..group_sums import group_sums
from ..segments import Segments

#: Crossings of a batch that are looked at: at least so many, and so many for each disc.
LEAST_PAIRS = 1 << 18
PAIRS_PER_DISC = 8


class RepeatedCrossings:
    """Collects the crossings of one batch of ``segments`` with ``discs`` discs, particle by particle.

    The sum over a particle's crossings of a disc, squared, is the sum of their squares and of the products of
    different ones. The crossings' squares alone make a particle that comes back count as two independent ones, which
    in a bright closed room with discs of a fifth of its size halves the variance.

    Memory is bounded: where there are too many crossings, only every second, fourth, eighth, ... particle is looked at.
    """

    def __init__(self, discs: int, segments: Segments):
        self._discs, self._segments = discs, segments
        self._most = max(LEAST_PAIRS, PAIRS_PER_DISC * discs)
        self._every = 1
        self._held: list[Crossings] = []
        self._count = 0

    def add(self, crossings: Crossings) -> None:
        """Look at these crossings too."""
        self._hold(crossings)
        while self._count > self._most:
            self._every *= 2
            held, self._held, self._count = self._held, [], 0
            for part in held:
                self._hold(part)

    def products(self) -> np.ndarray:
        """Sum over particles of f_i f_j over their pairs of different crossings of each disc, (N, 3) in W^2."""
        nothing = np.zeros((self._discs, 3))
        if not self._held:
            return nothing
        segment, disc = (np.concatenate([getattr(part, name) for part in self._held]) for name in ("segment", "disc"))
        key = (disc << 32) | self._segments.particle.take(segment)
        order = np.argsort(key)
        equal = np.diff(key.take(order)) == 0
        rows = np.flatnonzero(np.append(equal, False) | np.insert(equal, 0, False))
        if len(rows) == 0:
            return nothing
        order = order.take(rows)
        start = np.flatnonzero(np.diff(key.take(order), prepend=-1))
        flux = self._segments.flux.take(segment.take(order), axis=0)
        together = np.add.reduceat(flux, start, axis=0)
        products = together**2 - np.add.reduceat(flux**2, start, axis=0)
        return group_sums(products, disc.take(order.take(start)), self._discs) * self._every

    def _hold(self, crossings: Crossings) -> None:
        # Particles come sorted by the light they left, so that every k-th is a fair choice and the first are not.
        crossings = crossings.taken(self._segments.particle.take(crossings.segment) & (self._every - 1) == 0)
        self._held.append(crossings)
        self._count += len(crossings)
