"""The shape of a balanced tree over points: ranges of rows, halved until few enough are left."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..ranges import expanded

Halves = Callable[[np.ndarray], np.ndarray]

BRANCHES = 4  # children of an inner node: two halvings at a time


@dataclass(frozen=True)
class BalancedTree:
    """Nodes level by level; the children of an inner node stand side by side.

    order   (N,)   int64, the points' rows in the tree's order
    start   (K,)   int64, node k holds order[start[k] : start[k] + count[k]]
    count   (K,)   int64
    child   (K,)   int64, the first of BRANCHES children, -1 for a leaf
    levels  (L+1,) int64, level l has the nodes levels[l] : levels[l + 1]
    """

    order: np.ndarray
    start: np.ndarray
    count: np.ndarray
    child: np.ndarray
    levels: np.ndarray

    @classmethod
    def over(cls, points: np.ndarray, kind: np.ndarray, leaf: int, halves: Halves | None = None) -> BalancedTree:
        """Halve ``points`` (N, 3) down to at most ``leaf`` >= 4 per node, with one root for each value of ``kind``.

        Each half gets as many points, to one, across the longest side of what is halved; ``halves`` may cut
        elsewhere: it gives the size of the first half of counts >= 2.
        """
        order = np.argsort(kind, kind="stable")
        start = np.flatnonzero(np.diff(kind[order], prepend=-1))
        count = np.diff(start, append=len(order))
        starts, counts, children, levels = [start], [count], [], [0, len(start)]
        while True:
            inner = np.flatnonzero(count > leaf)
            child = np.full(len(count), -1)
            child[inner] = levels[-1] + BRANCHES * np.arange(len(inner))
            children.append(child)
            if len(inner) == 0:
                return cls(order, *map(np.concatenate, (starts, counts, children)), np.array(levels))
            start, count = _halved(points, order, start[inner], count[inner], halves)
            start, count = _halved(points, order, start, count, halves)
            starts.append(start)
            counts.append(count)
            levels.append(levels[-1] + len(start))

    def bounds(self, values: np.ndarray, extreme: np.ufunc) -> np.ndarray:
        """np.minimum or np.maximum of ``values`` (N, C), one row per point, over each node: (K, C)."""
        result = np.empty((len(self.start), values.shape[1]), values.dtype)
        leaves = self.leaves
        result[leaves] = extreme.reduceat(values[self.order], self.start[leaves], axis=0)
        for first, last in reversed(list(pairwise(self.levels))):
            inner = first + np.flatnonzero(self.child[first:last] >= 0)
            result[inner] = extreme.reduce(result[self.child[inner, None] + np.arange(BRANCHES)], axis=1)
        return result

    @property
    def leaves(self) -> np.ndarray:
        """The nodes without children, in the order of their points."""
        leaves = np.flatnonzero(self.child < 0)
        return leaves[np.argsort(self.start[leaves])]


def _halved(points, order, start, count, halves) -> tuple[np.ndarray, np.ndarray]:
    """Sort each range of ``order``, in place, along its points' longest side, and return the ranges' halves."""
    owner, place = expanded(start, count)
    rows = order[place]
    begin = np.cumsum(count) - count
    held = points[rows]
    side = np.maximum.reduceat(held, begin, axis=0) - np.minimum.reduceat(held, begin, axis=0)
    along = np.take_along_axis(held, side.argmax(axis=1)[owner, None], axis=1)[:, 0]
    order[place] = rows[np.lexsort((along, owner))]
    # Two at least where there are four, so that each half can be halved again.
    least = np.minimum(2, count // 2)
    half = count // 2 if halves is None else np.clip(halves(count), least, count - least)
    return np.stack([start, start + half], 1).ravel(), np.stack([half, count - half], 1).ravel()
