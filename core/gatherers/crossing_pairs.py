"""The discs of a gatherer in its own order, laid out for the exact test of many pairs."""

from __future__ import annotations

import numpy as np

from ..crossing import crosses
from ..discs import TangentDiscs
from ..segments import Segments
from .counts import Counts

PAIRS = 1 << 13  # tested together, so that their rows stay in the processor's cache


class CrossingPairs:
    """Tells which pairs of a segment and a disc cross.

    discs  TangentDiscs
    order  (N,) the rows of ``discs`` as the gatherer counts them
    """

    def __init__(self, discs: TangentDiscs, order: np.ndarray):
        # One row of eight per disc, which is fetched at once; the last is padding. The discs' own numbers, not
        # normalised anew as by TangentDiscs.taken: every gatherer must test the same bits.
        self._discs = np.zeros((len(order), 8))
        for first, values in ((0, discs.centres), (3, discs.normals), (6, discs.radii[:, None])):
            self._discs[:, first : first + values.shape[1]] = values[order]

    def __call__(
        self, paths: np.ndarray, segment: np.ndarray, disc: np.ndarray, counts: Counts | None = None
    ) -> np.ndarray:
        """The pairs of ``segment`` (C,) in ``paths``, as from :func:`path_rows`, and ``disc`` (C,) that cross.

        Returns their rows (H,) int64 in 0..C, ascending.
        """
        rows = [np.zeros(0, np.int64)]
        for begin in range(0, len(segment), PAIRS):
            path = paths.take(segment[begin : begin + PAIRS], axis=0)
            held = self._discs.take(disc[begin : begin + PAIRS], axis=0)
            hit = crosses(path[:, :3], path[:, 3:], held[:, :3], held[:, 3:6], held[:, 6])
            rows.append(begin + hit.nonzero()[0])
        if counts is not None:
            counts.note("tests", len(segment))
        return np.concatenate(rows)


def columns(segments: Segments, rows: slice) -> tuple[np.ndarray, np.ndarray]:
    """Origins and ends of the given rows as (3, S) columns, in metres."""
    return segments.origins[rows].T.copy(), segments.ends[rows].T.copy()


def path_rows(segments: Segments, rows: slice) -> np.ndarray:
    """Origins and ends of the given rows side by side, (S, 6) in metres."""
    return np.concatenate([segments.origins[rows], segments.ends[rows]], axis=1)
