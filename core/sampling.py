"""Uniform numbers turned into points, directions and choices; every mapping is deterministic."""

from __future__ import annotations

import numpy as np

from .bounds import Bounds

#: The largest float64 below one, so that a rescaled uniform stays inside [0, 1).
BELOW_ONE = np.nextafter(1.0, 0.0)

#: Steps of a lattice of rank one: any number of its first points covers the unit square evenly.
LATTICE = np.array([0.7548776662466927, 0.5698402909980532])


def frames(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (..., 3) that make a right-handed orthonormal frame with each unit normal (..., 3).

    Source: Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
    """
    x, y, z = normals[..., 0], normals[..., 1], normals[..., 2]
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    second = np.stack([b, sign + y * y * a, -y], axis=-1)
    return first, second


def disc(uniforms: np.ndarray) -> np.ndarray:
    """Points (P, 2) uniform in the unit disc from uniforms (P, 2), by the concentric map (Shirley and Chiu 1997)."""
    square = 2.0 * uniforms - 1.0
    x, y = square[:, 0], square[:, 1]
    wide = np.abs(x) > np.abs(y)
    radius = np.where(wide, x, y)
    divisor = np.where(radius == 0.0, 1.0, radius)
    angle = np.where(wide, 0.25 * np.pi * (y / divisor), 0.5 * np.pi - 0.25 * np.pi * (x / divisor))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def triangle(uniforms: np.ndarray) -> np.ndarray:
    """Barycentric weights (P, 3) of points uniform in a triangle, from uniforms (P, 2)."""
    root = np.sqrt(uniforms[:, 0])
    second = root * uniforms[:, 1]
    return np.stack([1.0 - root, root - second, second], axis=1)


def around(axes: np.ndarray, fall: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Unit vectors (P, 3) at an angle t from unit ``axes`` (P, 3) or (3,), with ``fall`` (P,) = 1 - cos t.

    ``turn`` (P,) in [0, 1) is the share of a full turn about the axis. Taking 1 - cos t instead of cos t keeps
    narrow cones exact.
    """
    first, second = frames(axes)
    sine = np.sqrt(np.maximum(fall * (2.0 - fall), 0.0))
    angle = 2.0 * np.pi * turn
    return combined(np.stack([sine * np.cos(angle), sine * np.sin(angle)], axis=1), 1.0 - fall, first, second, axes)


def cosine_hemisphere(normals: np.ndarray, uniforms: np.ndarray) -> np.ndarray:
    """Directions (P, 3) about unit ``normals`` (P, 3) or (3,), density cos(t)/pi per solid angle; uniforms (P, 2)."""
    # The disc's map makes the larger one the radius: from it, directions near the rim have all their digits.
    size = np.abs(2.0 * uniforms - 1.0)
    radius = np.maximum(size[:, 0], size[:, 1])
    return combined(disc(uniforms), np.sqrt((1.0 - radius) * (1.0 + radius)), *frames(normals), normals)


def combined(flat: np.ndarray, height: np.ndarray, first, second, normals) -> np.ndarray:
    """Vectors (P, 3) with the coordinates ``flat`` (P, 2) along ``first`` and ``second``, and ``height`` (P,) along
    ``normals``, each (P, 3) or (3,). Axis by axis, since NumPy is slow along short ones."""
    found = np.empty((len(height), 3))
    for axis in range(3):
        column = flat[:, 0] * first[..., axis]
        column += flat[:, 1] * second[..., axis]
        column += height * normals[..., axis]
        found[:, axis] = column
    return found


def sphere(uniforms: np.ndarray) -> np.ndarray:
    """Directions (P, 3) uniform over the sphere, from uniforms (P, 2)."""
    return around(np.array([0.0, 0.0, 1.0]), 2.0 * uniforms[:, 0], uniforms[:, 1])


def cone(axes: np.ndarray, half_angle: float, uniforms: np.ndarray) -> np.ndarray:
    """Directions (P, 3) uniform by solid angle within ``half_angle`` radians of unit ``axes``; uniforms (P, 2)."""
    fall = 2.0 * np.sin(0.5 * half_angle) ** 2
    return around(axes, fall * uniforms[:, 0], uniforms[:, 1])


def spherical_rectangle(
    low: np.ndarray, high: np.ndarray, height: np.ndarray, uniforms: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Places (K, 2) on rectangles, uniform by the solid angle seen from ``height`` (K,) > 0 above the origin.

    ``low`` and ``high`` (K, 2) are the corners in the rectangle's plane; uniforms (K, 2). Returns also the solid angles
    (K,) in sr, exact to some 1e-15: below 1e-4 the places lose their digits. Source: Urena, Fajardo and King, "An
    Area-Preserving Parametrization for Spherical Rectangles", Computer Graphics Forum 32(4), 2013.
    """
    x0, y0 = (low / np.hypot(low, height[:, None])).T
    x1, y1 = (high / np.hypot(high, height[:, None])).T
    # The four angles of the spherical rectangle; the first two face its high side in x, the others the low side.
    angles = np.arccos(np.clip([y0 * x1, -x1 * y1, y1 * x0, -x0 * y0], -1.0, 1.0))
    solid_angle = np.maximum(angles.sum(axis=0) - 2.0 * np.pi, 0.0)
    turn = 2.0 * np.pi - angles[2] - angles[3] + uniforms[:, 0] * solid_angle
    tiny, sine = 1e-100, np.sin(turn)
    slope = -(np.cos(turn) * y0 + y1) / np.where(np.abs(sine) < tiny, tiny, sine)
    squared = slope**2 - height**2 / (height**2 + low[:, 1] ** 2)
    x = np.clip(np.copysign(height / np.sqrt(np.maximum(squared, tiny)), slope), low[:, 0], high[:, 0])
    away = np.hypot(x, height)
    first, last = low[:, 1] / np.hypot(away, low[:, 1]), high[:, 1] / np.hypot(away, high[:, 1])
    share = first + uniforms[:, 1] * (last - first)
    y = np.clip(share * away / np.sqrt(np.maximum(1.0 - share**2, tiny)), low[:, 1], high[:, 1])
    return np.stack([x, y], axis=1), solid_angle


def choose(cumulative: np.ndarray, uniforms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Choose rows in proportion to weights >= 0, given as their running sum ``cumulative`` (K,), K >= 1.

    Returns the chosen row (P,) for each of ``uniforms`` (P,), and the uniforms rescaled within the choice,
    again uniform in [0, 1). A row of weight zero is never chosen, unless all are: then it is row 0.
    """
    scaled = uniforms * cumulative[-1]
    last = np.searchsorted(cumulative, cumulative[-1], side="left")
    chosen = np.minimum(np.searchsorted(cumulative, scaled, side="right"), last)
    start = np.where(chosen > 0, cumulative[chosen - 1], 0.0)
    return chosen, _rescaled(scaled - start, cumulative[chosen] - start)


def running_shares(weights: np.ndarray) -> np.ndarray:
    """Running sums (K * C,) over each row of ``weights`` (K, C) >= 0, as shares of all of it: each row's go on from its
    number, so that all together ascend."""
    ends = np.cumsum(weights, axis=1)
    ends /= ends[:, -1:]
    return (ends + np.arange(len(ends))[:, None]).ravel()


def choose_in_rows(
    ends: np.ndarray, columns: int, row: np.ndarray, uniforms: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Choose in proportion to the weights of each ``row`` (P,), given as :func:`running_shares` over ``columns``.

    Returns the chosen place (P,) among ``ends``, that is row * columns + column, for each of ``uniforms`` (P,), and
    the uniforms rescaled within the choice.
    """
    target = row + uniforms
    place = np.clip(np.searchsorted(ends, target, side="right"), row * columns, row * columns + (columns - 1))
    start = np.where(place % columns > 0, ends[place - 1], row)
    return place, _rescaled(target - start, ends[place] - start)


def face_points(bounds: Bounds, axis: np.ndarray, upper: np.ndarray, uniforms: np.ndarray) -> np.ndarray:
    """Points (P, 3) uniform on faces of a box: perpendicular to ``axis`` (P,), at its ``upper`` end (P,) or the lower.

    uniforms (P, 2).
    """
    rows = np.arange(len(axis))
    shares = np.empty((len(axis), 3))
    shares[rows, axis] = upper
    shares[rows, (axis + 1) % 3] = uniforms[:, 0]
    shares[rows, (axis + 2) % 3] = uniforms[:, 1]
    return (1.0 - shares) * bounds.lower + shares * bounds.upper


def projected_area(bounds: Bounds, directions: np.ndarray) -> np.ndarray:
    """Area (P,) in m^2 of the box's shadow along each of ``directions`` (P, 3) on a plane perpendicular to it."""
    return np.abs(directions) @ bounds.face_areas


def box_entry(bounds: Bounds, directions: np.ndarray, uniforms: np.ndarray) -> np.ndarray:
    """Points (P, 3) where parallel rays of the given ``directions`` (P, 3) enter the box, uniform over its shadow.

    uniforms (P, 2); the first chooses between the up to three faces that the rays enter through.
    """
    reach = np.cumsum(np.abs(directions) * bounds.face_areas, axis=1)
    scaled = uniforms[:, 0] * reach[:, 2]
    axis = (scaled >= reach[:, 0]).astype(np.int64) + (scaled >= reach[:, 1])
    # Rounding up to the full sum must not lead to a face of no area.
    axis = np.minimum(axis, (reach < reach[:, 2:]).sum(axis=1))
    rows = np.arange(len(directions))
    start = np.where(axis > 0, reach[rows, axis - 1], 0.0)
    within = _rescaled(scaled - start, reach[rows, axis] - start)
    return face_points(bounds, axis, directions[rows, axis] < 0.0, np.stack([within, uniforms[:, 1]], axis=1))


def _rescaled(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """``part / whole`` inside [0, 1); zero where the whole is zero."""
    return np.clip(np.divide(part, whole, out=np.zeros_like(part), where=whole > 0.0), 0.0, BELOW_ONE)


def hemisphere_uniforms(flat: np.ndarray) -> np.ndarray:
    """The uniforms (P, 2) that :func:`disc` makes points ``flat`` (P, 2) of the unit disc from, to rounding."""
    x, y = flat[:, 0], flat[:, 1]
    wide = np.abs(x) > np.abs(y)
    longer, shorter = np.where(wide, x, y), np.where(wide, y, x)
    radius = np.copysign(np.hypot(x, y), longer)
    aside = (4.0 / np.pi) * radius * np.arctan(shorter / np.where(longer == 0.0, 1.0, longer))
    square = np.stack([np.where(wide, radius, aside), np.where(wide, aside, radius)], axis=1)
    return np.clip(0.5 * (square + 1.0), 0.0, 1.0)
