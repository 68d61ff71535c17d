"""Brute force: every segment against every disc, the referee of the other gatherers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..crossing import crosses
from ..discs import TangentDiscs
from ..segments import Segments
from .gatherer import Counts, Crossings, in_lanes, portions

SEGMENTS = 64  # tested together with
DISCS = 4096


class BruteForce:
    """Tests all pairs.

    discs  the TangentDiscs to search
    """

    name = "brute-force"

    def __init__(self, discs: TangentDiscs):
        # Views of columns, see crosses().
        self._centres, self._normals = np.ascontiguousarray(discs.centres.T).T, np.ascontiguousarray(discs.normals.T).T
        self._radii = discs.radii

    def crossings(self, segments: Segments, counts: Counts | None = None) -> Iterator[Crossings]:
        """Yield all crossings of ``segments``, each pair once, in chunks of bounded size."""
        if counts is not None:
            counts.note("segments", len(segments))
            counts.note("tests", len(segments) * len(self._radii))
        return in_lanes(len(segments), SEGMENTS * 64, lambda rows: portions(self._found(segments, rows), 8))

    def _found(self, segments: Segments, rows: slice) -> Iterator[Crossings]:
        for begin in range(rows.start, rows.stop, SEGMENTS):
            some = slice(begin, min(begin + SEGMENTS, rows.stop))
            origins, ends = segments.origins[some, None], segments.ends[some, None]
            for first in range(0, len(self._radii), DISCS):
                discs = slice(first, first + DISCS)
                hit = crosses(origins, ends, self._centres[discs], self._normals[discs], self._radii[discs])
                segment, disc = np.nonzero(hit)
                yield Crossings(begin + segment, first + disc)
