"""Geometry of triangles, safe for needles and tiny ones, and of their normals."""

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


def row_products(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Scalar products (K,) of the vectors (K, 3) of ``first`` and ``second``, row by row."""
    return np.einsum("ij,ij->i", first, second)


def angles_between(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Angles (K,) in radians between unit vectors, each (K, 3); exact for small ones, where cosines are not."""
    across = first - second
    return 2.0 * np.arcsin(np.minimum(0.5 * np.sqrt(np.einsum("ij,ij->i", across, across)), 1.0))
