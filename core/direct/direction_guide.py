"""Which directions light comes from, as groups of points have seen: cells of the hemisphere, each with a density.

Cells are squares of the unit square from which a cosine-distributed direction is made, so all are equally likely by
chance. A density of chances that is constant in cells, times the cosine's own, aims where light was found. Whatever
was learnt, the mean is right, since rays are divided by the density that they were chosen with; a share of them
always follows the cosine alone. Source: the histograms of Jensen, "Importance Driven Path Tracing using the Photon
Map", Eurographics Rendering Workshop 1995.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..sampling import BELOW_ONE, choose_in_rows, running_shares

#: Cells along each side of the square.
SIDE = 16

#: Shares of the rays that may follow the cosine whatever was learnt: one over it is the most that variance can grow.
DEFENSIVE = (0.5, 0.25, 0.125)

#: What aiming is to leave of the second moment to be used: chance is spread more evenly.
LEAST_GAIN = 0.75

#: Consecutive groups, which are neighbours, that may learn together where each alone saw too little.
TOGETHER = 4


class DirectionGuide:
    """``density`` (G, SIDE * SIDE) over each group's cells, mean 1; all 1 where the cosine alone does as well."""

    def __init__(self, density: np.ndarray):
        self.density = density
        self._even = (density == 1.0).all(axis=1)

    def part(self, groups: slice) -> DirectionChoice | None:
        """What it takes to choose directions for some consecutive groups, numbered from 0; None: by the cosine."""
        return None if self._even[groups].all() else DirectionChoice.over(self.density[groups])


