"""The walk of segments through a grid over discs, one segment at a time, with the exact test in it."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from .grid_build import LANES

_OVERSTEP = 1e-3  # cells beyond a box's face that a step ends, as in core/gatherers/grid_walk.py
_LARGE = 1e30
_FLAT = 8e-5  # as for `directions` in core/gatherers/empty_boxes.py
BOXES = 16  # along each axis, by which segments are sorted
_SHORT = 1e-150  # cells: a shorter way has no direction
_ROUNDING = np.float32(1e-5)  # in float32, times the largest number in a test: three times what rounding may do
_TWO = np.float32(2.0)


@njit(error_model="numpy", forceinline=True)
def _crossing_time(origin, step, discs, row):
    """The t of the crossing, or NaN: operation by operation the exact test of core/crossing.py."""
    px, py, pz = origin
    sx, sy, sz = step
    nx, ny, nz = discs[row, 3], discs[row, 4], discs[row, 5]
    wx, wy, wz = discs[row, 0] - px, discs[row, 1] - py, discs[row, 2] - pz
    facing = sx * nx + sy * ny + sz * nz
    height = wx * nx + wy * ny + wz * nz
    dx = sx * height - wx * facing
    dy = sy * height - wy * facing
    dz = sz * height - wz * facing
    reach = discs[row, 6] * facing
    room = reach * reach - (dx * dx + dy * dy + dz * dz)
    return height / facing if facing < 0.0 and height <= 0.0 and height >= facing and room >= 0.0 else np.nan


@njit(error_model="numpy", forceinline=True)
def _look(numbers, here, point, direction, half, maybe):
    """Which discs of block ``here`` may be crossed within ``half`` a cell's length of ``point`` along ``direction``."""
    px, py, pz = point
    ux, uy, uz = direction
    # As many lanes as the array has, and not LANES: only so does the compiler test them together.
    for lane in range(numbers.shape[2]):
        nx, ny, nz = numbers[here, 3, lane], numbers[here, 4, lane], numbers[here, 5, lane]
        wx, wy, wz = numbers[here, 0, lane] - px, numbers[here, 1, lane] - py, numbers[here, 2, lane] - pz
        radius = numbers[here, 6, lane]
        facing = nx * ux + ny * uy + nz * uz
        height = wx * nx + wy * ny + wz * nz
        dx, dy, dz = ux * height - wx * facing, uy * height - wy * facing, uz * height - wz * facing
        slack = _ROUNDING * (radius + _TWO)
        size = abs(facing)
        rim = radius * size + slack
        near = (facing <= slack) & (abs(height) <= half * size + slack)
        maybe[lane] = near & (dx * dx + dy * dy + dz * dz <= rim * rim)


@njit(error_model="numpy", forceinline=True)
def _inside(origin, step, frame):
    """Between which shares of its way the segment is inside the frame; the first is larger when it never is."""
    enter, leave = 0.0, 1.0
    for axis in range(3):
        begin, along, limit = origin[axis] - frame[axis], step[axis], frame[4 + axis] * frame[3]
        if along == 0.0:
            if not 0.0 <= begin <= limit:
                leave = -1.0
        else:
            near, far = -begin / along, (limit - begin) / along
            enter, leave = max(enter, min(near, far)), min(leave, max(near, far))
    if not math.isfinite(step[0] + step[1] + step[2]) or (step[0] == 0.0 and step[1] == 0.0 and step[2] == 0.0):
        leave = -1.0
    return enter, leave


@njit(error_model="numpy", forceinline=True)
def _octant(x, y, z):
    """Which of the boxes of empty cells serves this direction."""
    if min(abs(x), abs(y), abs(z)) > _FLAT * max(abs(x), abs(y), abs(z)):
        return (x < 0.0) + 2 * (y < 0.0) + 4 * (z < 0.0)
    return 8


@njit("void(f8[:,::1], f8[::1], i8, i8[::1])", nogil=True, cache=True, error_model="numpy")
def order_by_end(ends, frame, first, rows):
    """Write the numbers from ``first`` on into ``rows`` (R,), those of segments that end close together side by side.

    These cross the same discs, which then are in the processor's cache. ``ends``, ``frame`` as for :func:`crossings`.
    """
    place = np.zeros(BOXES**3 + 1, np.int64)
    box = np.empty(len(rows), np.int64)
    for at in range(len(rows)):
        key = 0
        for axis in range(3):
            share = (ends[first + at, axis] - frame[axis]) / (frame[3] * frame[4 + axis])
            key = key * BOXES + min(max(math.floor(min(max(share, 0.0), 1.0) * BOXES), 0), BOXES - 1)
        box[at] = key
        place[key + 1] += 1
    for key in range(BOXES**3):
        place[key + 1] += place[key]
    for at in range(len(rows)):
        rows[place[box[at]]] = first + at
        place[box[at]] += 1


