"""Rows that each stand for a range of entries: laid out at full length, in blocks of bounded size."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np


def expanded(start: np.ndarray, count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For ranges ``start[r] : start[r] + count[r]``, the row r and the place of each entry, both (sum of count,)."""
    end = np.cumsum(count)
    row = np.repeat(np.arange(len(count)), count)
    place = np.arange(len(row))
    place += (start - end + count).take(row)
    return row, place


def expanded_blocks(start: np.ndarray, count: np.ndarray, limit: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield what :func:`expanded` returns in blocks of at most ``limit`` entries; long ranges are cut."""
    end = np.cumsum(count)
    total = int(end[-1]) if len(end) else 0
    for begin in range(0, total, limit):
        stop = min(begin + limit, total)
        first = int(np.searchsorted(end, begin, side="right"))
        last = int(np.searchsorted(end, stop, side="left")) + 1
        part_start, part_count = start[first:last].copy(), count[first:last].copy()
        part_count[-1] -= end[last - 1] - stop
        skipped = begin - (end[first] - count[first])
        part_start[0] += skipped
        part_count[0] -= skipped
        row, place = expanded(part_start, part_count)
        yield row + first, place


def blocks(count: np.ndarray, limit: int) -> Iterator[slice]:
    """Cut the rows into slices of at most ``limit`` entries by ``count``, but of at least one row."""
    end = np.cumsum(count)
    begin = 0
    while begin < len(count):
        done = end[begin - 1] if begin else 0
        stop = max(begin + 1, int(np.searchsorted(end, done + limit, side="right")))
        yield slice(begin, stop)
        begin = stop
