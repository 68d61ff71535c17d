"""The walk of many segments at once through a grid, from occupied cell to occupied cell."""

from __future__ import annotations

import numpy as np

from .empty_boxes import directions
from .local_frame import Pieces

WAVE = 1 << 13  # pieces under way together, so that their state stays in the processor's cache
IDLE = 0.1  # share of them that may have finished before others take their places
_OVERSTEP = np.float32(1e-3)  # cells beyond a box's face that a step ends: more than rounding, less than MARGIN
_LARGE = np.float32(1e30)


def walk(boxes: np.ndarray, shape: np.ndarray, pieces: Pieces):
    """Visit the cells that ``pieces`` pass and whose box in ``boxes`` is 0, see :func:`.empty_boxes.empty_boxes`.

    Cell i reaches from i - 1/2 to i + 1/2 in the pieces' units. Returns the piece (R,) int64, the cell (R,)
    int64, and the shares first and last (R,) float32 of the piece between which it is in that cell, or at
    most 1.5e-3 units outside. The stretches of one piece do not overlap, leave out only empty boxes, begin
    at 0 and end at 1 or more.

    Amanatides & Woo's walk from face to face (1987), with steps as long as the boxes of empty cells allow.
    """
    wide, high = (np.float32(shape[axis]) for axis in (0, 1))
    with np.errstate(divide="ignore"):
        inverse = np.clip(np.float32(1.0) / pieces.step, -_LARGE, _LARGE)
    path = np.concatenate([pieces.start, pieces.step, inverse, np.abs(inverse)])
    base = directions(pieces.step) * int(np.prod(shape))
    begun = min(WAVE, len(base))
    piece, offset, state = np.arange(begun), base[:begun].copy(), path[:, :begun].copy()
    now = np.zeros(begun, np.float32)
    found = []
    while len(piece):
        start, step, inverse, per_cell = state[:3], state[3:6], state[6:9], state[9:]
        cell = now * step
        cell += start
        np.rint(cell, out=cell)
        index = cell[2] * high
        index += cell[1]
        index *= wide
        index += cell[0]
        index = index.astype(np.int64)
        side = boxes.take(index + offset)
        # A box of side k ends k - 1/2 cells from its cell's middle; an occupied cell is left at its own face.
        reach = np.maximum(side, 1).astype(np.float32)
        reach -= np.float32(0.5) - _OVERSTEP
        cell -= start
        cell *= inverse
        cell += reach * per_cell
        leave = np.minimum(np.minimum(cell[0], cell[1]), cell[2])
        np.maximum(leave, now, out=leave)
        full = ((side == 0) & (now < 1)).nonzero()[0]
        if len(full):
            found.append((piece.take(full), index.take(full), now.take(full), leave.take(full)))
        now = np.minimum(leave, np.float32(1.0))
        # A finished piece stands at its end until enough of them make way for others.
        done = (now == 1).nonzero()[0]
        if len(done) > IDLE * len(piece):
            fresh = slice(begun, begun + len(done))
            done, finished = np.split(done, [len(base) - begun])
            begun += len(done)
            piece[done] = np.arange(fresh.start, begun)
            offset[done], now[done] = base[fresh], 0.0
            state[:, done] = path[:, fresh]
            if len(finished):
                going = (now < 1).nonzero()[0]
                piece, offset, now, state = piece[going], offset[going], now[going], state.take(going, axis=1)
    if not found:
        return (np.zeros(0, np.int64),) * 2 + (np.zeros(0, np.float32),) * 2
    return tuple(np.concatenate(column) for column in zip(*found, strict=True))
