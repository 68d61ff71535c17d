"""The discs of a gatherer in its own order, laid out for the exact test of many pairs."""

from __future__ import annotations

import numpy as np

from ..crossing import crossing_times
from ..discs import TangentDiscs
from ..segments import Segments


class ExactTest:
    """Tells which pairs of a segment and a disc cross.

    discs  TangentDiscs
    order  (N,) the rows of ``discs`` as the gatherer counts them
    """

    def __init__(self, discs: TangentDiscs, order: np.ndarray):
        # Columns, because a column is gathered and computed with faster than rows of three. The discs' own
        # numbers, not normalised anew as by TangentDiscs.taken: every gatherer must test the same bits.
        self._centres, self._normals = (rows[order].T.copy() for rows in (discs.centres, discs.normals))
        self._radii = discs.radii[order]

    def __call__(self, origins, ends, segment, disc) -> tuple[np.ndarray, np.ndarray]:
        """Whether, and at which t, ``segment`` (C,) of origins and ends (3, S) crosses ``disc`` (C,)."""
        return crossing_times(
            origins.take(segment, axis=1).T,
            ends.take(segment, axis=1).T,
            self._centres.take(disc, axis=1).T,
            self._normals.take(disc, axis=1).T,
            self._radii.take(disc),
        )


def columns(segments: Segments, rows: slice) -> tuple[np.ndarray, np.ndarray]:
    """Origins and ends of the given rows as (3, S) columns."""
    return segments.origins[rows].T.copy(), segments.ends[rows].T.copy()
