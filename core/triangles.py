"""Geometry of triangles, safe for needles and tiny ones."""

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
