"""Building a grid over discs: which disc touches which cell, in blocks that are tested side by side."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

LANES = 8  # discs of a block
SIDES = 6  # a cell keeps discs apart by the axis and side that their normals point to
MARGIN = 4e-3  # cells by which everything is taken larger than it is: far more than rounding
FARTHEST = 255  # cells that a box of empty cells has at most along its sides


@njit(inline="always")
def _cells(local, disc, shape, low, high):
    for axis in range(3):
        normal = local[disc, 3 + axis]
        extent = local[disc, 6] * math.sqrt(max(1.0 - normal * normal, 0.0)) + MARGIN
        # Far from the origin rounding may put a disc beside the grid that was made around it.
        low[axis] = min(max(math.floor(local[disc, axis] - extent + 0.5), 0), shape[axis] - 1)
        high[axis] = min(max(math.floor(local[disc, axis] + extent + 0.5), 0), shape[axis] - 1) + 1


@njit(inline="always")
def _touches(local, disc, x, y, z):
    """Whether the disc's plane passes through the cell, and the ball around the disc reaches it."""
    dx, dy, dz = x - local[disc, 0], y - local[disc, 1], z - local[disc, 2]
    nx, ny, nz = local[disc, 3], local[disc, 4], local[disc, 5]
    if abs(dx * nx + dy * ny + dz * nz) > 0.5 * (abs(nx) + abs(ny) + abs(nz)) + MARGIN:
        return False
    bx, by, bz = max(abs(dx) - 0.5, 0.0), max(abs(dy) - 0.5, 0.0), max(abs(dz) - 0.5, 0.0)
    reach = local[disc, 6] + MARGIN
    return bx * bx + by * by + bz * bz <= reach * reach


