"""A ray from a point to a place on a lamp: what core/lights/ do in shadow_rays, by rows of direct/lamp_table.py."""

from __future__ import annotations

import math

from numba import njit

from .vectors import CLOSEST, TINY, about, in_disc

POINT, BALL, SOFT, PARALLEL, CONE, AREA = range(6)  # as in core/direct/lamp_table.py

_LEAST = 1e-100  # as in sampling.spherical_rectangle
_ELLIPSE = 0.25 * math.pi


@njit(error_model="numpy")
def lamp_ray(row, x, y, z, u, v):
    """Direction (3), distance and what the colour of the lamp's ``row`` is to be multiplied by: radiance over density.

    From the point x, y, z by the uniform numbers u, v; zero where the lamp does not shine that way.
    """
    kind = int(row[0])
    if kind == PARALLEL:
        return row[4], row[5], row[6], math.inf, 1.0
    if kind == CONE:
        dx, dy, dz = about((row[4], row[5], row[6]), row[7] * u, v)
        return dx, dy, dz, math.inf, 2.0 * math.pi * row[7]
    if kind == AREA:
        return _to_area(row, x, y, z, u, v)
    ax, ay, az, distance = _towards(row[4] - x, row[5] - y, row[6] - z)
    if kind == POINT:
        dx, dy, dz, reach = ax, ay, az, distance
        weight = 1.0 / (4.0 * math.pi * distance * distance) if distance > CLOSEST else 0.0
    else:
        fall, part, reach = _ball(kind == SOFT, distance, row[7], u)
        dx, dy, dz = about((ax, ay, az), part, v)
        weight = 2.0 * math.pi * fall / (2.0 * math.pi * row[7]) ** 2
    if row[8] != 0.0:
        weight *= _cone_share(row, -dx, -dy, -dz)
    return dx, dy, dz, reach, weight


@njit(error_model="numpy")
def _towards(x, y, z):
    distance = math.sqrt(x * x + y * y + z * z)
    if distance <= CLOSEST:
        return 0.0, 0.0, 1.0, distance
    return x / distance, y / distance, z / distance, distance


@njit(error_model="numpy")
def _ball(soft, distance, radius, u):
    """lights.aim.rays_to_ball: 1 - cos of the cone and of the ray, and how far the ray goes."""
    if soft:
        slant = math.hypot(distance, radius)
        fall = radius**2 / (slant * (slant + distance))
        part = fall * u
        return fall, part, min(distance / max(1.0 - part, TINY), slant)
    inside = distance <= radius
    square = 0.0 if inside else (radius / distance) ** 2
    fall = 2.0 if inside else square / (1.0 + math.sqrt(1.0 - square))
    part = fall * u
    chord = math.sqrt(max(radius**2 - distance**2 * part * (2.0 - part), 0.0))
    far = distance * (1.0 - part) + chord
    if inside:
        return fall, part, max(far, 0.0)
    return fall, part, (distance - radius) * ((distance + radius) / max(far, distance - radius))


@njit(error_model="numpy")
def _cone_share(row, x, y, z):
    """SpotLight._share"""
    a = (row[9] * x + row[10] * y + row[11] * z) ** 2
    b = (row[12] * x + row[13] * y + row[14] * z) ** 2
    ahead = row[15] * x + row[16] * y + row[17] * z
    c = ahead * ahead
    whole = a + b + c
    fall = (a / whole + b / whole) / (1.0 + math.sqrt(c / whole)) if ahead < 0.0 else 1.0
    rim = row[19]
    if rim <= TINY:
        return 1.0 if fall < row[18] else 0.0
    t = min(max(row[18] - fall, 0.0), rim) / rim
    return t * t * (3.0 - 2.0 * t)


