"""Adding crossings up: in which ring of their disc they lie, their sums, and particles that come again."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

DIRECTIONS = 32  # corners of an outline, as in core/estimator/visible_area.py
RINGS, OUTSIDE = 4, 255  # of a disc, and beyond its outline, as in core/estimator/rings.py
STRIPE = 64  # discs in a row that one thread adds up

_ANGLES = np.arange(DIRECTIONS + 1) * (2.0 * math.pi / DIRECTIONS)
_COSINES, _SINES = np.cos(_ANGLES), np.sin(_ANGLES)
_TANGENTS = math.tan(_ANGLES[1]), math.tan(_ANGLES[2]), math.tan(_ANGLES[3])


@njit("i8(f8, f8)", nogil=True, cache=True, error_model="numpy")
def sector(x, y):
    """In which of the equal sectors around the centre the point lies; on a border of two, either of them."""
    wide, high = abs(x), abs(y)
    small, large = min(wide, high), max(wide, high)
    within = (small >= _TANGENTS[0] * large) + (small >= _TANGENTS[1] * large) + (small >= _TANGENTS[2] * large)
    place = within if high < wide else DIRECTIONS // 4 - 1 - within
    place = place if x >= 0.0 else DIRECTIONS // 2 - 1 - place
    return place if y >= 0.0 else DIRECTIONS - 1 - place


# A call would take longer than the function itself: every array is handed over as seven numbers.
@njit(error_model="numpy", forceinline=True)
def _ring(origins, ends, segment, discs, reach, disc):
    """The ring of the crossing: as estimator/visible_area.py finds it, with the `frames` of core/sampling.py."""
    nx, ny, nz = discs[disc, 3], discs[disc, 4], discs[disc, 5]
    ox, oy, oz = origins[segment, 0], origins[segment, 1], origins[segment, 2]
    sx, sy, sz = ends[segment, 0] - ox, ends[segment, 1] - oy, ends[segment, 2] - oz
    wx, wy, wz = discs[disc, 0] - ox, discs[disc, 1] - oy, discs[disc, 2] - oz
    time = (wx * nx + wy * ny + wz * nz) / (sx * nx + sy * ny + sz * nz)
    dx, dy, dz = time * sx - wx, time * sy - wy, time * sz - wz
    squared, limit, ring = dx * dx + dy * dy + dz * dz, discs[disc, 6], 0
    for _ in range(1, RINGS):
        limit *= 0.25
        ring += squared <= limit
    if discs[disc, 7] == 0.0:
        return ring
    sign = math.copysign(1.0, nz)
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    x = dx * (1.0 + sign * nx * nx * a) + dy * (sign * b) - dz * (sign * nx)
    y = dx * b + dy * (sign + ny * ny * a) - dz * ny
    at = sector(x, y)
    one, other = reach[disc, at], reach[disc, (at + 1) % DIRECTIONS]
    ax, ay = one * _COSINES[at], one * _SINES[at]
    bx, by = other * _COSINES[at + 1], other * _SINES[at + 1]
    return OUTSIDE if (bx - ax) * (y - ay) < (by - ay) * (x - ax) else ring


@njit(
    "void(i8[::1], i8[::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], u1[::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def look(segment, disc, origins, ends, discs, reach, ring):
    """Write into ``ring`` (C,) in which ring of their disc the crossings ``segment``, ``disc`` (C,) lie, or OUTSIDE.

    origins, ends  (S, 3) of the segments
    discs          (N, 8) centre, normal, squared radius, 1 if the disc is partial else 0
    reach          (N, DIRECTIONS) the outlines, see core/estimator/visible_area.py
    """
    for row in range(len(disc)):
        ring[row] = _ring(origins, ends, segment[row], discs, reach, disc[row])


@njit("void(i8[::1], i8[::1], u1[::1], f8[:,::1], f8[:,:,::1], i8, i8)", nogil=True, cache=True, error_model="numpy")
def add_up(segment, disc, ring, flux, sums, part, parts):
    """Add the crossings ``segment``, ``disc`` (C,) up by their ``ring`` (C,), as far as they are not OUTSIDE.

    flux         (S, 3) of the segments
    sums         (N, K, 6) of each disc's rings, three sums of the flux and of its square, which are counted up: what a
                 crossing needs is fetched at once
    part, parts  only every so-manieth stripe of discs is done, so that several threads share the work and each disc's
                 sums have the same order
    """
    for row in range(len(disc)):
        at = disc[row]
        if ring[row] != OUTSIDE and at // STRIPE % parts == part:
            came, where = segment[row], ring[row]
            for channel in range(3):
                value = flux[came, channel]
                sums[at, where, channel] += value
                sums[at, where, 3 + channel] += value * value


@njit("i8(i8[::1], i8[::1], b1[::1], u4[::1], i8, i8[::1], i8[::1])", nogil=True, cache=True, error_model="numpy")
def pick(segment, disc, kept, particle, every, picked_segment, picked_disc):
    """Write some of the crossings ``segment``, ``disc`` (C,) into the last two arguments (C,); returns how many.

    They are those that are ``kept`` (C,) and of every so-manieth ``particle`` (S,), a power of two.
    """
    count = 0
    for row in range(len(disc)):
        picked_segment[count], picked_disc[count] = segment[row], disc[row]
        count += kept[row] and (particle[segment[row]] & (every - 1)) == 0
    return count


@njit("void(i8[::1], i8[::1], u4[::1], f8[:,::1], f8[:,::1])", nogil=True, cache=True, error_model="numpy")
def repeated_products(segment, disc, particle, flux, found):
    """What estimator/repeated_crossings.py seeks among crossings ``segment``, ``disc`` (C,): ``found`` (N, 3) zeros.

    particle, flux  (S,), (S, 3) of the segments
    """
    behind = np.zeros(len(found) + 1, np.int64)
    for row in range(len(disc)):
        behind[disc[row] + 1] += 1
    for at in range(len(found)):
        behind[at + 1] += behind[at]
    # Disc by disc: the particle above, the crossing's row below.
    keys = np.empty(len(disc), np.int64)
    place = behind[:-1].copy()
    for row in range(len(disc)):
        keys[place[disc[row]]] = (np.int64(particle[segment[row]]) << 32) | row
        place[disc[row]] += 1
    for at in range(len(found)):
        mine = keys[behind[at] : behind[at + 1]]
        if len(mine) > 1:
            mine.sort()
            begin = 0
            for row in range(1, len(mine) + 1):
                if row == len(mine) or mine[row] >> 32 != mine[begin] >> 32:
                    if row > begin + 1:
                        for channel in range(3):
                            together = alone = 0.0
                            for one in range(begin, row):
                                value = flux[segment[mine[one] & 0xFFFFFFFF], channel]
                                together += value
                                alone += value * value
                            found[at, channel] += together * together - alone
                    begin = row
