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

#: Bits of a cell's number for how far from the cell's middle its surface's plane lies: sheets one behind the other
#: differ in that, when they are more than a 16th of a side apart.
_SHEET = 5

#: Levels of cells, in the last bits of their numbers.
LEVELS, _LEVEL = 32, 5

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
