"""The one test that says whether a segment crosses a tangent disc."""

from __future__ import annotations

import numpy as np


def crosses(origins, ends, centres, normals, radii) -> np.ndarray:
    """Whether each segment crosses its disc from the front, as booleans of shape (...).

    origins, ends, centres and normals are (..., 3) and radii (...); they broadcast against each other.
    With the segment's vector s = end - origin (not normalised) and w = centre - origin, the segment meets
    the disc's plane at t = (w.n)/(s.n), 0 <= t <= 1, and there lies within the radius d of the centre when

        |s (w.n) - w (s.n)|^2 <= d^2 (s.n)^2

    so no division is made, t is compared by sign, and a NaN or an infinite coordinate gives False. Arriving from
    the front means s.n < 0. The centre is subtracted first, in float64, which keeps the test exact far from the
    origin. Sums are written out, so that every gatherer gets the same bits for the same pair.

    The answer is that of exact arithmetic on the same float64 numbers unless, with u = 2^-53 and cos = |s.n|/|s||n|,
    the segment passes the rim within 32 u (|w| + d)/cos of it, or an end of the segment lies within 8 u (|w| + |s|)
    of the plane, or cos is less than 8 u.
    """
    # Component by component: whole columns are read at once when the caller's rows are transposed views.
    sx, sy, sz = (ends[..., axis] - origins[..., axis] for axis in range(3))
    wx, wy, wz = (centres[..., axis] - origins[..., axis] for axis in range(3))
    nx, ny, nz = (normals[..., axis] for axis in range(3))
    facing = sx * nx + sy * ny + sz * nz
    height = wx * nx + wy * ny + wz * nz
    dx = sx * height - wx * facing
    dy = sy * height - wy * facing
    dz = sz * height - wz * facing
    reach = radii * facing
    # A difference and not a comparison: that of two infinities is NaN, which is no crossing.
    room = reach * reach - (dx * dx + dy * dy + dz * dz)
    return (facing < 0) & (height <= 0) & (height >= facing) & (room >= 0)
