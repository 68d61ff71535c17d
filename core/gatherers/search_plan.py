"""Rough costs of the searches, known before anything is built, and how large a grid's cells should be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..discs import TangentDiscs
from ..segments import Segments
from .disc_grid import ENTRIES, grid_bounds, wanted_cell
from .disc_index import COARSE, DiscIndex

#: Cells considered, over those that are searched fastest.
FACTORS = (1.0, 1.25, 1.6, 2.0, 2.5)
#: Most discs that are looked at to plan a grid's cells.
SAMPLE = 1 << 12
#: Discs and segments among which crossings are counted for :func:`crossings_per_segment`.
DISCS, SEGMENTS = 2000, 512
# Reference nanoseconds for each disc to build a search, and for each place of a disc in a cell, and each cell.
_DISC, _ENTRY, _CELL = {"grid": 1800.0, "tree": 3200.0, "sphere-cache": 2600.0}, 190.0, 170.0
# For the way of a segment to the discs: through a few cells, 100 nodes or 120 spheres in most samples, and their
# patches.
_WAY = {"grid": 300.0, "tree": 2800.0, "sphere-cache": 3700.0}
# For a ball, an exact test and a crossing, as in unit_costs.py; for a crossing's patches and nodes, by kind.
_BALL, _TEST, _CROSSING = 22.0, 49.0, 87.0
_PATCHES = {"grid": 40.0, "tree": 460.0, "sphere-cache": 250.0}


@dataclass(frozen=True)
class SearchPlan:
    """Rough costs of all kinds of search.

    seconds  reference seconds of one processor to build and search, by kind
    cell     side of a grid's cells, metres
    uneven   whether the discs are too unevenly spread for a grid, whatever its cells
    """

    seconds: dict[str, float]
    cell: float
    uneven: bool

    @property
    def index(self) -> str:
        """The kind of Disc Indexing of the least time."""
        return "tree" if self.uneven else min(("grid", "tree"), key=self.seconds.get)


def planned(discs: TangentDiscs, segments: int, crossings: float, spacing: float | None = None) -> SearchPlan:
    """What building and searching ``segments`` will take, to a factor of two, and the cells for which it is least.

    discs      N >= 1
    crossings  expected of one segment
    spacing    their mean_spacing, if it is known already

    With y = cell / d a disc lies in about 1.2 + 4/y + 4.5/y^2 cells, and for each crossing 5.5 (1 + 0.9 y)^2 balls and
    6.5 (1 + 0.2 y)^2 discs are tested, because a disc is met again in each of its cells; in the tree 4 and 2.5, by the
    Sphere Cache 20 and 12. Measured on the samples and on real scenes where the radius is larger than the spacing.
    """
    ideal = wanted_cell(discs, spacing)
    fitting = _bounds(discs)
    wanted = fitting(ideal)
    radius = float(np.median(discs.radii))
    # Column by column: along the first axis of rows NumPy needs ten times as long.
    size = np.array([np.ptp(column) for column in discs.centres.T]) + 2.0 * radius

    def cost(kind: str, balls: float, tests: float) -> float:
        each = _WAY[kind] + crossings * (balls * _BALL + tests * _TEST + _PATCHES[kind] + _CROSSING)
        return _DISC[kind] * len(discs) + segments * each

    def grid(factor: float) -> float:
        y = factor * wanted / radius
        cells = np.prod(size / (factor * wanted) + 2.0)
        building = _CELL * cells + _ENTRY * len(discs) * (1.2 + 4.0 / y + 4.5 / y**2)
        return building + cost("grid", 5.5 * (1.0 + 0.9 * y) ** 2, 6.5 * (1.0 + 0.2 * y) ** 2)

    factor = min(FACTORS, key=grid)
    nanoseconds = {
        "grid": grid(factor),
        "tree": cost("tree", 4.0, 2.5),
        "sphere-cache": cost("sphere-cache", 20.0, 12.0),
    }
    seconds = {kind: 1e-9 * float(value) for kind, value in nanoseconds.items()}
    return SearchPlan(seconds, fitting(factor * wanted), wanted >= COARSE * ideal)


def _bounds(discs: TangentDiscs) -> Callable[[float], float]:
    """:func:`.disc_grid.grid_bounds` from some of the ``discs``, those farthest out among them."""
    if len(discs) <= SAMPLE:
        return grid_bounds(discs)
    ends = [end for column in discs.centres.T for end in (column.argmin(), column.argmax())]
    rows = np.concatenate([ends, np.linspace(0, len(discs) - 1, SAMPLE).astype(np.int64)])
    return grid_bounds(discs.taken(rows), entries=ENTRIES * len(rows) // len(discs))


def crossings_per_segment(discs: TangentDiscs, pilot: Segments) -> float:
    """How many of ``discs`` a segment like the ``pilot``'s crosses, from a sample of both."""
    if len(discs) == 0 or len(pilot) == 0:
        return 0.0
    pilot = pilot.spread(SEGMENTS)
    rows = np.random.default_rng(0).integers(0, len(discs), min(DISCS, len(discs)))
    found = sum(len(crossings) for crossings in DiscIndex(discs.taken(rows), "tree").crossings(pilot))
    return found / len(pilot) * len(discs) / len(rows)
