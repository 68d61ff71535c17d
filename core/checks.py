"""The one checker of array shapes and finiteness that every central type uses."""

from __future__ import annotations

import numpy as np

from .errors import InvalidArrayError


def float_rows(values, name: str, columns: int | None = 3, rows: int | None = None) -> np.ndarray:
    """Return ``values`` as a C-contiguous finite float64 array of shape (rows, columns).

    ``columns=None`` asks for a vector of shape (rows,). The result is read-only, so that the frozen
    types made from it stay what they were checked to be.

    Raises InvalidArrayError when the shape differs or a value is NaN or infinite.
    """
    array = _as_array(values, name, np.float64, columns, rows)
    finite = np.isfinite(array)
    if not finite.all():
        row = int(np.argwhere(~finite)[0][0])
        raise InvalidArrayError(f"{name} must be finite, but row {row} is {array[row]}.")
    return array


def index_rows(values, name: str, columns: int | None, limit: int, rows: int | None = None) -> np.ndarray:
    """Return ``values`` as int64 of shape (rows, columns), each in [0, limit).

    Raises InvalidArrayError when the shape differs or an index is out of range.
    """
    array = _as_array(values, name, np.int64, columns, rows)
    if array.size and (array.min() < 0 or array.max() >= limit):
        raise InvalidArrayError(f"{name} must hold indices from 0 to {limit - 1}.")
    return array


def unit_rows(values, name: str, rows: int | None = None) -> np.ndarray:
    """Return ``values`` as (rows, 3) float64 scaled to unit length.

    Raises InvalidArrayError when a row has no direction (length zero) or is not finite.
    """
    array = float_rows(values, name, 3, rows)
    largest = np.abs(array).max(axis=1, initial=0.0)
    if (largest == 0.0).any():
        row = int(np.flatnonzero(largest == 0.0)[0])
        raise InvalidArrayError(f"{name} must have a direction, but row {row} is zero.")
    scaled = array / largest[:, None]
    return _frozen(scaled / np.linalg.norm(scaled, axis=1)[:, None])


def _as_array(values, name, dtype, columns, rows) -> np.ndarray:
    try:
        array = np.array(values, dtype=dtype, order="C")
    except (TypeError, ValueError) as error:
        raise InvalidArrayError(f"{name} must be an array of numbers ({error}).") from error
    wanted = (rows,) if columns is None else (rows, columns)
    if array.size == 0 and columns is not None and array.ndim == 1:
        array = array.reshape(0, columns)
    matches = array.ndim == len(wanted) and all(w is None or s == w for s, w in zip(array.shape, wanted, strict=True))
    if not matches:
        shape = ", ".join("n" if w is None else str(w) for w in wanted)
        raise InvalidArrayError(f"{name} must have the shape ({shape}), not {array.shape}.")
    return _frozen(array)


def _frozen(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array
