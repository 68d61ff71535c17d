"""How far one may go from a grid's cell without meeting a disc, by the direction one goes in."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..parallel import ordered_map

ANY_WAY = 8  # the last box: for directions almost parallel to an axis plane, centred at its cell
SIDES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
# Components of normals below this count as zero. So that no crossing is lost, directions with a component
# below 8 times it, relative to the largest, use the box ANY_WAY: all others then have n.s > 1e-5 |s| for the
# discs that are left out, far from a change of sign.
FLAT = 1e-5


def facing_octants(normals: np.ndarray) -> np.ndarray:
    """Octants of directions (N,) uint8 that may arrive against ``normals`` (N, 3), one bit each.

    Bit o stands for directions whose component along axis a is negative where o has bit a.
    """
    against = normals < -FLAT, normals > FLAT
    octants = np.zeros(len(normals), np.uint8)
    for octant in range(ANY_WAY):
        faces = against[octant & 1][:, 0] | against[octant >> 1 & 1][:, 1] | against[octant >> 2 & 1][:, 2]
        octants |= faces.astype(np.uint8) << octant
    return octants


def octants_of(step: np.ndarray) -> np.ndarray:
    """The octant (P,) int64 of each direction ``step`` (3, P)."""
    return (step[0] < 0) + 2 * (step[1] < 0) + 4 * (step[2] < 0).astype(np.int64)


def directions(step: np.ndarray) -> np.ndarray:
    """Which of the boxes (P,) int64 serves each direction ``step`` (3, P): its octant's, or ANY_WAY."""
    size = np.abs(step)
    return np.where(size.min(axis=0) > 8 * FLAT * size.max(axis=0), octants_of(step), ANY_WAY)


def empty_boxes(cells: np.ndarray, octants: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """Sides of the boxes of empty cells, uint8 (9 * cells in the grid,), one grid after the other.

    cells    (K,) occupied cells, x + shape[0] * (y + shape[1] * z), ascending; cells may repeat
    octants  (K,) for what is in them, as from :func:`facing_octants`
    shape    (3,) number of cells along x, y and z

    The box of octant o has its corner at the cell and extends along the octant's directions; k cells per
    side hold nothing that faces them. The box ANY_WAY extends k - 1 cells to every side of its cell and
    holds nothing at all. An occupied cell has 0. Outside the grid all is empty.
    """
    seen = np.zeros(int(np.prod(shape)), np.uint8)
    if len(cells):
        start = np.flatnonzero(np.diff(cells, prepend=-1))
        seen[cells[start]] = np.bitwise_or.reduceat(octants, start)
    seen = seen.reshape(shape[::-1])

    def grown(box: int) -> np.ndarray:
        if box == ANY_WAY:
            return _grown(seen == 0, both=True)
        mirror = tuple(slice(None, None, -1 if box >> axis & 1 else 1) for axis in (2, 1, 0))
        return _grown(np.ascontiguousarray(((seen >> box) & 1 == 0)[mirror]), both=False)[mirror]

    return np.concatenate([box.ravel() for box in ordered_map(grown, range(ANY_WAY + 1))])


def _grown(empty: np.ndarray, both: bool) -> np.ndarray:
    """The largest of SIDES for which the box that begins at (or, for ``both``, surrounds) each cell is empty."""
    side = empty.astype(np.uint8)
    for smaller, larger in pairwise(SIDES):
        shift = larger - smaller
        for axis in range(3):
            ahead = np.moveaxis(empty, axis, 0)
            empty = empty.copy()
            target = np.moveaxis(empty, axis, 0)
            target[:-shift] &= ahead[shift:]
            if both:
                target[shift:] &= ahead[:-shift]
        if not empty.any():
            break
        side += empty.view(np.uint8) * np.uint8(shift)
    return side
