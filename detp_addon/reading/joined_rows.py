"""Arrays of many small things put one after the other, so that one call of NumPy does for all of them; NumPy only."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...core.ranges import blocks

#: rows of all things that are worked on at once, beyond one thing: what this takes of memory is small beside the rest
_ROWS = 1 << 18


def starts_of(counts: Sequence[int]) -> np.ndarray:
    """Where (K + 1,) each of K things with so many rows begins among all rows, and where the last one ends."""
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])


def numbered(parts: Sequence[np.ndarray], starts: np.ndarray) -> np.ndarray:
    """All ``parts``, K arrays of row numbers, each of which counts from its own of the ``starts`` (K or more,) on."""
    whole = np.concatenate(parts)
    shifts = np.repeat(starts[: len(parts)], [len(part) for part in parts])
    return whole + shifts.reshape(-1, *(1,) * (whole.ndim - 1))


def any_of(flags: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """For which things (K,) any of the ``flags`` of its rows is set."""
    return np.diff(np.concatenate([[0], np.cumsum(flags)])[starts]) > 0


def batches(counts: Sequence[int]) -> Iterator[slice]:
    """Slices of consecutive things with ``counts`` (K) rows each, about _ROWS together or one thing alone."""
    return blocks(np.asarray(counts, np.int64), _ROWS)
