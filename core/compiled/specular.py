"""Mirrors and glass for one particle: photons/specular.py, where the sources are, step by step."""

from __future__ import annotations

import math

from numba import njit

from .vectors import TINY, dot, full_turn, over_hemisphere, plus, times, unit, within_frame

LEAST_COSINE = 1e-9  # as in photons/specular.py


@njit(error_model="numpy", inline="always")
def _shading(normals, row, u, v, flat):
    """The unit shading normal at barycentric u, v of the specular triangle, or its geometric one ``flat``.

    normals  (S, 9) at the corners
    """
    found = (0.0, 0.0, 0.0)
    weights = max(1.0 - u - v, 0.0), max(u, 0.0), max(v, 0.0)
    for corner in range(3):
        at = 3 * corner
        found = plus(found, weights[corner], (normals[row, at], normals[row, at + 1], normals[row, at + 2]))
    length = math.sqrt(dot(found, found))
    return times(1.0 / length, found) if length > 0.0 else flat


@njit(error_model="numpy")
def _visible_normal(normal, towards, alpha, first, second):
    """The normal of a microfacet on a surface of that ``normal``, as it is seen from ``towards``."""
    nx, ny, nz = normal
    sign = math.copysign(1.0, nz)
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    along = dot(towards, (1.0 + sign * nx * nx * a, sign * b, -sign * nx))
    across = dot(towards, (b, sign + ny * ny * a, -ny))
    seen = unit((alpha * along, alpha * across, max(dot(towards, normal), LEAST_COSINE)))
    height = (1.0 - second) * (1.0 + seen[2]) - seen[2]
    ring = math.sqrt(min(max(1.0 - height * height, 0.0), 1.0))
    x, y = full_turn(first)
    local = plus(seen, 1.0, (ring * x, ring * y, height))
    x, y, z = unit((alpha * local[0], alpha * local[1], local[2]))
    return within_frame(normal, x, y, z)


@njit(error_model="numpy")
def _fresnel(cosine, ratio):
    """Reflectance, and the refracted ray's cosine."""
    beyond = math.sqrt(max(ratio * ratio - 1.0 + cosine * cosine, 0.0)) / ratio
    if not beyond > 0.0:
        return 1.0, beyond
    across = (cosine - ratio * beyond) / max(cosine + ratio * beyond, TINY)
    along = (ratio * cosine - beyond) / max(ratio * cosine + beyond, TINY)
    return 0.5 * (across * across + along * along), beyond


@njit(error_model="numpy", inline="always")
def facet(specular, row, u, v, normal, direction, first, second):
    """How light meets the surface: reflectance, and (flat, smooth, facet, cosine, ratio, beyond) for :func:`turned`.

    specular  normals (S, 9) at the corners, colours (S, 9) mirror, gloss and clear, optics (S, 2) index and roughness
    row, u, v, normal   the specular triangle, where it is met, and its geometric normal
    """
    normals, _, optics = specular
    front = dot(normal, direction) < 0.0
    side = 1.0 if front else -1.0
    flat, smooth = times(side, normal), times(side, _shading(normals, row, u, v, normal))
    if not dot(smooth, direction) < 0.0:
        smooth = flat
    micro = _visible_normal(smooth, times(-1.0, direction), optics[row, 1], first, second)
    cosine = min(max(-dot(micro, direction), 0.0), 1.0)
    ratio = optics[row, 0] if front else 1.0 / optics[row, 0]
    reflectance, beyond = _fresnel(cosine, ratio)
    return reflectance, (flat, smooth, micro, cosine, ratio, beyond)


@njit(error_model="numpy", inline="always")
def shares(colours, row, reflectance):
    """What is mirrored and what is refracted, RGB each."""
    mirrored = (
        colours[row, 0] + reflectance * colours[row, 3],
        colours[row, 1] + reflectance * colours[row, 4],
        colours[row, 2] + reflectance * colours[row, 5],
    )
    return mirrored, times(1.0 - reflectance, (colours[row, 6], colours[row, 7], colours[row, 8]))


@njit(error_model="numpy", inline="always")
def turned(met, mirrored, direction, alpha, uniforms, row):
    """The direction of what is ``mirrored``, or else refracted; ``met`` as from :func:`facet`.

    uniforms  (K, 5), of which the last three numbers of that row are used
    """
    flat, smooth, micro, cosine, ratio, beyond = met
    arriving = -dot(smooth, direction)
    if mirrored:
        found = plus(direction, 2.0 * cosine, micro)
    else:
        flat, smooth = times(-1.0, flat), times(-1.0, smooth)
        found = plus(times(1.0 / ratio, direction), cosine / ratio - beyond, micro)
    leaving = dot(smooth, found)
    before, behind = _shadowing(abs(arriving), alpha), _shadowing(abs(leaving), alpha)
    if leaving < 0.0 or uniforms[row, 2] * (1.0 + before + behind) >= 1.0 + before:
        found = over_hemisphere(flat, uniforms[row, 3], uniforms[row, 4])
    return plus(found, -2.0 * min(dot(flat, found), 0.0), flat)


@njit(error_model="numpy")
def _shadowing(cosine, alpha):
    """Smith's Lambda."""
    cosine = max(cosine, LEAST_COSINE)
    return 0.5 * (math.sqrt(1.0 + alpha * alpha * (1.0 / (cosine * cosine) - 1.0)) - 1.0)
