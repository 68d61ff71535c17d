"""How large the cells of a grid over discs should be: small ones are searched faster, large ones built faster."""

from __future__ import annotations

import numpy as np

from ..discs import TangentDiscs
from .disc_grid import fitting_cell, wanted_cell

#: Cells considered, over those that are searched fastest.
FACTORS = (1.0, 1.25, 1.6, 2.0, 2.5)
# Reference nanoseconds to build: per disc, per place of a disc in a cell, per cell. Per ball and per exact test of a
# pair, the parts of the search that grow with the cell; as in unit_costs.py.
_DISC, _ENTRY, _CELL = 950.0, 100.0, 88.0
_BALL, _TEST = 18.0, 42.0


def best_cell(discs: TangentDiscs, segments: int, crossings: float, spacing: float | None = None) -> float:
    """The side of cells in metres for which building and searching ``segments`` together take least.

    discs      N >= 1
    crossings  expected of one segment
    spacing    their mean_spacing, if it is known already

    With y = cell / d a disc lies in about 1.2 + 4/y + 4.5/y^2 cells, and for each crossing 3 (1 + 0.9 y)^2 balls and
    4 (1 + 0.2 y)^2 discs are tested; measured on the samples to 20 %.
    """
    wanted = fitting_cell(discs, wanted_cell(discs, spacing))
    radius = float(np.median(discs.radii))
    size = np.ptp(discs.centres, axis=0) + 2.0 * radius

    def cost(factor: float) -> float:
        y = factor * wanted / radius
        cells = np.prod(size / (factor * wanted) + 2.0)
        building = _CELL * cells + len(discs) * (_DISC + _ENTRY * (1.2 + 4.0 / y + 4.5 / y**2))
        searching = crossings * (3.0 * _BALL * (1.0 + 0.9 * y) ** 2 + 4.0 * _TEST * (1.0 + 0.2 * y) ** 2)
        return building + segments * searching

    return fitting_cell(discs, min(FACTORS, key=cost) * wanted)