@njit(inline="always")
def _bound(slab, numbers, count):
    x, y, z = float(slab[0]), float(slab[1]), float(slab[2])
    length = math.sqrt(x * x + y * y + z * z)
    # Normals that cancel have no mean: any direction bounds them, if less tightly.
    if length > 1e-6:
        slab[0], slab[1], slab[2] = x / length, y / length, z / length
    else:
        slab[0], slab[1], slab[2] = 0.0, 0.0, 1.0
    # The rounded direction is the one that is used, so bound the discs along that one.
    x, y, z = float(slab[0]), float(slab[1]), float(slab[2])
    square = x * x + y * y + z * z
    lowest, highest, smallest = np.inf, -np.inf, 1.0
    for place in range(count):
        disc = numbers[place // LANES, :, place % LANES]
        cosine = x * disc[3] + y * disc[4] + z * disc[5]
        middle = x * disc[0] + y * disc[1] + z * disc[2]
        half = disc[6] * math.sqrt(max(square - cosine * cosine, 0.0)) + MARGIN * (1.0 + disc[6])
        lowest, highest = min(lowest, middle - half), max(highest, middle + half)
        smallest = min(smallest, cosine)
    slab[3], slab[4] = lowest, highest
    slab[5] = (math.sqrt(max(1.0 - smallest * smallest, 0.0)) if smallest > 0.0 else 1.0) + 1e-3


@njit("void(f8[:,::1], i8[::1], i8[::1], u1[::1], i8[::1], u1[::1])", nogil=True, cache=True, error_model="numpy")
def count(local, shape, sides, octants, counts, seen):
    """Count the discs in each cell and side, and note the directions in which they can be crossed there.

    local    (N, 7) centre in cells, cell i being centred at i, normal, radius in cells
    shape    (3,) cells along each axis
    sides    (N,) and octants (N,), as in core/gatherers/disc_bounds.py and empty_boxes.py
    counts   (SIDES * cells,), seen (cells,): zeros, which are counted up
    """
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for disc in range(len(local)):
        _cells(local, disc, shape, low, high)
        for z in range(low[2], high[2]):
            for y in range(low[1], high[1]):
                for x in range(low[0], high[0]):
                    if _touches(local, disc, x, y, z):
                        cell = x + shape[0] * (y + shape[1] * z)
                        counts[SIDES * cell + sides[disc]] += 1
                        seen[cell] |= octants[disc]


@njit("void(i8[::1], i8[::1], i8[::1])", nogil=True, cache=True)
def lay_out(counts, first_patch, block):
    """Number the patches, one for each cell and side with discs in it, and the blocks of each patch.

    counts       (SIDES * cells,) of discs; the patches' numbers take their places
    first_patch  (cells + 1,) and the first ``block`` (K + 1,) of each patch: written
    """
    patches = blocks = 0
    for key in range(len(counts)):
        if key % SIDES == 0:
            first_patch[key // SIDES] = patches
        if counts[key]:
            block[patches] = blocks
            blocks += (counts[key] + LANES - 1) // LANES
            counts[key] = patches
            patches += 1
    first_patch[len(counts) // SIDES], block[patches] = patches, blocks


@njit(
    "void(f8[:,::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], f4[:,:,::1], i4[:,::1], f4[:,::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def fill(local, shape, sides, patch, block, filled, numbers, member, slabs):
    """Write the discs into their blocks, and bound each patch by a slab.

    local, shape, sides  as for :func:`count`; patch, block as from :func:`lay_out`
    filled   (K,) zeros, counted up
    numbers  (B, 7, LANES) float32: centre from the middle of the cell, normal, radius of each disc, in cells; what has
             been there in the lanes without a disc stays
    member   (B, LANES) int32, the discs
    slabs    (K, 8) float32 zeros: normal, the two planes along it that hold all discs, from the middle of the cell, and
             the sine of the largest angle to the normal
    """
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for disc in range(len(local)):
        _cells(local, disc, shape, low, high)
        for z in range(low[2], high[2]):
            for y in range(low[1], high[1]):
                for x in range(low[0], high[0]):
                    if _touches(local, disc, x, y, z):
                        at = patch[SIDES * (x + shape[0] * (y + shape[1] * z)) + sides[disc]]
                        here, lane = block[at] + filled[at] // LANES, filled[at] % LANES
                        filled[at] += 1
                        member[here, lane] = disc
                        numbers[here, 0, lane] = local[disc, 0] - x
                        numbers[here, 1, lane] = local[disc, 1] - y
                        numbers[here, 2, lane] = local[disc, 2] - z
                        for axis in range(3, 7):
                            numbers[here, axis, lane] = local[disc, axis]
                        for axis in range(3):
                            slabs[at, axis] += local[disc, 3 + axis]
    for at in range(len(slabs)):
        _bound(slabs[at], numbers[block[at] : block[at + 1]], filled[at])


@njit("void(u1[::1], i8[::1], i8, u1[::1])", nogil=True, cache=True)
def empty_boxes(seen, shape, octant, side):
    """How many cells the largest cube of cells has that begins at each cell, goes along ``octant``, and is empty.

    seen    (cells,) bit o of a cell says that something in it faces directions of octant o
    side    (cells,) written: 0 where something is in the cell itself, and FARTHEST at most; outside all is empty
    """
    wide, high, deep = shape[0], shape[1], shape[2]
    ahead_x = -1 if octant & 1 else 1
    ahead_y = -1 if octant & 2 else 1
    ahead_z = -1 if octant & 4 else 1
    for k in range(deep):
        z = k if ahead_z < 0 else deep - 1 - k
        z_edge = k == 0
        for j in range(high):
            y = j if ahead_y < 0 else high - 1 - j
            y_edge = j == 0
            row = wide * (y + high * z)
            for i in range(wide):
                cell = row + (i if ahead_x < 0 else wide - 1 - i)
                if seen[cell] >> octant & 1:
                    side[cell] = 0
                    continue
                to_y, to_z = wide * ahead_y, wide * high * ahead_z
                least = FARTHEST - 1
                if i > 0:
                    least = min(least, side[cell + ahead_x])
                if not y_edge:
                    least = min(least, side[cell + to_y])
                    if i > 0:
                        least = min(least, side[cell + to_y + ahead_x])
                if not z_edge:
                    least = min(least, side[cell + to_z])
                    if i > 0:
                        least = min(least, side[cell + to_z + ahead_x])
                    if not y_edge:
                        least = min(least, side[cell + to_z + to_y])
                        if i > 0:
                            least = min(least, side[cell + to_z + to_y + ahead_x])
                side[cell] = least + 1


@njit("void(u1[::1], i8[::1], u1[::1])", nogil=True, cache=True)
def distances(seen, shape, side):
    """How many cells the nearest cell with anything in it is away, along the axis that it is farthest away along.

    The same as :func:`empty_boxes` for directions of no octant: all is empty that is nearer.
    """
    wide, high, deep = shape[0], shape[1], shape[2]
    for way in (-1, 1):
        for k in range(deep):
            z = k if way < 0 else deep - 1 - k
            for j in range(high):
                y = j if way < 0 else high - 1 - j
                for i in range(wide):
                    x = i if way < 0 else wide - 1 - i
                    cell = x + wide * (y + high * z)
                    if seen[cell]:
                        side[cell] = 0
                        continue
                    least = FARTHEST - 1 if way < 0 else side[cell] - 1
                    # The neighbours that this pass has seen: the whole layer before, the row before, the cell before.
                    for dz in (0, way):
                        for dy in (-1, 0, 1):
                            for dx in (-1, 0, 1):
                                before = dz != 0 or dy == way or (dy == 0 and dx == way)
                                if not before:
                                    continue
                                u, v, w = x + dx, y + dy, z + dz
                                if 0 <= u < wide and 0 <= v < high and 0 <= w < deep:
                                    least = min(least, side[u + wide * (v + high * w)])
                    side[cell] = least + 1
