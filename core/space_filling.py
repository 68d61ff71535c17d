"""The Morton curve through points: an order that keeps neighbours together."""

from __future__ import annotations

import numpy as np

BITS = 21  # per axis, so that three axes fit into 64 bits
_SPREAD = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)


def morton_codes(points: np.ndarray) -> np.ndarray:
    """Place (N,) uint64 of each of ``points`` (N, 3) along the Morton curve through their bounding cube."""
    codes = np.zeros(len(points), np.uint64)
    side = cube_side(points)
    if side == 0.0:
        return codes
    lower = points.min(axis=0)
    for axis in range(3):
        code = ((points[:, axis] - lower[axis]) / side * (2**BITS - 1)).astype(np.uint64)
        for shift, mask in _SPREAD:
            code = (code | (code << np.uint64(shift))) & np.uint64(mask)
        codes |= code << np.uint64(axis)
    return codes


def curve_order(points: np.ndarray) -> np.ndarray:
    """Rows (N,) int64 that sort ``points`` (N, 3) along the Morton curve; ties keep their order."""
    return np.argsort(morton_codes(points), kind="stable")


def cube_side(points: np.ndarray) -> float:
    """The side of the cube around ``points`` (N, 3), metres; 0 without any."""
    return float((points.max(axis=0) - points.min(axis=0)).max()) if len(points) else 0.0
