"""What a search did, counted for the study. A bake counts nothing and pays nothing."""

from __future__ import annotations

from collections import Counter

#: what is counted
KINDS = ("segments", "lists", "nodes", "patches", "listed", "discs", "tests", "crossings")


class Counts:
    """Numbers noted by one search, or by several.

    Hand one to a gatherer's ``crossings`` and read it when all crossings have been taken:

    segments   searched
    lists      of the Sphere Cache: spheres whose list was made anew
    nodes      comparisons of a segment with a sphere or a box of the tree
    patches    comparisons of a segment with the slab around a few neighbouring discs
    listed     discs in those patches: the pairs that the study would test, for want of slabs and balls
    discs      comparisons of a segment with the ball around a disc
    tests      exact tests of a segment with a disc
    crossings  found
    """

    def __init__(self):
        self._noted: list[tuple[str, int]] = []

    def note(self, kind: str, number: int) -> None:
        """Count ``number`` more of ``kind``; safe from several threads, because lists append in one step."""
        self._noted.append((kind, int(number)))

    def totals(self) -> dict[str, int]:
        """The number of each of KINDS."""
        sums = Counter(dict.fromkeys(KINDS, 0))
        for kind, number in self._noted:
            sums[kind] += number
        return dict(sums)
