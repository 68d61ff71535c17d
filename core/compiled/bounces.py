"""What diffuse surfaces do to particles between two casts of rays: the steps of photons/tracing.py in one pass each."""

from __future__ import annotations

import math

from numba import njit


@njit(
    "i8(i4[::1], f4[::1], f4[::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8, f8,"
    " f8[::1], f8, f8[:,::1], i8[::1], f8[:,::1], f8[:,::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def meet(
    triangle, u, v, edged, normals, albedo, origins, directions, flux, choice, past, grazing, centre, radius,
    ends, rows, kept, points,
):  # fmt: skip
    """Where segments end, and which particles are reflected: their number K.

    triangle, u, v       (R,) what the rays met and where, -1 for nothing
    edged, normals, albedo   of the triangles; edged as in core/compiled/hits.py
    origins, directions, flux    (R, 3) of the particles
    choice               uniform numbers, one for each particle that met something
    past, grazing        how far segments reach behind their hit along the normal, and the least cosine
    centre, radius       of everything, which segments without a hit leave
    ends                 (R, 3) written
    rows, kept, points   (R,), (R, 3), (R, 3) written up to K: who is reflected, with which flux, and where
    """
    met = alive = 0
    for row in range(len(triangle)):
        x, y, z = directions[row, 0], directions[row, 1], directions[row, 2]
        at = triangle[row]
        if at < 0:
            away = 0.0
            for axis in range(3):
                away += (origins[row, axis] - centre[axis]) ** 2
            reach = math.sqrt(away) + radius
            for axis in range(3):
                ends[row, axis] = origins[row, axis] + reach * directions[row, axis]
            continue
        cosine = abs(normals[at, 0] * x + normals[at, 1] * y + normals[at, 2] * z)
        behind = past / max(cosine, grazing)
        for axis in range(3):
            place = edged[at, axis] + float(u[row]) * edged[at, 3 + axis] + float(v[row]) * edged[at, 6 + axis]
            points[alive, axis] = place
            ends[row, axis] = place + behind * directions[row, axis]
        largest = going = 0.0
        for channel in range(3):
            kept[alive, channel] = flux[row, channel] * albedo[at, channel]
            largest = max(largest, abs(flux[row, channel]))
            going = max(going, abs(kept[alive, channel]))
        chance = min(going / max(largest, 2.2250738585072014e-308), 1.0)
        if choice[met] < chance:
            for channel in range(3):
                kept[alive, channel] /= chance
            rows[alive] = row
            alive += 1
        met += 1
    return alive


@njit(
    "void(i8[::1], i4[::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], f8, f8[::1], f8, f8[:,::1], f8[:,::1],"
    " f4[:,::1], f4[:,::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def reflect(rows, triangle, normals, before, points, uniforms, away, centre, scale, origins, directions, near, towards):
    """Cosine-distributed directions off the surfaces: sampling.disc, sampling.frames and sampling.cosine_hemisphere.

    rows, triangle, before   (K,), (R,), (R, 3): who goes on, what all met and their directions until then
    points, uniforms         (K, 3), (K, 2): where they start, but ``away`` metres off, and what decides
    origins, directions      (K, 3) written; ``near``, ``towards`` the same for Embree, less ``centre``, times ``scale``
    """
    for row in range(len(rows)):
        who = rows[row]
        at = triangle[who]
        nx, ny, nz = normals[at, 0], normals[at, 1], normals[at, 2]
        along = nx * before[who, 0] + ny * before[who, 1] + nz * before[who, 2]
        side = -math.copysign(1.0, along)
        nx, ny, nz = side * nx, side * ny, side * nz
        p, q = 2.0 * uniforms[row, 0] - 1.0, 2.0 * uniforms[row, 1] - 1.0
        if abs(p) > abs(q):
            length, angle = p, 0.25 * math.pi * (q / p)
        else:
            length, angle = q, 0.5 * math.pi - 0.25 * math.pi * (p / (q if q != 0.0 else 1.0))
        x, y = length * math.cos(angle), length * math.sin(angle)
        height = math.sqrt(max(1.0 - x * x - y * y, 0.0))
        sign = math.copysign(1.0, nz)
        a = -1.0 / (sign + nz)
        b = nx * ny * a
        directions[row, 0] = x * (1.0 + sign * nx * nx * a) + y * b + height * nx
        directions[row, 1] = x * (sign * b) + y * (sign + ny * ny * a) + height * ny
        directions[row, 2] = x * (-sign * nx) + y * (-ny) + height * nz
        origins[row, 0] = points[row, 0] + away * nx
        origins[row, 1] = points[row, 1] + away * ny
        origins[row, 2] = points[row, 2] + away * nz
        for axis in range(3):
            near[row, axis] = (origins[row, axis] - centre[axis]) * scale
            towards[row, axis] = directions[row, axis]
