"""What points and their groups learn about the light of emitters, to choose among them."""

from __future__ import annotations

from threading import Lock

import numpy as np

from .emitter_choice import EmitterChoice
from .emitter_cuts import cuts, most_ranges
from .emitters import Emitters
from .point_groups import PointGroups

#: Rays that the usual ratio of light to unshadowed light counts as, in ranges of which little is known.
USUAL = 1.0

#: Points remember their own rays' light as long as there are no more of them times ranges; each takes 8 bytes.
MOST_OWN = 1 << 24

#: A ray brings no more times the unshadowed light than this, as far as its point learns from it.
LARGEST_RATIO = 1e3


class LearntChoice:
    """What ``points`` (N, 3) with ``normals`` (N, 3), in the order of their ``groups``, learn about ``emitters``.

    Each knows what its own rays to a range brought, and what those of its group's other points did as well; the fewer
    its own rays are, the more that counts. Without ``each``, groups alone do.
    """

    def __init__(
        self, emitters: Emitters, groups: PointGroups, points: np.ndarray, normals: np.ndarray, each: bool = True
    ):
        self.emitters, self._near = emitters, (groups, points, normals)
        self._ranges: tuple[np.ndarray, np.ndarray] | None = None
        self._lock = Lock()
        columns = most_ranges(emitters)
        # Sums over rays of the squares of what they brought, and of what they would have brought unshadowed.
        self._found, self._sought, self._rays = np.zeros((3, len(groups.start) - 1, columns))
        self._learnt: np.ndarray | None = None
        few = each and len(points) * columns <= MOST_OWN
        self._own = np.zeros((2, len(points), columns), np.float32) if few else None

    @property
    def ranges(self) -> tuple[np.ndarray, np.ndarray]:
        """Begin and end (G, C) of the groups' ranges, see :func:`.cuts`; worked out once for all threads."""
        if self._ranges is None:
            with self._lock:
                self._ranges = self._ranges or cuts(self.emitters, *self._near)
        return self._ranges

    @classmethod
    def known(cls, emitters: Emitters, begin: np.ndarray, end: np.ndarray, learnt: np.ndarray | None) -> LearntChoice:
        """What groups have ``learnt`` elsewhere of ranges that ``begin`` and ``end`` so (G, C), for :meth:`around`."""
        found = cls.__new__(cls)
        found.emitters, found._ranges, found._learnt = emitters, (begin, end), learnt
        return found

    def choice(
        self,
        part: slice,
        rows: slice,
        points: np.ndarray,
        normals: np.ndarray,
        group: np.ndarray,
        known: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> EmitterChoice:
        """How ``points`` (K, 3), which are the ``rows`` of all points and the groups in ``part``, choose.

        ``group`` (K,) counts from the first of these. ``known``: the unshadowed light (K, C) of each range, and the
        same without cosine, when the caller knows better.
        """
        begin, end = self._ranges_of(part)
        if known is None:
            ranges = self.emitters.ranges(begin, end)[group]
            known = ranges.brightness(points[:, None], normals[:, None])
        learnt = None if self._learnt is None else self._learnt[part][group]
        if learnt is not None and self._own is not None:
            found, rays = self._own[:, rows]
            learnt = np.sqrt((found + USUAL * learnt**2) / (rays + USUAL))
        return EmitterChoice.of(self.emitters, points, group, begin, end, *known, learnt)

    def around(self, places: np.ndarray, group: np.ndarray) -> EmitterChoice:
        """How ``places`` (K, 3) near the groups ``group`` (K,), which may face any way, choose."""
        some, local = np.unique(group, return_inverse=True)
        begin, end = self._ranges_of(some)
        strength, _ = self.emitters.ranges(begin, end)[local].brightness(places[:, None])
        learnt = None if self._learnt is None else self._learnt[group]
        return EmitterChoice.of(self.emitters, places, local, begin, end, strength, strength, learnt)

    def add(self, part: slice, rows: slice, choice: EmitterChoice, scale, spot, column, light) -> None:
        """Rays from each ``spot`` (S,) to its range ``column`` (S,) brought ``light`` (S,), one range's alone.

        A point's light counts times its ``scale`` (K,).
        """
        shape = self._found[part].shape
        place = choice.group[spot] * shape[1] + column
        unshadowed = choice.light[spot, column]
        found, sought = (light * scale[spot]) ** 2, (unshadowed * scale[spot]) ** 2
        for total, weight in ((self._found, found), (self._sought, sought), (self._rays, None)):
            total[part] += np.bincount(place, weight, shape[0] * shape[1]).reshape(shape)
        if self._own is not None:
            own, place = self._own[:, rows], spot * shape[1] + column
            ratio = np.divide(light, unshadowed, out=np.zeros_like(light), where=unshadowed > 0.0)
            for total, weight in zip(own, (np.minimum(ratio, LARGEST_RATIO) ** 2, None), strict=True):
                total += np.bincount(place, weight, total.size).reshape(total.shape)

    def changed(self, part: slice, rows: slice) -> list[np.ndarray | None]:
        """Views of what :meth:`add` changes, of the groups in ``part`` and the points ``rows``."""
        own = None if self._own is None else self._own[:, rows]
        return [self._found[part], self._sought[part], self._rays[part], own]

    def fixed(self, part: slice) -> tuple:
        """What the groups in ``part`` choose by: begin and end of their ranges, and what they have learnt of these;
        None before they have."""
        return *self._ranges_of(part), None if self._learnt is None else self._learnt[part]

    def load(self, fixed: tuple, own: bool) -> None:
        """Choose by what is :meth:`fixed` elsewhere from now on; points remember their ``own`` rays' light or not."""
        *ranges, self._learnt = fixed
        self._ranges, self._own = tuple(ranges), self._own if own else None

    def _ranges_of(self, groups) -> tuple[np.ndarray, np.ndarray]:
        begin, end = self.ranges
        return begin[groups], end[groups]

    def learn(self) -> None:
        """Choose by what has been found so far from now on."""
        rays = self._rays.sum(axis=1, keepdims=True)
        found, sought = self._found.sum(axis=1, keepdims=True), self._sought.sum(axis=1, keepdims=True)
        usual = np.divide(found, sought, out=np.zeros_like(found), where=sought > 0.0)
        some = USUAL * np.divide(sought, rays, out=np.zeros_like(sought), where=rays > 0.0)
        least = self._sought + some
        ratio = np.divide(self._found + usual * some, least, out=np.zeros_like(least), where=least > 0.0)
        self._learnt = np.where(usual > 0.0, np.sqrt(ratio), 1.0)
