"""Disc Indexing compiled: each segment walks a grid over the discs by itself, many discs being tested side by side."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..discs import TangentDiscs
from ..parallel import ordered_map
from ..segments import Segments
from ..space_filling import curve_order, mean_spacing
from .counts import Counts
from .disc_bounds import extents, sides
from .disc_grid import grid_bounds
from .empty_boxes import ANY_WAY, facing_octants
from .gatherer import Crossings
from .streams import PAIRS, in_lanes

SEGMENTS = 1 << 16  # most segments that are searched one after the other
CELLS = 1 << 20
ENTRIES = 1 << 24  # most places of discs in cells before the ones that do not touch are left out

#: What the walk counts.
TALLIED = ("nodes", "patches", "listed", "discs", "tests")


class CompiledIndex:
    """The study's second gatherer over a uniform grid, in compiled code.

    A crossing counts in the cell where the walk is at that crossing's t, so that each pair is found once. In a cell
    the discs are first looked at in float32, LANES at a time, which leaves hardly more than the crossings to the
    exact test. Hence its cells are larger than those of DiscGrid.

    kernels  the compiled functions, see core/compiled
    discs    the TangentDiscs to search
    cell     side of the grid's cells in metres; None: what fits best
    """

    name = "disc-index"
    index = "compiled grid"
    chunk = SEGMENTS

    def __init__(self, kernels, discs: TangentDiscs, cell: float | None = None):
        self._kernels, self._count = kernels, len(discs)
        if len(discs) == 0:
            return
        if cell is None:
            cell = compiled_cell(discs, mean_spacing(discs.centres))
        cell = grid_bounds(discs, CELLS, ENTRIES)(cell)
        extent = extents(discs)
        lower, upper = (discs.centres - extent).min(axis=0), (discs.centres + extent).max(axis=0)
        # Cell i is centred at i. Walls on the scene's box then lie well inside their layer of cells.
        pad = 0.125 * cell
        size = (upper - lower + 2 * pad) / cell
        self.cell, self._frame = cell, np.concatenate([lower - pad, [cell], size])
        self._shape = np.ceil(size).astype(np.int64) + 1
        order = curve_order(discs.centres)
        rows = np.concatenate([discs.centres, discs.normals, discs.radii[:, None], np.zeros((len(discs), 1))], axis=1)
        self._discs = rows.take(order, axis=0)
        self._discs[:, 7] = order
        self._build(sides(discs).take(order), facing_octants(discs.normals).take(order))

    def _build(self, sides: np.ndarray, octants: np.ndarray) -> None:
        kernels, shape, cells = self._kernels, self._shape, int(self._shape.prod())
        local = self._discs[:, :7].copy()
        local[:, :3] -= self._frame[:3]
        local[:, [0, 1, 2, 6]] /= self.cell
        counts, seen = np.zeros(kernels.SIDES * cells, np.int64), np.zeros(cells, np.uint8)
        kernels.count(local, shape, sides, octants, counts, seen)
        patches = np.count_nonzero(counts)
        self._first_patch, self._block = np.empty(cells + 1, np.int64), np.empty(patches + 1, np.int64)
        kernels.lay_out(counts, self._first_patch, self._block)
        # Lanes without a disc hold one that is far away.
        self._numbers = np.empty((int(self._block[-1]), 7, kernels.LANES), np.float32)
        self._numbers[:] = np.array([1e9, 0, 0, 1, 0, 0, 0], np.float32)[:, None]
        self._member = np.zeros((len(self._numbers), kernels.LANES), np.int32)
        self._slabs = np.zeros((patches, 8), np.float32)
        filled = np.zeros(patches, np.int64)
        kernels.fill(local, shape, sides, counts, self._block, filled, self._numbers, self._member, self._slabs)
        self._boxes = np.empty((ANY_WAY + 1, cells), np.uint8)

        def grown(box: int) -> None:
            if box == ANY_WAY:
                kernels.distances(seen, shape, self._boxes[box])
            else:
                kernels.empty_boxes(seen, shape, box, self._boxes[box])

        for _ in ordered_map(grown, range(ANY_WAY + 1)):
            pass
        held = (self._boxes, self._first_patch, self._block, self._slabs, self._numbers, self._member, self._discs)
        self._distance = float(np.log2(1.0 + sum(array.nbytes for array in held) / (1 << 20)))

    def __len__(self) -> int:
        return self._count

    def crossings(self, segments: Segments, counts: Counts | None = None) -> Iterator[Crossings]:
        """Yield all crossings of ``segments``, each pair once, in chunks of bounded size."""
        if self._count == 0:
            return iter(())
        origins, ends = (np.require(rows, np.float64, ["C", "W"]) for rows in (segments.origins, segments.ends))
        return in_lanes(len(segments), SEGMENTS, lambda rows: self._found(origins, ends, rows, counts))

    def _found(self, origins, ends, rows: slice, counts: Counts | None) -> Iterator[Crossings]:
        sorted_rows, begun = np.empty(rows.stop - rows.start, np.int64), 0
        self._kernels.order_by_end(ends, self._frame, rows.start, sorted_rows)
        while begun < len(sorted_rows):
            segment, disc = np.empty((2, max(PAIRS, self._count)), np.int64)
            before, tally = begun, np.zeros(5, np.int64)
            begun, found = self._kernels.crossings(
                origins, ends, sorted_rows, begun, self._frame, self._shape, self._boxes, self._first_patch,
                self._block, self._slabs, self._numbers, self._member, self._discs, segment, disc, tally,
            )  # fmt: skip
            if counts is not None:
                numbers = {"segments": begun - before, "crossings": found} | dict(zip(TALLIED, tally, strict=True))
                numbers["far"] = round(self._distance * numbers["nodes"])
                for kind, number in numbers.items():
                    counts.note(kind, number)
            yield Crossings(segment[:found].copy(), disc[:found].copy())


def compiled_cell(discs: TangentDiscs, spacing: float) -> float:
    """The side of cells in metres that measured best for ``discs``, N >= 1, as far apart as ``spacing``."""
    return max(2.5 * spacing, 0.8 * float(np.median(discs.radii)))
