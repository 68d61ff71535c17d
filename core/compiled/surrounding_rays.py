"""What surroundings do in shadow_rays and met: lights/environment.py and lights/emissive.py, ray by ray."""

from __future__ import annotations

import math

from numba import njit

from .vectors import CLOSEST, TINY, choose, in_triangle

_EDGE_ON = 1e-9  # as in core/lights/emissive.py


@njit(error_model="numpy")
def _above(ends, low, high, target):
    """The first place between ``low`` and ``high`` whose end is above ``target``, or ``high``."""
    while low < high:
        middle = (low + high) // 2
        if ends[middle] > target:
            high = middle
        else:
            low = middle + 1
    return low


@njit(
    "void(f8[:,:,::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[::1], f8[:,::1], f8[::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def aim_at_picture(picture, sums, ends, sines, uniforms, directions, distances, radiance, density):
    """EnvironmentWorld.shadow_rays, all of R rays written.

    picture     (H, W, 3) radiance; ``sums`` (H * W,) of the pixels' strengths, ``ends`` (H,) of the rows'
    sines       (H + 1,) of the latitudes of the rows' borders
    """
    width, lines, row = picture.shape[1], ends.reshape((1, len(ends))), 0
    for ray in range(len(uniforms)):
        row, up = choose(lines, 0, uniforms[ray, 1], row)
        start = ends[row - 1] if row > 0 else 0.0
        scaled = start + uniforms[ray, 0] * (ends[row] - start)
        pixel = _above(sums, row * width, row * width + width - 1, scaled)
        low = sums[pixel - 1] if pixel > 0 else 0.0
        part = sums[pixel] - low
        across = min(max((scaled - low) / part, 0.0), 1.0) if part > 0.0 else 0.0
        column = pixel - row * width
        azimuth = 2.0 * math.pi * (0.5 - (column + across) / width)
        z = sines[row] + up * (sines[row + 1] - sines[row])
        level = math.sqrt(max(1.0 - z * z, 0.0))
        directions[ray, 0] = level * math.cos(azimuth)
        directions[ray, 1] = level * math.sin(azimuth)
        directions[ray, 2] = z
        distances[ray] = math.inf
        strength = 0.0
        for channel in range(3):
            radiance[ray, channel] = picture[row, column, channel]
            strength = max(strength, abs(picture[row, column, channel]))
        chance = strength / max(sums[len(sums) - 1], TINY)
        density[ray] = chance if chance > 0.0 else 1.0


@njit(
    "void(f8[:,:,::1], f8, f8[:,::1], i8[::1], i4[::1], f8[:,::1], f8[::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def picture_met(picture, whole, directions, rows, triangle, radiance, density):
    """EnvironmentWorld.met for the ``rows`` (A,) of ``directions`` (R, 3), which met ``triangle`` (A,).

    ``radiance`` (A, 3) and ``density`` (A,) are written; ``whole`` is the sum of the pixels' strengths.
    """
    height, width = picture.shape[0], picture.shape[1]
    for place in range(len(rows)):
        density[place] = radiance[place, 0] = radiance[place, 1] = radiance[place, 2] = 0.0
        if triangle[place] >= 0:
            continue
        row = column = 0
        if height * width > 1:
            x, y, z = directions[rows[place], 0], directions[rows[place], 1], directions[rows[place], 2]
            up = math.atan2(z, math.hypot(x, y)) / math.pi + 0.5
            across = 0.5 - math.atan2(y, x) / (2.0 * math.pi)
            row, column = min(int(up * height), height - 1), min(int(across * width), width - 1)
        strength = 0.0
        for channel in range(3):
            radiance[place, channel] = picture[row, column, channel]
            strength = max(strength, abs(picture[row, column, channel]))
        density[place] = strength / whole


@njit(error_model="numpy")
def _seen(at, normals, areas, glow, whole, x, y, z, distance):
    """EmissiveTriangles._seen: the density, zero where nothing is seen."""
    cosine = abs(normals[at, 0] * x + normals[at, 1] * y + normals[at, 2] * z)
    strength = max(abs(glow[at, 0]), abs(glow[at, 1]), abs(glow[at, 2]))
    if cosine > _EDGE_ON and distance > CLOSEST and strength > 0.0 and areas[at] > 0.0:
        return strength * distance**2 / (cosine * whole)
    return 0.0


@njit(
    "void(f8[:,:,::1], f8[:,::1], f8[::1], f8[:,::1], f8[::1], f8[:,::1], i8[::1], i8, f8[:,::1],"
    " f8[:,::1], f8[::1], f8[:,::1], f8[::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def aim_at_triangles(
    corners, normals, areas, glow, shares, points, spot, count, uniforms, directions, distances, radiance, density
):
    """EmissiveTriangles.shadow_rays from ``points`` (K, 3), each ``spot`` (S,) of them ``count`` times; all written.

    corners, normals, areas, glow, shares   of the shining triangles: their radiance, and sums of their strengths
    """
    line, at = shares.reshape((1, len(shares))), 0
    for ray in range(len(uniforms)):
        at, first = choose(line, 0, uniforms[ray, 0], at)
        weights = in_triangle(first, uniforms[ray, 1])
        point = spot[ray // count]
        square = 0.0
        for axis in range(3):
            place = (
                weights[0] * corners[at, 0, axis]
                + weights[1] * corners[at, 1, axis]
                + weights[2] * corners[at, 2, axis]
            )
            directions[ray, axis] = place - points[point, axis]
            square += directions[ray, axis] ** 2
        distance = math.sqrt(square)
        for axis in range(3):
            nowhere = 1.0 if axis == 2 else 0.0
            directions[ray, axis] = directions[ray, axis] / distance if distance > CLOSEST else nowhere
        x, y, z = directions[ray, 0], directions[ray, 1], directions[ray, 2]
        chance = _seen(at, normals, areas, glow, shares[len(shares) - 1], x, y, z, distance)
        distances[ray] = distance
        density[ray] = chance if chance > 0.0 else 1.0
        for channel in range(3):
            radiance[ray, channel] = glow[at, channel] if chance > 0.0 else 0.0


@njit(
    "void(i8[::1], f8[:,::1], f8[::1], f8[:,::1], f8, f8[:,::1], i8[::1], i8, f8[:,::1], f8[:,::1], i8[::1], i4[::1],"
    " f4[::1], f4[::1], f8[:,::1], f8[::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def triangles_met(
    number, normals, areas, glow, whole, points, spot, count, directions, edged, rows, triangle, u, v, radiance, density
):
    """EmissiveTriangles.met for the ``rows`` (A,) of ``directions`` (R, 3), which met ``triangle`` (A,) at u, v (A,).

    ``number`` (T,) of each of the scene's triangles among those that shine, -1 for none; ``edged`` as in hits.py;
    ``radiance`` (A, 3) and ``density`` (A,) are written.
    """
    for place in range(len(rows)):
        density[place] = radiance[place, 0] = radiance[place, 1] = radiance[place, 2] = 0.0
        met = triangle[place]
        if met < 0 or number[met] < 0:
            continue
        at, ray = number[met], rows[place]
        point = spot[ray // count]
        square = 0.0
        for axis in range(3):
            hit = edged[met, axis] + float(u[place]) * edged[met, 3 + axis] + float(v[place]) * edged[met, 6 + axis]
            square += (hit - points[point, axis]) ** 2
        x, y, z = directions[ray, 0], directions[ray, 1], directions[ray, 2]
        chance = _seen(at, normals, areas, glow, whole, x, y, z, math.sqrt(square))
        # One that is seen edge-on has the density 1 and no radiance, as with NumPy.
        density[place] = chance if chance > 0.0 else 1.0
        for channel in range(3):
            radiance[place, channel] = glow[at, channel] if chance > 0.0 else 0.0
