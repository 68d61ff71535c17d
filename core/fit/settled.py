"""Where a fit has settled: a fit of light that differs a little begins there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Settled:
    """A fit's solution for U values, and what it has found out about P seams and H bends on its way there.

    value   (U, 3) W/m^2
    placed  (K, 3) the values on the triangle of each place
    seams   (P, 2) values, and how much m^2 they are ``held`` (P,) together
    edges   (H, 2) values at the ends of bends' edges, and by what share ``bend`` (H,) light is likely to bend there
    """

    value: np.ndarray
    placed: np.ndarray
    seams: np.ndarray
    held: np.ndarray
    edges: np.ndarray
    bend: np.ndarray

    def among(self, placed, seams, edges, count: int, same: np.ndarray, changed: np.ndarray) -> Settled:
        """The same for ``count`` values, places, seams and edges of other faces, NaN where nothing is known.

        Places whose faces show values as here are the same ones; else those are that ``same`` (K,) gives, or -1. Where
        the light of places has ``changed`` (K,), it is unknown how values bend and differ.
        """
        if count == len(self.value) and np.array_equal(placed, self.placed):
            was = np.arange(count)
        else:
            was, rows = np.full(count, -1), np.flatnonzero(same >= 0)
            was[placed[rows]] = self.placed[same[rows]]
        value = np.append(self.value, np.full((1, 3), np.nan), axis=0)[was]
        fresh = np.zeros(count, bool)
        fresh[placed[changed]] = True
        held, bend = (
            self._looked_up(self.seams, self.held, was[seams]),
            self._looked_up(self.edges, self.bend, was[edges]),
        )
        held, bend = (np.where(fresh[ends].any(axis=1), np.nan, each) for ends, each in ((seams, held), (edges, bend)))
        return Settled(value, placed, seams, held, edges, bend)

    def _looked_up(self, pairs: np.ndarray, given: np.ndarray, wanted: np.ndarray) -> np.ndarray:
        """What is ``given`` (Q,) for ``pairs`` (Q, 2) of values at those ``wanted`` (W, 2), NaN where nothing is."""
        if np.array_equal(pairs, wanted) or len(pairs) == 0:
            return given if len(given) == len(wanted) else np.full(len(wanted), np.nan)
        keys, look = (np.sort(some, axis=1) @ (len(self.value) + 1, 1) for some in (pairs, wanted))
        order = np.argsort(keys, kind="stable")
        found = order[np.minimum(np.searchsorted(keys[order], look), len(keys) - 1)]
        return np.where((keys[found] == look) & (wanted >= 0).all(axis=1), given[found], np.nan)
