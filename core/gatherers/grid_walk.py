"""The walk of many segments at once through a grid, from occupied cell to occupied cell."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .counts import Counts
from .empty_boxes import directions
from .local_frame import Pieces

WAVE = 1 << 13  # pieces under way together, so that their state stays in the processor's cache
IDLE = 0.1  # share of them that may have finished before others take their places
RECORDS = 1 << 14  # cells visited that are handed out together
_OVERSTEP = np.float32(1e-3)  # cells beyond a box's face that a step ends: more than rounding, less than MARGIN
_LARGE = np.float32(1e30)


def walk(
    boxes: np.ndarray, shape: np.ndarray, pieces: Pieces, counts: Counts | None = None
) -> Iterator[tuple[np.ndarray, ...]]:
    """Visit the cells that ``pieces`` pass and whose box in ``boxes`` is 0, see :func:`.empty_boxes.empty_boxes`.

    Cell i reaches from i - 1/2 to i + 1/2 in the pieces' units. Yields, many at a time, the piece (R,) int64,
    the cell (R,) int64, and the shares first and last (R,) float32 of the piece between which it is in that
    cell, or at most 1.5e-3 units outside. The stretches of one piece do not overlap, leave out only empty
    boxes, begin at 0 and end at 1 or more.

    Amanatides & Woo's walk from face to face (1987), with steps as long as the boxes of empty cells allow.
    """
    wide, high = (np.float32(shape[axis]) for axis in (0, 1))
    with np.errstate(divide="ignore", over="ignore"):
        inverse = np.clip(np.float32(1.0) / pieces.step, -_LARGE, _LARGE)
    path = np.concatenate([pieces.start, pieces.step, inverse])
    base = directions(pieces.step) * int(np.prod(shape))
    begun = min(WAVE, len(base))
    piece, offset, state = np.arange(begun), base[:begun].copy(), path[:, :begun].copy()
    now = np.zeros(begun, np.float32)
    scratch = np.empty((2, 3, begun), np.float32)
    found, count = [], 0
    while len(piece):
        start, step, inverse = state[:3], state[3:6], state[6:]
        cell, ahead = scratch[:, :, : len(piece)]
        np.multiply(step, now, out=cell)
        cell += start
        np.rint(cell, out=cell)
        index = cell[2] * high
        index += cell[1]
        index *= wide
        index += cell[0]
        index = index.astype(np.int64)
        side = boxes.take(index + offset)
        if counts is not None:
            counts.note("nodes", np.count_nonzero(now < 1))
        # A box of side k ends k - 1/2 cells from its cell's middle; an occupied cell is left at its own face.
        reach = np.maximum(side, 1).astype(np.float32)
        reach -= np.float32(0.5) - _OVERSTEP
        np.abs(inverse, out=ahead)
        ahead *= reach
        cell -= start
        cell *= inverse
        cell += ahead
        leave = np.minimum(cell[0], cell[1])
        np.minimum(leave, cell[2], out=leave)
        np.maximum(leave, now, out=leave)
        full = ((side == 0) & (now < 1)).nonzero()[0]
        if len(full):
            found.append((piece.take(full), index.take(full), now.take(full), leave.take(full)))
            count += len(full)
            if count >= RECORDS:
                yield _joined(found)
                found, count = [], 0
        np.minimum(leave, np.float32(1.0), out=now)
        # A finished piece stands at its end until enough of them make way for others.
        done = (now == 1).nonzero()[0]
        if len(done) > IDLE * len(piece):
            fresh = slice(begun, min(begun + len(done), len(base)))
            begun, place = fresh.stop, done[: fresh.stop - fresh.start]
            piece[place], offset[place], now[place] = np.arange(fresh.start, begun), base[fresh], 0.0
            for row, value in zip(state, path[:, fresh], strict=True):
                row[place] = value
            if begun == len(base):
                going = (now < 1).nonzero()[0]
                piece, offset, now, state = piece[going], offset[going], now[going], state.take(going, axis=1)
    if found:
        yield _joined(found)


def _joined(found: list[tuple[np.ndarray, ...]]) -> tuple[np.ndarray, ...]:
    return tuple(np.concatenate(column) for column in zip(*found, strict=True))