@dataclass(frozen=True)
class DirectionChoice:
    """Densities (G * SIDE * SIDE,), and their running shares over rows (G * SIDE,) and in rows (G * SIDE * SIDE,)."""

    density: np.ndarray
    rows: np.ndarray
    columns: np.ndarray

    @classmethod
    def over(cls, density: np.ndarray) -> DirectionChoice:
        """By ``density`` (G, SIDE * SIDE)."""
        density = density.astype(np.float64).reshape(-1, SIDE)
        rows = running_shares(density.sum(axis=1).reshape(-1, SIDE))
        return cls(density.ravel(), rows, running_shares(density))

    def warped(self, group: np.ndarray, uniforms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """``uniforms`` (K, 2) moved to where light is for each ``group`` (K,), and the density (K,) there."""
        row, first = choose_in_rows(self.rows, SIDE, group, uniforms[:, 0])
        column, second = choose_in_rows(self.columns, SIDE, row, uniforms[:, 1])
        places = np.stack([row % SIDE + first, column % SIDE + second], axis=1) / SIDE
        return np.minimum(places, BELOW_ONE), self.density[column]


def cells(uniforms: np.ndarray) -> np.ndarray:
    """Numbers (K,) of the cells that ``uniforms`` (K, 2) in [0, 1] lie in."""
    row, column = np.minimum((uniforms * SIDE).astype(np.int64), SIDE - 1).T
    return row * SIDE + column


@dataclass(frozen=True)
class Sightings:
    """What K rays saw, to learn from.

    spot    (K,) the point's row
    place   (K,) its group * SIDE^2 + the cell of the direction
    light   (K,) W/m^2, RGB sum, that a ray which follows the cosine alone would bring from there; zero if blocked
    weight  (K,) density of the cosine over that with which both kinds of rays together were sent there
    whole   (K,) the same with that of the cosine and of aiming
    """

    spot: np.ndarray
    place: np.ndarray
    light: np.ndarray
    weight: np.ndarray
    whole: np.ndarray


class DirectionSums:
    """What rays have found so far in each of the cells of G groups, apart for two halves of their points.

    With M what a ray brings, relative to its point's light, and densities c of the cosine and a of aiming at the light
    there: estimates of the integrals of M^2 c, of c, and of M^2 (a + c), each (2, G, SIDE * SIDE).
    """

    def __init__(self, groups: int):
        self._found, self._sought, self._moment = np.zeros((3, 2, groups, SIDE * SIDE), np.float32)

    def add(self, groups: slice, sightings: Sequence[Sightings], scale: np.ndarray) -> None:
        """What rays from the points of some ``groups`` saw, whose light is to be multiplied by ``scale`` (K,)."""
        shape = self._found[:, groups].shape
        sums = np.zeros((3, 2, shape[1] * shape[2]))
        for seen in sightings:
            place, square = seen.spot % 2 * sums.shape[2] + seen.place, (seen.light * scale[seen.spot]) ** 2
            lit = np.flatnonzero(square)
            sums[1] += np.bincount(place, seen.weight, sums[1].size).reshape(sums[1].shape)
            place, square = place[lit], square[lit]
            for part, share in ((sums[0], seen.weight), (sums[2], seen.whole)):
                part += np.bincount(place, square * share[lit], part.size).reshape(part.shape)
        for total, part in zip(self.sums, sums, strict=True):
            total[:, groups] += part.reshape(shape)

    @property
    def sums(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The estimates of the three integrals."""
        return self._found, self._sought, self._moment

    def guide(self) -> DirectionGuide:
        """The guide that follows: aims as far as each half of the points says is good for the other."""
        best = np.ones_like(self._found[0])
        # Of each cell's second moment, the share that rays by chance have in it.
        by_chance = np.divide(self._found, self._moment, out=np.zeros_like(self._found), where=self._moment > 0)
        least = LEAST_GAIN * self._moment.sum(axis=(0, 2))
        for found, sought in self._views():
            learnt = _density(found[0], sought[0]), _density(found[1], sought[1])
            together = _density(found.sum(axis=0), sought.sum(axis=0))
            for share in DEFENSIVE:
                moment = sum(self._left(half, by_chance[half], _mixed(learnt[1 - half], share)) for half in (0, 1))
                better = moment < least
                least = np.where(better, moment, least)
                best[better] = _mixed(together[better], share)
        return DirectionGuide(best)

    def _views(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """What was found and sought, as it is; blurred, where little was seen; and with the next groups."""
        yield self._found, self._sought
        yield _blurred(self._found), _blurred(self._sought)
        near = _with_next(self._found), _with_next(self._sought)
        yield near
        yield tuple(map(_blurred, near))

    def _left(self, half: int, by_chance: np.ndarray, density: np.ndarray) -> np.ndarray:
        """What becomes of the second moment (G,) of this half when rays by chance have that ``density``."""
        left = density - 1.0
        left *= by_chance
        left += 1.0
        return np.divide(self._moment[half], left, out=left).sum(axis=1)


def _density(found: np.ndarray, sought: np.ndarray) -> np.ndarray:
    """Density (G, SIDE * SIDE): means over a cell's own rays, so that even light leads to an even density."""
    strength = np.sqrt(np.divide(found, sought, out=np.zeros_like(found), where=sought > 0))
    usual = strength.sum(axis=1, keepdims=True) / np.maximum((sought > 0).sum(axis=1, keepdims=True), 1)
    strength = np.where(sought > 0, strength, usual)
    mean = strength.mean(axis=1, keepdims=True)
    return np.divide(strength, mean, out=np.ones_like(strength), where=mean > 0)


def _mixed(learnt: np.ndarray, share: float) -> np.ndarray:
    return share + (1.0 - share) * learnt


def _blurred(sums: np.ndarray) -> np.ndarray:
    """Each cell with a quarter of its neighbours along either side, and a sixteenth of those across corners."""
    square = sums.reshape(*sums.shape[:2], SIDE, SIDE)
    wide = np.pad(square, ((0, 0), (0, 0), (1, 1), (1, 1)), "edge")
    tall = 0.25 * (wide[..., :-2, :] + wide[..., 2:, :]) + 0.5 * wide[..., 1:-1, :]
    return (0.25 * (tall[..., :-2] + tall[..., 2:]) + 0.5 * tall[..., 1:-1]).reshape(sums.shape)


def _with_next(sums: np.ndarray) -> np.ndarray:
    """Sums over blocks of TOGETHER consecutive groups, for each of their groups."""
    begin = np.arange(0, sums.shape[1], TOGETHER)
    return np.add.reduceat(sums, begin, axis=1)[:, np.arange(sums.shape[1]) // TOGETHER]
