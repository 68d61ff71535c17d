"""Properties of triangles that may differ by the side that is met."""

from __future__ import annotations

import numpy as np

from .checks import float_rows
from .errors import InvalidArrayError


class BySide:
    """``values`` (T, C) of triangles, alike on both sides; or (2, T, C), of their fronts and of their backs.

    The front is where the normal by the winding points. ``normals`` (T, 3) are those normals.
    """

    def __init__(self, values: np.ndarray, normals: np.ndarray):
        self._rows = values.reshape(-1, values.shape[-1])
        self._normals = normals if values.ndim == 3 else None

    def met(self, triangle: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """The values (K, C) where each ``triangle`` (K,) is met along ``directions`` (K, 3)."""
        if self._normals is not None:
            back = np.einsum("ij,ij->i", self._normals.take(triangle, axis=0), directions) > 0
            triangle = triangle + len(self._normals) * back
        return self._rows.take(triangle, axis=0)


def sided_rows(values, name: str, count: int) -> np.ndarray:
    """``values`` as finite RGB rows (count, 3), or (2, count, 3) when they differ by side.

    Raises InvalidArrayError on anything else.
    """
    if np.ndim(values) != 3:
        return float_rows(values, name, 3, count)
    if len(values) != 2:
        raise InvalidArrayError(f"{name} must be given for one or for two sides, not for {len(values)}.")
    return np.stack([float_rows(side, name, 3, count) for side in values])


def any_side(values: np.ndarray) -> np.ndarray:
    """Whether (T,) anything is other than zero in the ``values`` (T, C) or (2, T, C) of each triangle."""
    found = values.any(axis=-1)
    return found if found.ndim == 1 else found.any(axis=0)