@njit(error_model="numpy")
def _to_area(row, x, y, z, u, v):
    """AreaLight.shadow_rays"""
    ox, oy, oz = x - row[4], y - row[5], z - row[6]
    height = ox * row[7] + oy * row[8] + oz * row[9]
    foot_u = ox * row[16] + oy * row[17] + oz * row[18]
    foot_v = ox * row[19] + oy * row[20] + oz * row[21]
    tangent, ellipse = row[24], row[27] != 0.0
    if height <= row[23]:
        return 0.0, 0.0, 1.0, 0.0, 0.0
    if row[26] != 0.0:
        lit = 1.0 if _covers(ellipse, foot_u, foot_v) else 0.0
        return -row[7], -row[8], -row[9], height, lit
    low_u, high_u = _seen(foot_u, height * (tangent * row[31]))
    low_v, high_v = _seen(foot_v, height * (tangent * row[32]))
    wide, tall = high_u - low_u, high_v - low_v
    low_u, low_v, high_u, high_v = low_u - foot_u, low_v - foot_v, high_u - foot_u, high_v - foot_v
    filled = wide * tall
    area = filled * (row[22] / (_ELLIPSE if ellipse else 1.0))
    solid_angle, p, q = 0.0, low_u + u * wide, low_v + v * tall
    if row[28] != 0.0:
        k, m = row[29], row[30]
        a, b, solid_angle = _rectangle(low_u * k, low_v * m, high_u * k, high_v * m, height, u, v)
        if solid_angle < row[33]:
            solid_angle = 0.0
        else:
            p, q = a / k, b / m
    if ellipse:
        if solid_angle == 0.0 and filled > _ELLIPSE:
            area = row[22]
            a, b = in_disc(u, v)
            p, q = 0.5 * a - foot_u, 0.5 * b - foot_v
        elif not _covers(ellipse, foot_u + p, foot_v + q):
            area = 0.0
    if not area > 0.0:
        return 0.0, 0.0, 1.0, 0.0, 0.0
    fx, fy, fz = p * row[10] + q * row[13], p * row[11] + q * row[14], p * row[12] + q * row[15]
    dx, dy, dz, distance = _towards(fx - height * row[7], fy - height * row[8], fz - height * row[9])
    strength = 1.0 / math.pi
    if tangent < math.inf:
        slope = math.sqrt(fx * fx + fy * fy + fz * fz) / height
        strength *= max(tangent - slope, 0.0) / row[25]
    weight = solid_angle if solid_angle > 0.0 else height * area / distance**3
    return dx, dy, dz, distance, strength * weight


@njit(error_model="numpy")
def _seen(foot, reach):
    low = max(-0.5, foot - reach)
    return low, max(min(0.5, foot + reach), low)


@njit(error_model="numpy")
def _covers(ellipse, p, q):
    if ellipse:
        return p * p + q * q <= 0.25
    return abs(p) <= 0.5 and abs(q) <= 0.5


@njit(error_model="numpy")
def _rectangle(low_u, low_v, high_u, high_v, height, u, v):
    """sampling.spherical_rectangle"""
    x0, y0 = low_u / math.hypot(low_u, height), low_v / math.hypot(low_v, height)
    x1, y1 = high_u / math.hypot(high_u, height), high_v / math.hypot(high_v, height)
    third, fourth = _arc(y1 * x0), _arc(-x0 * y0)
    solid_angle = max(_arc(y0 * x1) + _arc(-x1 * y1) + third + fourth - 2.0 * math.pi, 0.0)
    turn = 2.0 * math.pi - third - fourth + u * solid_angle
    sine = math.sin(turn)
    slope = -(math.cos(turn) * y0 + y1) / (_LEAST if abs(sine) < _LEAST else sine)
    squared = slope * slope - height * height / (height * height + low_v * low_v)
    x = min(max(math.copysign(height / math.sqrt(max(squared, _LEAST)), slope), low_u), high_u)
    away = math.hypot(x, height)
    first, last = low_v / math.hypot(away, low_v), high_v / math.hypot(away, high_v)
    share = first + v * (last - first)
    y = min(max(share * away / math.sqrt(max(1.0 - share * share, _LEAST)), low_v), high_v)
    return x, y, solid_angle


@njit(error_model="numpy")
def _arc(cosine):
    return math.acos(min(max(cosine, -1.0), 1.0))
