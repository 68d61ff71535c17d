"""The Morton curve through points: an order that keeps neighbours together, and how far apart they lie."""

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
    side = _cube_side(points)
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


def mean_spacing(points: np.ndarray) -> float:
    """How far apart neighbours of ``points`` (N, 3) lie on average, in metres; 0 when all are in one place.

    That is the side of the cubes that hold two of the points each on average, over the side that points
    strewn with one per unit of area need for it. For thousands of points on surfaces it is within a fifth
    of sqrt(area / N). Points in the same place count as one: the corners of a mesh's faces share theirs.
    """
    # Sorted first: np.unique may go by hashes, which takes twenty times as long.
    codes = np.sort(morton_codes(points))
    codes = codes[np.diff(codes, prepend=codes[:1] + np.uint64(1)) != 0]
    if len(codes) < 2:
        return 0.0
    # Mean number in a cube, which doubles its side from one entry to the next.
    held, cubes = [1.0], codes
    while held[-1] < 2.0:
        cubes = cubes >> np.uint64(3)
        cubes = cubes[np.diff(cubes, prepend=cubes[:1] + np.uint64(1)) != 0]
        held.append(len(codes) / len(cubes))
    doublings = np.interp(np.log(2.0), np.log(held), np.arange(float(len(held))))
    return float(_cube_side(points) * 2.0 ** (doublings - BITS) / 1.3)


def _cube_side(points: np.ndarray) -> float:
    return float((points.max(axis=0) - points.min(axis=0)).max()) if len(points) else 0.0