@njit(
    "Tuple((i8, i8))(f8[:,::1], f8[:,::1], i8[::1], i8, f8[::1], i8[::1], u1[:,::1], i8[::1], i8[::1], f4[:,::1],"
    " f4[:,:,::1], i4[:,::1], f8[:,::1], i8[::1], i8[::1], i8[::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def crossings(
    origins,
    ends,
    rows,
    begun,
    frame,
    shape,
    boxes,
    first_patch,
    block,
    slabs,
    numbers,
    member,
    discs,
    segment,
    disc,
    tally,
):
    """Write the crossings of the segments ``rows[begun:]`` into ``segment`` and ``disc`` until these are full.

    origins, ends  (S, 3) metres
    frame          (7,) the middle of cell 0 in metres, side of a cell in metres, size in cells
    shape          (3,) cells along each axis
    boxes          (9, cells) how far all is empty, see core/gatherers/empty_boxes.py
    first_patch, block, slabs, numbers, member   of :mod:`.grid_build`
    discs          (N, 8) centre, normal, radius in metres, and the disc's row, in the index's order; what a crossing
                   needs is fetched at once
    segment, disc  (C,) int64, at least N of them
    tally          (5,) counted up: nodes, patches, listed, discs, tests (see core/gatherers/counts.py)

    The walk is that of core/gatherers/grid_walk.py. Returns the place in ``rows`` from which on is still to be
    searched, and how many pairs were found.
    """
    f4 = np.float32
    maybe = np.zeros(LANES, np.uint8)
    any_of_them = maybe.view(np.uint64)
    unit = frame[3]
    count = nodes = patches = listed = looked = tests = 0
    while begun < len(rows):
        before, row = count, rows[begun]
        origin = origins[row, 0], origins[row, 1], origins[row, 2]
        step = ends[row, 0] - origin[0], ends[row, 1] - origin[1], ends[row, 2] - origin[2]
        enter, leave = _inside(origin, step, frame)
        if not enter <= leave:
            begun += 1
            continue
        # The part inside, in cells: from a along b.
        ax = (origin[0] - frame[0] + enter * step[0]) / unit
        ay = (origin[1] - frame[1] + enter * step[1]) / unit
        az = (origin[2] - frame[2] + enter * step[2]) / unit
        length = leave - enter
        bx, by, bz = step[0] * (length / unit), step[1] * (length / unit), step[2] * (length / unit)
        # Limited, so that a segment parallel to a face has no 0 * infinity.
        ix, iy, iz = (
            min(max(1.0 / bx, -_LARGE), _LARGE),
            min(max(1.0 / by, -_LARGE), _LARGE),
            min(max(1.0 / bz, -_LARGE), _LARGE),
        )
        reach = math.sqrt(bx * bx + by * by + bz * bz)
        # Without a direction a test asks only for the distance from the disc's plane.
        scale = 1.0 / reach if reach > _SHORT else 0.0
        ux, uy, uz = f4(bx * scale), f4(by * scale), f4(bz * scale)
        box = _octant(bx, by, bz)
        now = 0.0
        while now < 1.0:
            cx = min(max(math.floor(ax + now * bx + 0.5), 0), shape[0] - 1)
            cy = min(max(math.floor(ay + now * by + 0.5), 0), shape[1] - 1)
            cz = min(max(math.floor(az + now * bz + 0.5), 0), shape[2] - 1)
            cell = cx + shape[0] * (cy + shape[1] * cz)
            side = boxes[box, cell]
            nodes += 1
            # A box of side k ends k - 1/2 cells from its cell's middle; an occupied cell is left at its own face.
            ahead = max(side, 1) - (0.5 - _OVERSTEP)
            then = (cx - ax) * ix + abs(ix) * ahead
            then = min(then, (cy - ay) * iy + abs(iy) * ahead)
            then = min(then, (cz - az) * iz + abs(iz) * ahead)
            # Beyond what rounding leaves of numbers this large, the rest is one stretch.
            if not then > now:
                then = 1.0
            if side == 0:
                # Stretches of one segment share their ends to the bit; the outermost have none.
                begin = enter + now * length if now > 0.0 else -np.inf
                end = enter + then * length if then < 1.0 else np.inf
                # In float32 from the middle of the cell: the stretch's middle, and half its length.
                middle, last = 0.5 * (now + min(then, 1.0)), min(then, 1.0)
                qx, qy, qz = f4(ax + middle * bx - cx), f4(ay + middle * by - cy), f4(az + middle * bz - cz)
                half = f4(0.5 * (last - now) * reach)
                first, behind = first_patch[cell], first_patch[cell + 1]
                patches += behind - first
                listed += block[behind] - block[first]
                for patch in range(first, behind):
                    nx, ny, nz = slabs[patch, 0], slabs[patch, 1], slabs[patch, 2]
                    facing = nx * ux + ny * uy + nz * uz
                    height = nx * qx + ny * qy + nz * qz
                    spread = abs(facing) * half
                    if (
                        facing > slabs[patch, 5]
                        or height - spread > slabs[patch, 4]
                        or height + spread < slabs[patch, 3]
                    ):
                        continue
                    looked += block[patch + 1] - block[patch]
                    for here in range(block[patch], block[patch + 1]):
                        _look(numbers, here, (qx, qy, qz), (ux, uy, uz), half, maybe)
                        if any_of_them[0] == 0:
                            continue
                        for lane in range(LANES):
                            if maybe[lane]:
                                tests += 1
                                held = member[here, lane]
                                time = _crossing_time(origin, step, discs, held)
                                if begin <= time < end:
                                    if count < len(segment):
                                        segment[count], disc[count] = row, np.int64(discs[held, 7])
                                    count += 1
            now = then
        if count > len(segment):
            count = before
            break
        begun += 1
    for place, number in enumerate((nodes, patches, listed * LANES, looked * LANES, tests)):
        tally[place] += number
    return begun, count
