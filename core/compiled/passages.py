"""Rays that pass straight through clear surfaces: direct/shadows.py between two casts of rays."""

from __future__ import annotations

import math

from numba import njit

_FAR = 1e30  # as in core/rays.py


@njit(
    "void(i8[::1], i4[::1], f4[::1], f4[::1], f8[:,::1], f4[:,::1], f4[::1], f8[::1], f8)",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def cut_beyond(rows, triangle, u, v, edged, near, reach, centre, scale):
    """Set ``triangle`` (A,) to -1 where the ``rows`` (A,) of rays met it no nearer than their reach.

    near, reach     (R, 3), (R,) of all rays, as Embree has them; ``edged`` as in hits.py
    """
    for place in range(len(rows)):
        at, row = triangle[place], rows[place]
        if at < 0 or reach[row] >= _FAR:
            continue
        square = 0.0
        for axis in range(3):
            hit = edged[at, axis] + float(u[place]) * edged[at, 3 + axis] + float(v[place]) * edged[at, 6 + axis]
            square += ((hit - centre[axis]) * scale - near[row, axis]) ** 2
        if math.sqrt(square) >= reach[row]:
            triangle[place] = -1


@njit(
    "i8(i8[::1], i4[::1], f4[::1], f4[::1], f8[:,::1], f8[:,::1], f8[:,::1], f4[:,::1], f8, f8[::1], f8,"
    " f8[:,::1], i8[::1], f8[:,::1], f4[:,::1], f4[:,::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def passed(
    rows, triangle, u, v, edged, normals, transmittance, towards, tolerance, centre, scale, share,
    next_rows, next_share, next_near, next_towards,
):  # fmt: skip
    """Which rays go on behind what they met: their number.

    rows, share     (A,), (A, 3) who they are, and how much light came through so far
    towards         (R, 3) of all rays; ``tolerance`` metres behind the surface they start anew
    next_rows, next_share, next_near, next_towards  the same of those that go on, written
    """
    going = 0
    for place in range(len(rows)):
        at = triangle[place]
        if at < 0:
            continue
        row, most = rows[place], 0.0
        for channel in range(3):
            next_share[going, channel] = share[place, channel] * transmittance[at, channel]
            most = max(most, next_share[going, channel])
        if most <= 0.0:
            continue
        along = 0.0
        for axis in range(3):
            along += normals[at, axis] * towards[row, axis]
        side = math.copysign(tolerance, along)
        for axis in range(3):
            hit = edged[at, axis] + float(u[place]) * edged[at, 3 + axis] + float(v[place]) * edged[at, 6 + axis]
            next_near[going, axis] = (hit + side * normals[at, axis] - centre[axis]) * scale
            next_towards[going, axis] = towards[row, axis]
        next_rows[going] = row
        going += 1
    return going


@njit("void(i8[::1], i4[::1], f8[:,::1], b1[::1], f8[:,::1])", nogil=True, cache=True, error_model="numpy")
def let_through(rows, triangle, share, blocked, arriving):
    """The ``rows`` (A,) that met no ``triangle`` are not ``blocked`` (R,), and what is ``arriving`` (R, 3) is dimmed.

    share  (A, 3) of the light that came through
    """
    for place in range(len(rows)):
        if triangle[place] < 0:
            blocked[rows[place]] = False
            for channel in range(3):
                arriving[rows[place], channel] *= share[place, channel]
