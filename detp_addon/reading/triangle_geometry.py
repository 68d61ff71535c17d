"""Areas and directions of triangles, and what a matrix does to normals; NumPy only."""

from __future__ import annotations

import numpy as np

from ...core.group_sums import group_sums
from ...core.triangles import angles_between, cross, dots

#: a triangle whose area is below this share of its longest edge squared is a line: it has no direction left
LEAST_AREA = 1e-12

#: cosine between a face's normal and that of its corner below which the back of the face is meant
_BEHIND = -0.05


def safe_unit(vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``vectors`` (N, 3) at unit length, zero where they have no direction, and which have one (N,)."""
    with np.errstate(all="ignore"):
        largest = np.abs(vectors).max(axis=1, initial=0.0)
        valid = np.isfinite(largest) & (largest > 0.0)
        # Scaled first, so that tiny and huge vectors keep their digits.
        scaled = np.where(valid[:, None], vectors / largest[:, None], 0.0)
        return scaled / np.sqrt(dots(scaled, scaled) + ~valid)[:, None], valid


def has_area(corners: np.ndarray) -> np.ndarray:
    """Whether triangles with these corners (T, 3, 3) have an area that gives them a direction."""
    first = corners[:, 1] - corners[:, 0]
    second = corners[:, 2] - corners[:, 1]
    third = corners[:, 0] - corners[:, 2]
    longest = np.maximum(np.maximum(dots(first, first), dots(second, second)), dots(third, third))
    area = cross(first, second)
    return np.sqrt(dots(area, area)) > LEAST_AREA * longest


def sides_meant(facing: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Unit normals (N, 3) of faces along ``facing`` (N, 3), or their backs where ``normals`` (N, 3) are clearly there.

    Where faces cancel out, the points' normals.
    """
    facing, known = safe_unit(facing)
    facing = np.where(dots(facing, normals) < _BEHIND, -1.0, 1.0)[:, None] * facing
    return np.where(known[:, None], facing, normals)


def weights_within(corners: np.ndarray, flat: np.ndarray, places: np.ndarray) -> np.ndarray:
    """How much (N, 3) >= 0 each of the ``corners`` (N, 3, 3) of triangles with normals ``flat`` (N, 3) counts at
    ``places`` (N, 3) on them; sums are twice their areas."""
    first, second = (np.roll(corners, -step, axis=1) - places[:, None] for step in (1, 2))
    areas = np.einsum("nci,ni->nc", np.cross(first, second), flat)
    return np.maximum(areas, 0.0)


def directions_around(corners: np.ndarray, flat: np.ndarray, vertices: np.ndarray, count: int) -> np.ndarray:
    """Mean unit normals (V, 3) around each of ``count`` vertices, by the angles of the triangles that meet there.

    Triangles have these ``corners`` (T, 3, 3), unit normals ``flat`` (T, 3) and ``vertices`` (T, 3). Zero where they
    cancel out.
    """
    onward, back = (np.roll(corners, step, axis=1) - corners for step in (-1, 1))
    angles = angles_between(onward.reshape(-1, 3), back.reshape(-1, 3))
    return safe_unit(group_sums(np.repeat(flat, 3, axis=0), vertices.ravel(), count, angles))[0]


def facing_in_hollows(
    corners: np.ndarray, flat: np.ndarray, around: np.ndarray, weights: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """How a surface faces (N, 3) at places on triangles with ``corners`` (N, 3, 3), each of which counts by ``weights``
    (N, 3) there: as the triangle, by its unit normal ``flat`` (N, 3), or in hollows as the surface as a whole.

    Where its neighbours rise before the triangle, smooth shading stands for a rounding before it. There the mean
    normals ``around`` its corners (N, 3, 3) count, if they are nearer to the shading ``normals`` (N, 3): no light is
    sought behind the rounding, and none is lost behind the triangle.
    """
    inward = corners.mean(axis=1, keepdims=True) - corners
    rises = np.einsum("nci,nci->nc", around, inward) > 0.0
    as_whole = safe_unit(np.einsum("nc,nci->ni", weights, np.where(rises[..., None], around, flat[:, None])))[0]
    nearer = dots(as_whole, normals) > dots(flat, normals)
    return np.where(nearer[:, None], as_whole, flat)


def determinants(matrices: np.ndarray) -> np.ndarray:
    """Determinants (K,) of the linear parts of ``matrices`` (K, 3 or 4, 3 or 4)."""
    (a, b, c), (d, e, f), (g, h, i) = matrices[:, :3, :3].transpose(1, 2, 0)
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def normal_matrices(matrices: np.ndarray) -> np.ndarray:
    """What takes normals through ``matrices`` (K, 4, 4): the inverse transposed up to a positive factor, (K, 3, 3).

    Made of cofactors, so that it also serves objects scaled to nothing along one axis.
    """
    linear = matrices[:, :3, :3]
    linear = linear / np.maximum(np.abs(linear).max(axis=(1, 2), keepdims=True), 1e-300)
    rows = cross(linear[:, [1, 2, 0]].reshape(-1, 3), linear[:, [2, 0, 1]].reshape(-1, 3)).reshape(-1, 3, 3)
    return np.where(determinants(linear)[:, None, None] >= 0.0, rows, -rows)
