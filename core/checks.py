"""The one checker of array shapes and finiteness that every central type uses."""

from __future__ import annotations

import numpy as np

from .errors import InvalidArrayError, InvalidSettingError


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


def vector(values, name: str) -> np.ndarray:
    """Return ``values`` as a finite float64 array of shape (3,); raises InvalidArrayError on anything else."""
    return float_rows(values, name, None, 3)


def unit_vector(values, name: str) -> np.ndarray:
    """Return ``values`` as (3,) scaled to unit length; raises InvalidArrayError when it has no direction."""
    return unit_rows(vector(values, name)[None, :], name)[0]


def number_within(value, name: str, high: float = np.inf) -> float:
    """Return ``value`` as a finite float in [0, high]; raises InvalidSettingError on anything else.

    A value above ``high`` by no more than single precision's rounding counts as ``high``: the float32 nearest to
    pi is larger than pi.
    """
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise InvalidSettingError(f"{name} must be a number, not {value!r}.") from error
    if high < number <= high * (1.0 + np.finfo(np.float32).eps):
        return high
    if not (np.isfinite(number) and 0.0 <= number <= high):
        allowed = "of at least 0" if np.isinf(high) else f"from 0 to {high:g}"
        raise InvalidSettingError(f"{name} must be a finite number {allowed}, not {number:g}.")
    return number


def fill(made, **values) -> None:
    """Put ``values`` into the fields of a frozen dataclass that is being made."""
    for name, value in values.items():
        object.__setattr__(made, name, value)


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
