"""When the Sphere Cache makes which of its spheres anew, walking over sorted discs: known before any segment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SCANNED = 1 << 16  # discs looked at together

#: A sphere's radius over that of the one around it, of which the study found 0.6 to 0.7 best; and the last sphere's
#: over a disc's.
Q, SLACK = 0.62, 1.5


def around(centres: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, float]:
    """The centre (3,) and radius, metres, of a sphere that holds N >= 1 discs with ``centres`` (N, 3) and ``radii``
    (N,): about the middle of the box of their centres."""
    middle = 0.5 * (centres.min(axis=0) + centres.max(axis=0))
    return middle, float((np.linalg.norm(centres - middle, axis=1) + radii).max())


@dataclass(frozen=True)
class SpherePlan:
    """All spheres of the Sphere Cache, level by level from the one around all discs inwards.

    The study recomputes sphere i and those inside it, centred at the next disc, when that disc leaves it. When
    that happens depends on the discs alone, so each sphere serves a fixed range of the sorted discs, within the
    range of the sphere from whose list its own is made.

    centre       (K, 3) metres
    radius       (K,)   metres; infinite where discs too large for their level use the list above as it is
    begin, end   (K,)   the rows of the sorted discs that it serves
    child        (K,)   its first sphere of the next level; they stand side by side
    children     (K,)   how many; 0 when its list serves the discs directly
    """

    centre: np.ndarray
    radius: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    child: np.ndarray
    children: np.ndarray

    @classmethod
    def of(cls, centres: np.ndarray, radii: np.ndarray, q: float, last_radius: float) -> SpherePlan:
        """Plan for discs in sorted order, N >= 1, with r_{i+1} = q r_i as long as that is >= ``last_radius``."""
        middle, radius = around(centres, radii)
        begin, end = np.array([0]), np.array([len(centres)])
        levels = [(middle[None], np.array([radius]), begin, end)]
        links = []
        known = 1
        while radius * q >= last_radius:
            radius *= q
            open_ = np.isfinite(levels[-1][1]).nonzero()[0]
            starts = sphere_starts(centres, radii, begin[open_], end[open_], radius)
            # A sphere ends where the next one starts, or with the range it lies in.
            parent = open_[np.searchsorted(begin[open_], starts, side="right") - 1]
            stop = np.minimum(np.append(starts[1:], len(centres)), end[parent])
            children = np.bincount(parent, minlength=len(begin))
            links.append((known + np.cumsum(children) - children, children))
            known += len(starts)
            begin, end = starts, stop
            fits = radii[starts] <= radius
            levels.append((centres[starts], np.where(fits, radius, np.inf), begin, end))
        links.append((np.zeros(len(begin), np.int64),) * 2)
        spheres = [np.concatenate(column) for column in zip(*levels, strict=True)]
        return cls(*spheres, *(np.concatenate(column) for column in zip(*links, strict=True)))


def sphere_starts(centres, radii, begin, end, radius: float) -> np.ndarray:
    """Rows, ascending, at which a new sphere of ``radius`` is centred when walking each range begin:end.

    A row leaves the sphere centred at row c when |p - c| + d > radius. Rows with d > radius fit no sphere:
    a run of them starts with its first row.
    """
    starts = np.zeros(len(centres), bool)
    starts[begin] = True
    centre, row, columns = begin, begin + 1, centres.T.copy()
    active = (row < end).nonzero()[0]
    centre, row, end = centre[active], row[active], end[active]
    while len(row):
        ahead = row[:, None] + np.arange(max(4, min(SCANNED // len(row), len(centres))))
        inside = ahead < end[:, None]
        np.minimum(ahead, len(centres) - 1, out=ahead)
        reach = 0.0
        for column in columns:
            away = column.take(ahead)
            away -= column.take(centre)[:, None]
            away *= away
            reach = reach + away
        np.sqrt(reach, out=reach)
        reach += radii.take(ahead)
        leaves = np.where((radii[centre] <= radius)[:, None], reach > radius, radii[ahead] <= radius) & inside
        left = leaves.any(axis=1)
        first = np.take_along_axis(ahead, leaves.argmax(axis=1)[:, None], axis=1)[:, 0]
        centre = np.where(left, first, centre)
        starts[centre] = True
        row = np.where(left, first + 1, row + ahead.shape[1])
        active = (row < end).nonzero()[0]
        centre, row, end = centre[active], row[active], end[active]
    return starts.nonzero()[0]
