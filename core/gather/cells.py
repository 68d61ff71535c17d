"""Cells of space in which gather rays land: finer where rays are short, and apart by the side that they land on.

A ray of length t looks light up in cells with sides of about SHARE t, as wide as the part of the hemisphere that it
stands for among a hundred rays. Sides go in powers of two, so that equal places and levels are equal numbers. Those are
mixed from the cell's place, so that a scene may be as wide as it likes beside its smallest cells. Source of such keys:
Binder, Fricke and Keller, "Massively Parallel Path Space Filtering", 2019.
"""

from __future__ import annotations

import numpy as np

from ..hashing import ODD, mixed_in
from ..points import facings

#: Sides of cells over the length of the ray that looks into them, at most.
SHARE = 0.2

#: Bits of a cell's number for the direction that its surface faces, and for how far from the cell's middle its plane
#: lies: sheets one behind the other differ in that, when they are more than a 16th of a side apart.
_FACING, _SHEET = 5, 5

#: Levels of cells, in the last bits of their numbers.
LEVELS, _LEVEL = 32, 5
_EMPTY = np.uint64(0xFFFFFFFFFFFFFFFF)

#: Cells are counted so far; all beyond, where coordinates are coarser than cells by much, are in the last ones.
_FARTHEST = 2.0**62


class Cells:
    """Numbers the cells of space, which are counted from ``corner`` (3,) m.

    Attribute ``finest``, metres: the sides of the smallest cells; larger ones follow in powers of two.
    """

    def __init__(self, corner: np.ndarray, finest: float):
        self._corner, self.finest = corner, finest

    def levels(self, lengths: np.ndarray) -> np.ndarray:
        """Level (K,) of the cells into which rays of these ``lengths`` (K,) metres look."""
        _, exponent = np.frexp(lengths * (SHARE / self.finest))
        return np.clip(exponent - 1, 0, LEVELS - 1)

    def sides(self, levels: np.ndarray) -> np.ndarray:
        """Sides (K,) metres of cells of these ``levels`` (K,)."""
        return np.ldexp(self.finest, levels)

    def numbers(self, places: np.ndarray, normals: np.ndarray, levels: np.ndarray) -> np.ndarray:
        """Numbers (K,) uint64 of the cells of ``levels`` (K,) at ``places`` (K, 3) m on surfaces that face along unit
        ``normals`` (K, 3)."""
        scale = 1.0 / self.sides(levels)
        number, height = np.zeros(len(places), np.uint64), np.zeros(len(places))
        for axis in range(3):
            place = (places[:, axis] - self._corner[axis]) * scale
            cell = np.floor(place)
            height += (place - cell - 0.5) * normals[:, axis]
            np.clip(cell, -_FARTHEST, _FARTHEST, out=cell)
            number = mixed_in(number, cell.astype(np.int64).view(np.uint64))
        sheet = (np.abs(height) * (1 << (_SHEET - 1))).astype(np.int64)
        sheet = np.minimum(sheet, (1 << (_SHEET - 1)) - 1) | ((height < 0).astype(np.int64) << (_SHEET - 1))
        number = (number ^ ((facings(normals) << _SHEET) | sheet).view(np.uint64)) * ODD
        return (number >> np.uint64(_LEVEL) << np.uint64(_LEVEL)) | levels.astype(np.uint64)

    @staticmethod
    def levels_of(numbers: np.ndarray) -> np.ndarray:
        """Levels (K,) of cells by their ``numbers`` (K,)."""
        return (numbers & np.uint64((1 << _LEVEL) - 1)).astype(np.int64)


class CellTable:
    """Finds the row of a cell by its number: a hash table with open addresses.

    ``numbers`` (C,) uint64 must differ; row c belongs to number c.
    """

    def __init__(self, numbers: np.ndarray, rows: np.ndarray):
        bits = max(int(2 * len(numbers)).bit_length(), 4)
        self._shift, self._mask = np.uint64(64 - bits), (1 << bits) - 1
        self._numbers, self._rows = np.full(1 << bits, _EMPTY), np.full(1 << bits, -1, np.int64)
        slot, left = self._first(numbers), np.arange(len(numbers))
        while len(left):
            free = np.flatnonzero(self._numbers[slot] == _EMPTY)
            # Of those that want the same slot the last one gets it.
            self._numbers[slot[free]] = numbers[left[free]]
            self._rows[slot[free]] = rows[left[free]]
            going = self._numbers[slot] != numbers[left]
            left, slot = left[going], (slot[going] + 1) & self._mask

    def find(self, numbers: np.ndarray) -> np.ndarray:
        """Rows (K,) of the cells of these ``numbers`` (K,), -1 where there is none."""
        slot = self._first(numbers)
        there = self._numbers.take(slot)
        rows = np.where(there == numbers, self._rows.take(slot), -1)
        left = np.flatnonzero((there != numbers) & (there != _EMPTY))
        numbers, slot = numbers.take(left), slot.take(left)
        while len(left):
            slot = (slot + 1) & self._mask
            there = self._numbers.take(slot)
            hit = there == numbers
            rows[left[hit]] = self._rows.take(slot[hit])
            going = np.flatnonzero(~hit & (there != _EMPTY))
            left, numbers, slot = left.take(going), numbers.take(going), slot.take(going)
        return rows

    def _first(self, numbers: np.ndarray) -> np.ndarray:
        """Where (K,) to look first (Fibonacci hashing, Knuth 6.4)."""
        mixed = numbers ^ (numbers >> np.uint64(29))
        return ((mixed * ODD) >> self._shift).astype(np.int64)
