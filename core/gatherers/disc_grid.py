"""A uniform grid over the discs, with the room to skip around each of its empty cells."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..discs import TangentDiscs
from ..space_filling import mean_spacing
from .disc_bounds import extents, sides
from .disc_search import Candidates
from .empty_boxes import empty_boxes, facing_octants
from .grid_walk import walk
from .local_frame import MARGIN, LocalFrame
from .patches import Patches, Stretches
from .ranges import blocks, expanded

CELLS = 1 << 22  # 4 million: the boxes of empty space around them take 9 bytes each
CELLS_PER_AXIS = 512
ENTRIES = 1 << 26  # most places of discs in cells before the ones that do not touch are left out
SIDES = 6  # a cell keeps discs apart by the axis and side that their normals point to


class DiscGrid:
    """Cells of equal size that list the discs touching them, by patches of similar normals.

    A segment steps from cell to cell, and at once through a box of cells in which nothing can face it. A
    crossing counts in the cell where the walk is at that crossing's t.

    discs  N >= 1 TangentDiscs
    cell   side of the cells in metres; None takes what measured best, 1.2 spacings of the discs but at
           least 0.6 radii. The side grows where the grid would have too many cells or entries.
    """

    def __init__(self, discs: TangentDiscs, cell: float | None = None):
        wanted = cell if cell is not None else wanted_cell(discs)
        self.cell = fitting_cell(discs, wanted)
        extent = extents(discs)
        lower, upper = (discs.centres - extent).min(axis=0), (discs.centres + extent).max(axis=0)
        # Cell i is centred at i. Walls on the scene's box then lie well inside their layer of cells.
        pad = 0.125 * self.cell
        self._frame = LocalFrame(lower - pad, self.cell, (upper - lower + 2 * pad) / self.cell)
        self._shape = np.ceil(self._frame.size).astype(np.int64) + 1
        key, member = _sorted_entries(self._frame, discs, extent / self.cell, self._shape)
        start = np.flatnonzero(np.diff(key, prepend=-1))
        self._patches = Patches.of(self._frame, discs, member, start)
        cell_of_patch = key[start] // SIDES
        self._first_patch = np.searchsorted(cell_of_patch, np.arange(self._shape.prod() + 1))
        octants = np.bitwise_or.reduceat(facing_octants(discs.normals)[member], start)
        self._boxes = empty_boxes(cell_of_patch, octants, self._shape)

    def candidates(self, origins: np.ndarray, ends: np.ndarray) -> Iterator[Candidates]:
        """Walk the cells from origins to ends (3, S), in metres, and yield the discs that may be crossed."""
        pieces = self._frame.pieces(origins, ends)
        for piece, cell, first, last in walk(self._boxes, self._shape, pieces):
            begin = self._first_patch.take(cell)
            row, patch = expanded(begin, self._first_patch.take(cell + 1) - begin)
            piece, first, last = piece.take(row), first.take(row), last.take(row)
            stretches = Stretches(piece, patch, first, np.minimum(last, np.float32(1.0)))
            kept, balls = self._patches.narrowed(pieces, stretches)
            piece, first, last = piece.take(kept), first.take(kept), last.take(kept)
            segment, enter, length = (column.take(piece) for column in (pieces.segment, pieces.enter, pieces.length))
            # Stretches of one piece share their ends to the bit; the outermost have none.
            begin = np.where(first > 0.0, enter + first * length, -np.inf)
            end = np.where(last < 1.0, enter + last * length, np.inf)
            for row, disc in self._patches.within(patch.take(kept), balls):
                yield Candidates(segment.take(row), disc, begin.take(row), end.take(row))


def wanted_cell(discs: TangentDiscs) -> float:
    """The side of cells in metres that measured best for these discs, were memory no concern."""
    return max(1.2 * mean_spacing(discs.centres), 0.6 * float(np.median(discs.radii)))


def fitting_cell(discs: TangentDiscs, wanted: float) -> float:
    """The side of cells in metres from ``wanted`` up that keeps the grid within its bounds."""
    extent = extents(discs)
    size = (discs.centres + extent).max(axis=0) - (discs.centres - extent).min(axis=0)
    cell = max(wanted, float(size.max()) / (CELLS_PER_AXIS - 3))
    while np.prod(size / cell + 2.5) > CELLS or np.prod(2 * extent / cell + 1.5, axis=1).sum() > ENTRIES:
        cell *= 1.1
    return cell


def _sorted_entries(frame, discs, extent, shape) -> tuple[np.ndarray, np.ndarray]:
    """All places of discs in cells: cell * SIDES + side of the normal, and the disc, sorted by the former."""
    centres, radii = frame.local(discs.centres), discs.radii / frame.unit
    low = np.floor(centres - extent - MARGIN + 0.5).astype(np.int64)
    width = np.floor(centres + extent + MARGIN + 0.5).astype(np.int64) - low + 1
    kind = sides(discs)
    keys, members = [], []
    for rows in blocks(width.prod(axis=1), 1 << 20):
        disc, place = expanded(np.zeros_like(kind[rows]), width[rows].prod(axis=1))
        disc += rows.start
        cell, away, slack = 0, 0.0, 0.5 * np.abs(discs.normals).sum(axis=1).take(disc) + MARGIN
        height, stride = 0.0, 1
        for dim in range(3):
            place, along = np.divmod(place, width[:, dim].take(disc))
            along += low[:, dim].take(disc)
            cell, stride = cell + stride * along, stride * shape[dim]
            gap = along - centres[:, dim].take(disc)
            height = height + gap * discs.normals[:, dim].take(disc)
            away = away + np.maximum(np.abs(gap) - 0.5, 0.0) ** 2
        # The disc's plane passes through the cell, and the ball around the disc reaches it.
        touching = np.flatnonzero((np.abs(height) <= slack) & (away <= (radii.take(disc) + MARGIN) ** 2))
        disc = disc.take(touching)
        keys.append(cell.take(touching) * SIDES + kind.take(disc))
        members.append(disc.astype(np.int32))
    key = np.concatenate(keys)
    order = np.argsort(key, kind="stable")
    return key.take(order), np.concatenate(members).take(order)
