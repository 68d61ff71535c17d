"""Dataclasses of arrays with one row per thing: some of their rows, and several of them one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from typing import Self


class Rows:
    """Base of dataclasses whose fields are arrays of as many rows, other Rows of as many, or None."""

    def __len__(self) -> int:
        return len(getattr(self, fields(self)[0].name))

    def taken(self, rows: np.ndarray | slice) -> Self:
        """Those ``rows`` (index array, slice or mask) alone, the same to the bit: checked once is enough."""
        if not isinstance(rows, slice):
            rows = np.asarray(rows)
            rows = np.flatnonzero(rows) if rows.dtype == bool else rows
        return self._made({field.name: _taken(getattr(self, field.name), rows) for field in fields(self)})

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """All rows of ``parts``, of which there is one at least, in their order; None what any of them lacks."""
        if len(parts) == 1:
            return parts[0]
        return cls._made({field.name: _joined([getattr(part, field.name) for part in parts]) for field in fields(cls)})

    @classmethod
    def _made(cls, values: dict) -> Self:
        made = object.__new__(cls)
        vars(made).update(values)
        return made


def _taken(value: np.ndarray | Rows | None, rows: np.ndarray | slice):
    if value is None or isinstance(value, Rows):
        return value if value is None else value.taken(rows)
    # Rows of three numbers are fetched several times faster so than by value[rows].
    return value[rows] if isinstance(rows, slice) else value.take(rows, axis=0)


def _joined(values: list):
    if any(value is None for value in values):
        return None
    return type(values[0]).joined(values) if isinstance(values[0], Rows) else np.concatenate(values)
