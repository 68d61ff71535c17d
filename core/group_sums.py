"""Sums and means over rows that belong together."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np


def group_sums(values: np.ndarray, groups: np.ndarray, count: int, weights: np.ndarray | None = None) -> np.ndarray:
    """Sums (count, C) of the ``values`` (K, C) of each of the ``groups`` (K,), times ``weights`` (K,) if given."""
    return column_sums(values.T if weights is None else values.T * weights, groups, count)


def column_sums(columns: Iterable[np.ndarray], groups: np.ndarray, count: int) -> np.ndarray:
    """Sums (count, C) of C ``columns`` (K,) by the ``groups`` (K,)."""
    # Of no rows at all NumPy counts in whole numbers.
    return np.stack([np.bincount(groups, column, count) for column in columns], axis=1, dtype=float)


def group_means(
    values: np.ndarray, groups: np.ndarray, count: int, weights: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Means (count, C) of the ``values`` (K, C) of each of the ``groups`` (K,) by ``weights`` (K,), 1 by default.

    They are zero where the weights are; returned is also where (count,) they are not.
    """
    total = np.bincount(groups, weights, count)
    return group_sums(values, groups, count, weights) / np.where(total > 0, total, 1.0)[:, None], total > 0
