"""The equations of a least squares fit over triangles, and their solution by conjugate gradients."""

from __future__ import annotations

import numpy as np

#: The smallest number that float32 holds with all its digits.
_LEAST = np.finfo(np.float32).tiny


class Neighbours:
    """Which of U values stand together in equations, given as ``pairs`` (Q, 2) of them, any of which may recur."""

    def __init__(self, pairs: np.ndarray, count: int):
        self.count = count
        self._same = pairs[:, 0] == pairs[:, 1]
        self._first = pairs[:, 0]
        low, high = pairs.min(axis=1), pairs.max(axis=1)
        keys, self._edge = np.unique(low * count + high, return_inverse=True)
        ends = np.stack([keys // count, keys % count]) if count else np.zeros((2, 0), np.int64)
        ends = np.concatenate([ends, ends[::-1]], axis=1)
        order = np.argsort(ends[0], kind="stable")
        self.edges, self._edge_of = len(keys), order % max(len(keys), 1)
        self._others = ends[1][order]
        self._starts = np.flatnonzero(np.diff(ends[0][order], prepend=-1))
        self._rows = ends[0][order][self._starts]

    def matrix(self, own: np.ndarray, between: np.ndarray) -> Matrix:
        """The symmetric matrix with ``own`` (U,) on its diagonal and ``between`` (Q,) at the pairs, added up."""
        own = own + np.bincount(self._first, np.where(self._same, 2.0 * between, 0.0), self.count)
        edges = np.bincount(self._edge, np.where(self._same, 0.0, between), self.edges)
        return Matrix(self, own, edges[self._edge_of])

    def sums(self, factors: np.ndarray, values: np.ndarray) -> np.ndarray:
        """For each value the sum (d, U) of its neighbours' ``values`` (d, U) times these ``factors``."""
        total = np.zeros_like(values)
        if len(self._rows):
            for sums, each in zip(total, values, strict=True):
                sums[self._rows] = np.add.reduceat(factors * each.take(self._others, mode="wrap"), self._starts)
        return total


class Matrix:
    """A symmetric matrix with ``own`` (U,) on its diagonal and ``factors`` at its ``neighbours``."""

    def __init__(self, neighbours: Neighbours, own: np.ndarray, factors: np.ndarray):
        self._neighbours = neighbours
        # float32 is exact enough for colours, and twice as fast.
        self._scale = max(float(own.max(initial=0.0)), 1e-300)
        self._own, self._factors = ((part / self._scale).astype(np.float32) for part in (own, factors))

    def solved(self, right: np.ndarray, start: np.ndarray, steps: int, free: np.ndarray | None = None) -> np.ndarray:
        """The values (U, d) for that ``right`` side (U, d), so many ``steps`` of conjugate gradients from ``start``, at
        which those stay that are not ``free`` (U,)."""
        # Of what is smaller the inverse is more than float32 holds: those values stay as they start.
        moves = self._own >= _LEAST if free is None else free & (self._own >= _LEAST)
        inverse = np.divide(1.0, self._own, out=np.zeros_like(self._own), where=moves)
        unit = max(float(np.abs(right).max(initial=0.0)) / self._scale, float(np.abs(start).max(initial=0.0)), 1e-300)
        values = np.ascontiguousarray((start / unit).T, np.float32)
        # One after the other: of small light the product would be zero.
        residual = np.ascontiguousarray((right / self._scale / unit).T, np.float32) - self._applied(values)
        step = inverse * residual
        size = _products(residual, step)
        for _ in range(steps):
            turned = self._applied(step)
            along = _products(step, turned)
            share = np.divide(size, along, out=np.zeros_like(size), where=along > 0)
            values += share * step
            residual -= share * turned
            better = inverse * residual
            before, size = size, _products(residual, better)
            step = better + np.divide(size, before, out=np.zeros_like(size), where=before > 0) * step
        return unit * values.T.astype(np.float64, order="C")

    def _applied(self, values: np.ndarray) -> np.ndarray:
        return self._own * values + self._neighbours.sums(self._factors, values)


def _products(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Products (d, 1) of rows (d, U)."""
    return np.einsum("xu,xu->x", one, other)[:, None]
