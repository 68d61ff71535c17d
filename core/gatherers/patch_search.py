"""What Disc Indexing and Sphere Cache have in common: discs in patches, and the way from there to the crossings."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..discs import TangentDiscs
from ..segments import Segments
from .counts import Counts
from .crossing_pairs import CrossingPairs, columns, path_rows
from .disc_bounds import frame_around
from .gatherer import Crossings
from .local_frame import Pieces
from .patches import DiscPatches, Stretches
from .streams import in_lanes, portions


class PatchSearch:
    """A gatherer whose :meth:`_stretches` tell where segments may cross which patches of discs.

    discs  the TangentDiscs to search
    order  (N,) their rows, as this search counts them
    chunk  most segments that are searched together
    """

    def __init__(self, discs: TangentDiscs, order: np.ndarray, chunk: int):
        self._order, self._chunk = order, chunk
        if len(discs):
            self._test = CrossingPairs(discs, order)
            self._frame = frame_around(discs)
            self._discs = discs.taken(order)

    def _patch(self, member: np.ndarray, start: np.ndarray) -> None:
        """Let patches begin at ``start`` (K,) in ``member`` (E,), rows of the discs in the search's order."""
        self._patches = DiscPatches.of(self._frame, self._discs, member.astype(np.int32), start)

    def crossings(self, segments: Segments, counts: Counts | None = None) -> Iterator[Crossings]:
        """Yield all crossings of ``segments``, each pair once, in chunks of bounded size."""
        if len(self._order) == 0:
            return iter(())
        return in_lanes(len(segments), self._chunk, lambda rows: portions(self._found(segments, rows, counts), 12))

    def _found(self, segments: Segments, rows: slice, counts: Counts | None) -> Iterator[Crossings]:
        if counts is not None:
            counts.note("segments", rows.stop - rows.start)
        paths, pieces = path_rows(segments, rows), self._frame.pieces(*columns(segments, rows))
        for stretches in self._stretches(pieces, counts):
            segment = pieces.segment.take(stretches.piece)
            for row, disc in self._patches.candidates(pieces, stretches, counts):
                of_pair = segment.take(row)
                found = self._test(paths, of_pair, disc, counts)
                if counts is not None:
                    counts.note("crossings", len(found))
                yield Crossings(rows.start + of_pair.take(found), self._order.take(disc.take(found)))

    def _stretches(self, pieces: Pieces, counts: Counts | None) -> Iterator[Stretches]:
        """Where along which of the ``pieces`` of segments which patch may be crossed, in blocks of bounded size.

        No pair of a piece and a disc comes twice.
        """
        raise NotImplementedError
