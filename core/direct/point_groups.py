"""Groups of points that see much the same: near each other, with similar normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..gatherers.balanced_tree import BalancedTree
from ..points import facings

#: Most points in a group; the least is about a quarter of that where there are so many points.
LARGEST_GROUP = 128

#: A difference between unit normals counts as much as so many times that share of the points' extent.
NORMAL_WEIGHT = 1.0


@dataclass(frozen=True)
class PointGroups:
    """N points in G groups.

    order  (N,) the points' rows, group by group
    group  (N,) int64, the group of order[i]: ascending
    start  (G + 1,) group g holds order[start[g] : start[g + 1]]
    """

    order: np.ndarray
    group: np.ndarray
    start: np.ndarray

    @classmethod
    def of(cls, points: np.ndarray, normals: np.ndarray) -> PointGroups:
        """Halve ``points`` (N, 3) with unit ``normals`` (N, 3) across whatever they differ most in, N > 0.

        What faces another way is apart from the start: the few on a wall are none of the many on the ground.
        """
        extent = float((points.max(axis=0) - points.min(axis=0)).max())
        places = np.concatenate([points, normals * (NORMAL_WEIGHT * extent)], axis=1)
        tree = BalancedTree.over(places, facings(normals), LARGEST_GROUP)
        leaves = tree.leaves
        start = np.append(tree.start[leaves], len(points))
        return cls(tree.order, np.repeat(np.arange(len(leaves)), np.diff(start)), start)

    def means(self, values: np.ndarray) -> np.ndarray:
        """Mean (..., N) over each point's group, of ``values`` (..., N) in the groups' order."""
        return (np.add.reduceat(values, self.start[:-1], axis=-1) / np.diff(self.start)).take(self.group, axis=-1)

    def of_others(self, values: np.ndarray) -> np.ndarray:
        """Mean (N,) over the others of each point's group, of ``values`` (N,) in the groups' order; nan if alone."""
        count = np.diff(self.start)[self.group]
        sums = np.add.reduceat(values, self.start[:-1])[self.group]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.maximum(sums - values, 0.0) / (count - 1)
