"""Numbers that stand for several others, mixed of all their bits: unlike ones hardly ever agree."""

from __future__ import annotations

import numpy as np

#: 2^64 over the golden ratio: products with it mix all bits before into the highest (Fibonacci hashing, Knuth 6.4).
ODD = np.uint64(0x9E3779B97F4A7C15)


def mixed_in(numbers: np.ndarray, more: np.ndarray) -> np.ndarray:
    """What stands for ``numbers`` (N,) and for ``more`` (N,) as well, all uint64."""
    numbers = (numbers ^ more) * ODD
    numbers ^= numbers >> np.uint64(32)
    return numbers


def mixed(rows: np.ndarray) -> np.ndarray:
    """A number (N,) uint64 of all bits of each of the ``rows`` (N, C), which have 64 bits a column."""
    numbers = np.zeros(len(rows), np.uint64)
    for column in rows.view(np.uint64).T:
        numbers = mixed_in(numbers, column)
    return numbers
