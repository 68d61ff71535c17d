"""A uniform grid over the discs, with the room to skip around each of its empty cells."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..discs import TangentDiscs
from ..parallel import ordered_map
from ..space_filling import mean_spacing
from .counts import Counts
from .disc_bounds import extents, sides
from .disc_search import Candidates
from .empty_boxes import empty_boxes, facing_octants
from .grid_walk import walk
from .local_frame import MARGIN, LocalFrame
from .patches import DiscPatches, Stretches
from .ranges import expanded

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
        self._patches = DiscPatches.of(self._frame, discs, member, start)
        cell_of_patch = key[start] // SIDES
        patches = np.bincount(cell_of_patch, minlength=int(self._shape.prod()))
        self._first_patch = np.concatenate([[0], np.cumsum(patches)])
        octants = np.bitwise_or.reduceat(facing_octants(discs.normals)[member], start)
        self._boxes = empty_boxes(cell_of_patch, octants, self._shape)

    def candidates(self, origins: np.ndarray, ends: np.ndarray, counts: Counts | None = None) -> Iterator[Candidates]:
        """Walk the cells from origins to ends (3, S), in metres, and yield the discs that may be crossed."""
        pieces = self._frame.pieces(origins, ends)
        for piece, cell, first, last in walk(self._boxes, self._shape, pieces, counts):
            begin = self._first_patch.take(cell)
            row, patch = expanded(begin, self._first_patch.take(cell + 1) - begin)
            piece, first, last = piece.take(row), first.take(row), last.take(row)
            stretches = Stretches(piece, patch, first, np.minimum(last, np.float32(1.0)))
            kept, balls = self._patches.narrowed(pieces, stretches, counts)
            piece, first, last = piece.take(kept), first.take(kept), last.take(kept)
            segment, enter, length = (column.take(piece) for column in (pieces.segment, pieces.enter, pieces.length))
            # Stretches of one piece share their ends to the bit; the outermost have none.
            begin = np.where(first > 0.0, enter + first * length, -np.inf)
            end = np.where(last < 1.0, enter + last * length, np.inf)
            for row, disc in self._patches.within(patch.take(kept), balls, counts):
                yield Candidates(row, disc, segment, begin, end)


def wanted_cell(discs: TangentDiscs, spacing: float | None = None) -> float:
    """The side of cells in metres that measured best for these discs, were memory no concern.

    ``spacing`` is their mean_spacing, when it is known already.
    """
    spacing = mean_spacing(discs.centres) if spacing is None else spacing
    return max(1.2 * spacing, 0.6 * float(np.median(discs.radii)))


def fitting_cell(discs: TangentDiscs, wanted: float) -> float:
    """The side of cells in metres from ``wanted`` up that keeps the grid within its bounds."""
    return grid_bounds(discs)(wanted)


def grid_bounds(discs: TangentDiscs, entries: int = ENTRIES) -> Callable[[float], float]:
    """:func:`fitting_cell` for several wanted sides of the same ``discs``; at most so many entries."""
    extent = extents(discs)
    size = (discs.centres + extent).max(axis=0) - (discs.centres - extent).min(axis=0)
    # The sum over the discs of (2 x / c + 1.5)(2 y / c + 1.5)(2 z / c + 1.5), as a polynomial in 1 / c.
    x, y, z = 2.0 * extent.T
    powers = [3.375 * len(discs), 2.25 * (x + y + z).sum(), 1.5 * (x * y + y * z + z * x).sum(), (x * y * z).sum()]

    def fitting(wanted: float) -> float:
        cell = max(wanted, float(size.max()) / (CELLS_PER_AXIS - 3))
        while np.prod(size / cell + 2.5) > CELLS or np.polyval(powers[::-1], 1.0 / cell) > entries:
            cell *= 1.1
        return cell

    return fitting


def _sorted_entries(frame, discs, extent, shape) -> tuple[np.ndarray, np.ndarray]:
    """All places of discs in cells: cell * SIDES + side of the normal, and the disc, sorted by the former."""
    centres = frame.local(discs.centres)
    # Far from the origin rounding may put a disc beside the frame that was made around it.
    low = np.clip(np.floor(centres - extent - MARGIN + 0.5), 0, shape - 1).astype(np.int64)
    width = np.clip(np.floor(centres + extent + MARGIN + 0.5), 0, shape - 1).astype(np.int64) - low + 1
    stride = np.array([1, shape[0], shape[0] * shape[1]])
    # One number per entry sorts faster than a key with its disc: the key above, the disc below.
    bits = len(discs).bit_length()
    first = ((low @ stride * SIDES + sides(discs)) << bits) + np.arange(len(discs))
    # Relative to the lowest cell, so precise to 1e-4 cells in float32; four times that is allowed for here.
    numbers = np.column_stack([low - centres, discs.normals, discs.radii / frame.unit]).astype(np.float32)

    def touched(rows: np.ndarray) -> np.ndarray:
        sizes = width[rows[0]]
        steps = np.arange(sizes.prod()).reshape(sizes)
        steps = sum(step * along for step, along in zip(stride, np.unravel_index(steps, sizes), strict=True)).ravel()
        disc, place = _touches(numbers[rows], sizes)
        return first[rows].take(disc) + (steps.take(place) * SIDES << bits)

    entries = np.sort(np.concatenate(list(ordered_map(touched, _alike(width)))))
    return entries >> bits, (entries & ((1 << bits) - 1)).astype(np.int32)


def _alike(width: np.ndarray) -> Iterator[np.ndarray]:
    """Rows of discs that reach over equally many cells (N, 3) along each axis, for 2^18 cells in all at a time."""
    most = int(width.max()) + 1
    code = (width[:, 0] * most + width[:, 1]) * most + width[:, 2]
    order = np.argsort(code, kind="stable")
    for alike in np.split(order, np.flatnonzero(np.diff(code[order])) + 1):
        together = max(1, (1 << 18) // int(width[alike[0]].prod()))
        for begin in range(0, len(alike), together):
            yield alike[begin : begin + together]


def _touches(numbers: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which discs touch which of the ``sizes`` (3,) cells from their lowest on: disc and cell, in C order.

    A disc's ``numbers`` (7,) are the way from its centre to the middle of the lowest cell, normal and radius.
    """
    height, away = np.float32(0.0), np.float32(0.0)
    for axis, size in enumerate(sizes):
        places = [1, 1, 1]
        places[axis] = size
        gap = numbers[:, axis, None] + np.arange(size, dtype=np.float32)
        height = height + (gap * numbers[:, axis + 3, None]).reshape(-1, *places)
        beyond = np.maximum(np.abs(gap) - np.float32(0.5), np.float32(0.0))
        away = away + (beyond * beyond).reshape(-1, *places)
    # The disc's plane passes through the cell, and the ball around the disc reaches it.
    margin = np.float32(1.1 * MARGIN)
    slack = np.float32(0.5) * np.abs(numbers[:, 3:6]).sum(axis=1) + margin
    reach = (numbers[:, 6] + margin) ** 2
    near = (np.abs(height) <= slack.reshape(-1, 1, 1, 1)) & (away <= reach.reshape(-1, 1, 1, 1))
    return np.divmod(near.ravel().nonzero()[0], int(sizes.prod()))
