"""Which ranges of emitters a group of points looks at as one: short where light may come from nearby, long far away.

The ranges are nodes of a binary tree over the emitters' order. The node is split next whose parts differ most in the
light that they may bring to points of the group, as a share of all. Source: Conty Estevez and Kulla, "Importance
Sampling of Many Lights with Adaptive Tree Splitting", Proceedings of the ACM on Computer Graphics and Interactive
Techniques 1(2), 2018.
"""

from __future__ import annotations

import numpy as np

from .emitters import Emitters
from .point_groups import PointGroups

#: Most ranges that a group has.
MOST_RANGES = 32

#: Points that speak for their group, and how much light counts that their surfaces face away from.
SPEAKERS, AVERTED = 8, 0.1

#: Groups that are worked on at a time.
_GROUPS_PER_BLOCK = 1 << 10

_TINY = np.finfo(float).tiny


def most_ranges(emitters: Emitters) -> int:
    """How many ranges C of ``emitters`` each group has, empty ones included."""
    return min(MOST_RANGES, len(emitters))


def cuts(
    emitters: Emitters, groups: PointGroups, points: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Ranges ``begin`` and ``end`` (G, C) of all emitters for ``groups`` of ``points`` (N, 3) with ``normals`` (N, 3),
    which are in the groups' order.

    They ascend and follow one another; where there are fewer than C, the last ones are empty.
    """
    count = np.diff(groups.start)
    begin, end = np.full((2, len(count), most_ranges(emitters)), len(emitters))
    step = (np.arange(SPEAKERS) + 0.5) / SPEAKERS
    speakers = groups.start[:-1, None] + (step * count[:, None]).astype(np.int64)
    for first in range(0, len(count), _GROUPS_PER_BLOCK):
        rows = slice(first, first + _GROUPS_PER_BLOCK)
        _cut(emitters, points[speakers[rows]], normals[speakers[rows]], begin[rows], end[rows])
    return begin, end


def _cut(emitters, places, normals, begin, end) -> None:
    """Fill ``begin`` and ``end`` (G, C), which are all empty ranges, for points at ``places`` (G, S, 3)."""
    roots = [(0, emitters.placed)] * (emitters.placed > 0)
    roots += [(emitters.placed, len(emitters))] * (emitters.placed < len(emitters))
    if begin.shape[1] < len(roots):
        roots = [(0, len(emitters))]
    groups, columns = begin.shape
    # What each range may bring to each speaker, and how much of that its parts may make of it.
    light, differ = np.zeros((2, groups, places.shape[1], columns))

    def look(rows, column) -> None:
        seen = _seen(emitters, places[rows], normals[rows], begin[rows, column], end[rows, column])
        light[rows, :, column], differ[rows, :, column] = seen

    every = np.arange(groups)
    for column, (first, last) in enumerate(roots):
        begin[:, column], end[:, column] = first, last
        look(every, np.full(groups, column))
    for column in range(len(roots), columns):
        total = light.sum(axis=2, keepdims=True)
        worth = (light / np.where(total > 0.0, total, 1.0) * differ).mean(axis=1)
        worth = np.where(end - begin > 1, worth + _TINY, -1.0)
        split = worth.argmax(axis=1)
        rows = np.flatnonzero(worth[every, split] > 0.0)
        if len(rows) == 0:
            break
        split = split[rows]
        low, high = begin[rows, split], end[rows, split]
        middle = low + (high - low) // 2
        end[rows, split], begin[rows, column], end[rows, column] = middle, middle, high
        look(rows, split)
        look(rows, np.full(len(rows), column))
    order = np.argsort(begin, axis=1, kind="stable")
    begin[:], end[:] = np.take_along_axis(begin, order, axis=1), np.take_along_axis(end, order, axis=1)


def _seen(emitters, places, normals, begin, end) -> tuple[np.ndarray, np.ndarray]:
    """What ranges (G,) may bring to ``places`` (G, S, 3), and the share 0..1 of that by which their parts differ."""
    ranges = emitters.ranges(begin, end)[:, None]
    facing, anywhere = ranges.brightness(places, normals)
    light = facing + AVERTED * anywhere
    away = np.linalg.norm(ranges.centre - places, axis=2)
    differ = np.minimum(np.sqrt(ranges.spread) / np.maximum(away, _TINY), 1.0)
    return light, np.where(ranges.distant, 1.0, differ)
