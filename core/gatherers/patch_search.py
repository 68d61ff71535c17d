"""What Disc Indexing and Sphere Cache have in common: discs in patches, and the way from there to the crossings."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator

import numpy as np

from ..crossing import crosses
from ..discs import TangentDiscs
from ..segments import Segments
from .gatherer import Counts, Crossings, in_lanes, portions
from .local_frame import LocalFrame, Pieces
from .patches import DiscPatches, Stretches

PAIRS = 1 << 13  # tested together, so that their rows stay in the processor's cache


class PatchSearch(ABC):
    """A gatherer whose :meth:`_stretches` tell where segments may cross which patches of discs.

    discs  the TangentDiscs to search, in the order of this search
    order  (N,) their rows, as they were given
    chunk  most segments that are searched together
    """

    def __init__(self, discs: TangentDiscs, order: np.ndarray, chunk: int):
        self._order, self._chunk = order, chunk
        if len(discs):
            self._frame = LocalFrame.around(discs)
            # One row of eight for each disc, which is fetched at once; the last is padding.
            padding = np.zeros(len(discs))
            self._rows = np.column_stack([discs.centres, discs.normals, discs.radii, padding])

    def _patch(self, discs: TangentDiscs, member: np.ndarray, start: np.ndarray) -> None:
        """Let patches begin at ``start`` (K,) in ``member`` (E,), rows of the ``discs``, which are as above."""
        self._patches = DiscPatches.of(self._frame, discs, member.astype(np.int32), start)

    def crossings(self, segments: Segments, counts: Counts | None = None) -> Iterator[Crossings]:
        """Yield all crossings of ``segments``, each pair once, in chunks of bounded size."""
        if len(self._order) == 0:
            return iter(())
        return in_lanes(len(segments), self._chunk, lambda rows: portions(self._found(segments, rows, counts), 12))

    def _found(self, segments: Segments, rows: slice, counts: Counts | None) -> Iterator[Crossings]:
        if counts is not None:
            counts.note("segments", rows.stop - rows.start)
        origins, ends = segments.origins[rows], segments.ends[rows]
        paths, pieces = np.concatenate([origins, ends], axis=1), self._frame.pieces(origins.T.copy(), ends.T.copy())
        for stretches in self._stretches(pieces, counts):
            segment = pieces.segment.take(stretches.piece)
            for row, disc in self._patches.candidates(pieces, stretches, counts):
                of_pair = segment.take(row)
                found = self._crossing(paths, of_pair, disc)
                if counts is not None:
                    counts.note("tests", len(disc))
                    counts.note("crossings", len(found))
                yield Crossings(rows.start + of_pair.take(found), self._order.take(disc.take(found)))

    def _crossing(self, paths: np.ndarray, segment: np.ndarray, disc: np.ndarray) -> np.ndarray:
        """Which rows (H,), ascending, of the pairs of a ``segment`` (C,) and a ``disc`` (C,) cross.

        ``paths`` (S, 6) are the segments' origins and ends side by side.
        """
        found = [np.zeros(0, np.int64)]
        for begin in range(0, len(segment), PAIRS):
            path = paths.take(segment[begin : begin + PAIRS], axis=0)
            held = self._rows.take(disc[begin : begin + PAIRS], axis=0)
            hit = crosses(path[:, :3], path[:, 3:], held[:, :3], held[:, 3:6], held[:, 6])
            found.append(begin + hit.nonzero()[0])
        return np.concatenate(found)

    @abstractmethod
    def _stretches(self, pieces: Pieces, counts: Counts | None) -> Iterator[Stretches]:
        """Where along which of the ``pieces`` of segments which patch may be crossed, in blocks of bounded size.

        No pair of a piece and a disc comes twice.
        """
