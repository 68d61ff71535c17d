"""Disc Indexing: each segment walks an index over the discs from its origin to its end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from ..discs import TangentDiscs
from ..errors import InvalidSettingError
from ..segments import Segments
from ..space_filling import curve_order
from .counts import Counts
from .crossing_pairs import CrossingPairs, columns, path_rows
from .disc_grid import DiscGrid, fitting_cell, wanted_cell
from .disc_search import DiscSearch
from .disc_tree import DiscTree
from .gatherer import Crossings
from .streams import in_lanes, portions

SEGMENTS = 1 << 16  # most segments that walk the index together
INDEXES: dict[str, Callable[[TangentDiscs], DiscSearch]] = {"grid": DiscGrid, "tree": DiscTree}
# From here on the grid's cells, enlarged to fit into memory, hold so many discs that the tree is faster.
COARSE = 8.0


class DiscIndex:
    """The study's second gatherer, which works with any kind of index.

    discs  the TangentDiscs to search
    index  "grid", "tree", "auto" (the grid, unless its cells would have to be COARSE times too large), or what
           makes an index of one's own from the discs
    cell   side of the grid's cells in metres; None: what fits best when there are very many segments

    Raises InvalidSettingError for any other name.
    """

    name = "disc-index"
    chunk = SEGMENTS

    def __init__(
        self, discs: TangentDiscs, index: str | Callable[[TangentDiscs], DiscSearch] = "auto", cell: float | None = None
    ):
        if index == "auto":
            index = favoured_index(discs)
        if not callable(index) and index not in INDEXES:
            raise InvalidSettingError(f"Unknown disc index '{index}': choose auto, {', '.join(INDEXES)}.")
        self.index = index
        self._order = curve_order(discs.centres)
        self._test = CrossingPairs(discs, self._order)
        make = partial(DiscGrid, cell=cell) if index == "grid" else INDEXES.get(index, index)
        self._search: DiscSearch | None = make(discs.taken(self._order)) if len(discs) else None
        self.cell = getattr(self._search, "cell", None)

    def crossings(self, segments: Segments, counts: Counts | None = None) -> Iterator[Crossings]:
        """Yield all crossings of ``segments``, each pair once, in chunks of bounded size."""
        if self._search is None:
            return iter(())
        return in_lanes(len(segments), SEGMENTS, lambda rows: portions(self._found(segments, rows, counts), 12))

    def _found(self, segments: Segments, rows: slice, counts: Counts | None) -> Iterator[Crossings]:
        if counts is not None:
            counts.note("segments", rows.stop - rows.start)
        paths = path_rows(segments, rows)
        for some in self._search.candidates(*columns(segments, rows), counts):
            found, time = self._test(paths, some.segment.take(some.stretch), some.disc, counts)
            stretch = some.stretch.take(found)
            if some.first is not None:
                inside = (some.first.take(stretch) <= time) & (time < some.last.take(stretch))
                found, stretch = found[inside], stretch[inside]
            if counts is not None:
                counts.note("crossings", len(found))
            yield Crossings(rows.start + some.segment.take(stretch), self._order.take(some.disc.take(found)))


def favoured_index(discs: TangentDiscs) -> str:
    """The kind of index that measured faster for such discs and very many segments."""
    if len(discs) == 0:
        return "grid"
    wanted = wanted_cell(discs)
    return "grid" if fitting_cell(discs, wanted) < COARSE * wanted else "tree"
