"""Where rays meet triangles, from barycentric coordinates."""

from __future__ import annotations

from numba import njit


@njit("void(f8[:,::1], i8[::1], f4[::1], f4[::1], f8[:,::1])", nogil=True, cache=True, error_model="numpy")
def hit_points(edged, triangle, u, v, points):
    """Write the ``points`` (R, 3) at the coordinates ``u``, ``v`` (R,) of ``triangle`` (R,); those of -1 stay.

    edged  (T, 9) a corner of each triangle and the two edges from it
    """
    for row in range(len(triangle)):
        at = triangle[row]
        if at >= 0:
            for axis in range(3):
                points[row, axis] = (
                    edged[at, axis] + float(u[row]) * edged[at, 3 + axis] + float(v[row]) * edged[at, 6 + axis]
                )
