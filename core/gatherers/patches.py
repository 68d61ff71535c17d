"""Patches of neighbouring discs with similar normals, bounded by a thin slab, and the quick look into them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..parallel import ordered_map
from ..ranges import blocks, expanded_blocks
from ..rows import Rows
from .gatherer import Counts
from .local_frame import MARGIN, LocalFrame, Pieces

RECORDS = 1 << 14  # stretches looked at together, so that their columns stay in the processor's cache
CANDIDATES = 1 << 16  # and pairs
_LARGE = np.float32(1e30)


@dataclass(frozen=True)
class Stretches(Rows):
    """Where along its segment a patch may be crossed; pieces and patches by row, one row per stretch.

    piece  (R,) int64, row in Pieces
    patch  (R,) int64, row in DiscPatches
    first  (R,) float32, as a share 0..1 of the piece
    last   (R,) float32
    """

    piece: np.ndarray
    patch: np.ndarray
    first: np.ndarray
    last: np.ndarray


@dataclass(frozen=True)
class DiscPatches:
    """K groups of discs; a disc may be in several. In the units of one LocalFrame, float32.

    start, count  (K,)   the members of patch k are member[start[k] : start[k] + count[k]]
    member        (E,)   int32, row in the discs
    normal        (3, K) unit, the mean of the members' normals
    low, high     (K,)   the members lie between these two planes, as distances along ``normal``
    tilt          (K,)   sine of the largest angle between ``normal`` and a member's, 1 beyond 90 degrees
    balls         (N, 4) centre and radius of every disc
    """

    start: np.ndarray
    count: np.ndarray
    member: np.ndarray
    normal: np.ndarray
    low: np.ndarray
    high: np.ndarray
    tilt: np.ndarray
    balls: np.ndarray

    @classmethod
    def of(cls, frame: LocalFrame, discs, member: np.ndarray, start: np.ndarray) -> DiscPatches:
        """Bound the groups ``member[start[k]:start[k + 1]]`` of ``discs``; no group is empty."""
        centres, radii = frame.local(discs.centres), discs.radii / frame.unit
        count = np.diff(start, append=len(member))
        columns = np.column_stack([discs.normals, centres, radii]).T.copy()

        def bounded(rows: slice) -> tuple[np.ndarray, ...]:
            groups = member[start[rows.start] : start[rows.stop - 1] + count[rows.stop - 1]]
            return _slabs(columns.take(groups, axis=1), start[rows] - start[rows.start], count[rows])

        slabs = [
            np.concatenate(parts, axis=-1) for parts in zip(*ordered_map(bounded, blocks(count, 1 << 17)), strict=True)
        ]
        balls = np.column_stack([centres, radii]).astype(np.float32)
        return cls(start, count, member, *slabs, balls)

    def candidates(
        self, pieces: Pieces, stretches: Stretches, counts: Counts | None = None
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield rows of ``stretches`` and discs that may cross there, in bounded pairs of arrays (C,) int64."""
        for begin in range(0, len(stretches), RECORDS):
            some = stretches.taken(slice(begin, begin + RECORDS))
            kept, balls = self._narrowed(pieces, some, counts)
            for row, disc in self._within(some.patch.take(kept), balls, counts):
                yield begin + kept.take(row), disc

    def _within(
        self, patch: np.ndarray, balls: np.ndarray, counts: Counts | None
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield which rows of ``patch`` and ``balls`` (R, 4), as from :meth:`_narrowed`, reach which members."""
        for row, place in expanded_blocks(self.start.take(patch), self.count.take(patch), CANDIDATES):
            if counts is not None:
                counts.note("discs", len(place))
            disc = self.member.take(place).astype(np.int64)
            gap = self.balls.take(disc, axis=0)
            gap -= balls.take(row, axis=0)
            gap *= gap
            distance = gap[:, 0] + gap[:, 1]
            distance += gap[:, 2]
            near = (distance <= gap[:, 3]).nonzero()[0]
            yield row.take(near), disc.take(near)

    def _narrowed(self, pieces: Pieces, stretches: Stretches, counts: Counts | None) -> tuple[np.ndarray, np.ndarray]:
        """The rows that meet their patch's slab from the front, and a ball around what is inside the slab.

        The balls (R, 4) hold the centre and minus the radius, so that subtracting them from a disc's ball
        gives the vector between the centres and the sum of the radii.
        """
        if counts is not None:
            counts.note("patches", len(stretches))
            counts.note("listed", self.count.take(stretches.patch).sum())
        patch = stretches.patch
        normal = self.normal.take(patch, axis=1)
        start, step = pieces.start.take(stretches.piece, axis=1), pieces.step.take(stretches.piece, axis=1)
        reach = pieces.reach.take(stretches.piece)
        height, facing = _dot(normal, start), _dot(normal, step)
        with np.errstate(all="ignore"):
            # Limited, so that a piece parallel to the slab has no 0 * infinity.
            inverse = np.clip(1.0 / facing, -_LARGE, _LARGE)
        one = (self.low.take(patch) - height) * inverse
        other = (self.high.take(patch) - height) * inverse
        first = np.maximum(stretches.first, np.minimum(one, other))
        last = np.minimum(stretches.last, np.maximum(one, other))
        # Some member faces the piece unless facing > reach * tilt.
        kept = ((first <= last) & (facing <= reach * self.tilt.take(patch) + np.float32(MARGIN))).nonzero()[0]
        first, last = first.take(kept), last.take(kept)
        middle = (first + last) * np.float32(0.5)
        ball = np.empty((len(kept), 4), np.float32)
        np.add(start.take(kept, axis=1), middle * step.take(kept, axis=1), out=ball[:, :3].T)
        ball[:, 3] = (middle - last) * reach.take(kept) - np.float32(2 * MARGIN)
        return kept, ball


def _slabs(discs: np.ndarray, begin: np.ndarray, count: np.ndarray) -> tuple[np.ndarray, ...]:
    """Normal, low, high and tilt of the groups begin : begin + count of ``discs`` (7, E): normal, centre, radius."""
    mean = np.add.reduceat(discs[:3], begin, axis=1)
    length = np.sqrt(_dot(mean, mean))
    # Normals that cancel have no mean: any direction bounds them, if less tightly.
    mean = np.where(length > 1e-6, mean / np.maximum(length, 1e-6), [[0.0], [0.0], [1.0]])
    # The rounded axis is the one that is used, so bound the discs along that one.
    normal = mean.astype(np.float32)
    mean = np.repeat(normal.astype(np.float64), count, axis=1)
    cosine, middle = _dot(mean, discs[:3]), _dot(mean, discs[3:6])
    half = discs[6] * np.sqrt(np.maximum(_dot(mean, mean) - cosine**2, 0.0)) + MARGIN
    low, high = np.minimum.reduceat(middle - half, begin), np.maximum.reduceat(middle + half, begin)
    smallest = np.minimum.reduceat(cosine, begin)
    tilt = np.where(smallest > 0.0, np.sqrt(np.maximum(1.0 - smallest**2, 0.0)), 1.0) + 1e-3
    return normal, low.astype(np.float32), high.astype(np.float32), tilt.astype(np.float32)


def _dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    product = one * other
    total = product[0] + product[1]
    total += product[2]
    return total
