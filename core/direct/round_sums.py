"""Sums over rounds of rays, each an independent estimate; points may have had different numbers of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..gatherers.ranges import blocks
from .point_groups import PointGroups

#: Rounds of rays, of all points together, that are worked on in one array.
ROUNDS_PER_BATCH = 1 << 13

#: Rounds that the variance usual in a group stands for at most: of so few points nobody knows it better.
MOST_OF_GROUP = 32.0


@dataclass(frozen=True)
class RoundSums:
    """What was found at N points; all of it grows in place. Channel by channel, since NumPy is slow along short axes.

    count    (N,) of rounds
    total    (3, N) sum of their irradiance, W/m^2, RGB
    squares  (3, N) sum of its squares
    """

    count: np.ndarray
    total: np.ndarray
    squares: np.ndarray

    @classmethod
    def of(cls, points: int) -> RoundSums:
        """No rounds yet."""
        return cls(np.zeros(points), np.zeros((3, points)), np.zeros((3, points)))

    def part(self, rows: slice) -> RoundSums:
        """The sums at some of the points, which grow with these."""
        return RoundSums(self.count[rows], self.total[:, rows], self.squares[:, rows])

    def add(self, rows: slice, rounds: np.ndarray, samples: np.ndarray) -> None:
        """What ``rounds`` (K,) more at each of ``rows`` found: ``samples`` (sum of rounds, 3), point after point."""
        self.count[rows] += rounds
        some = np.flatnonzero(rounds)
        begin = (np.cumsum(rounds) - rounds)[some]
        for channel, sample in enumerate(samples.T):
            self.total[channel, rows][some] += np.add.reduceat(sample, begin)
            self.squares[channel, rows][some] += np.add.reduceat(sample**2, begin)

    @property
    def mean(self) -> np.ndarray:
        """Irradiance (3, N); zero without rounds."""
        return self.total / np.maximum(self.count, 1)

    @property
    def variance(self) -> np.ndarray:
        """Of a single round, (3, N); zero below two rounds."""
        count = np.maximum(self.count, 2)
        variance = self.squares - self.total**2 / count
        variance *= (self.count >= 2) / (count - 1)
        return np.maximum(variance, 0.0, out=variance)

    def squared_error(self, value: np.ndarray, groups: PointGroups) -> np.ndarray:
        """Squared standard error (3, N) of :attr:`mean`, where all light is ``value`` (3, N); inf below two rounds.

        Few rounds that happen to agree do not prove that all would: to their own variance that relative one is added
        which the rounds have in the point's group, with the weight of one round, and of more where the group's points
        differ among themselves hardly more than variances of so few rounds must (empirical Bayes, as Smyth 2004).
        """
        squared, square = self.variance, value**2
        relative = np.minimum(squared / np.where(value > 0, square, np.inf), 1.0)
        usual = groups.means(relative)
        others = self._weight_of_group(relative, usual, groups)
        usual *= square
        own = np.maximum(self.count - 1, 0)
        squared *= own
        squared += others * usual
        squared /= (own + others) * np.maximum(self.count, 1)
        squared[:, self.count < 2] = np.inf
        return squared

    def _weight_of_group(self, relative: np.ndarray, usual: np.ndarray, groups: PointGroups) -> np.ndarray:
        """The rounds (3, N) that the mean of a group's ``relative`` variances (3, N), ``usual`` (3, N), stands for.

        Variances of normal samples with m degrees of freedom scatter by 2 / m in relative squares. What they scatter
        beyond that, c, is the points' own; the mean is then worth 2 / c of such samples.
        """
        chance = 2.0 / np.maximum(groups.means(self.count) - 1.0, 1.0)
        scatter = groups.means(relative**2)
        scatter = np.divide(scatter, usual**2, out=np.full_like(usual, np.inf), where=usual > 0)
        own = (scatter - 1.0 - chance) / (1.0 + chance)
        return np.clip(2.0 / np.maximum(own, 2.0 / MOST_OF_GROUP), 1.0, MOST_OF_GROUP)

    def relative_variance(self, light: np.ndarray) -> np.ndarray:
        """Variance (N,) of a round's RGB sum, fully correlated, over ``light`` (N,) squared; nan below two rounds."""
        red, green, blue = np.sqrt(self.variance)
        relative = (red + green + blue) / np.where(light > 0, light, np.inf)
        return np.where(self.count >= 2, relative**2, np.nan)


def batches(rounds: np.ndarray) -> Iterator[tuple[slice, np.ndarray]]:
    """Batches of bounded size of points that have so many ``rounds`` (K,): their rows, and the row of each round."""
    for rows in blocks(rounds, ROUNDS_PER_BATCH):
        spot = np.repeat(np.arange(rows.start, rows.stop), rounds[rows])
        if len(spot):
            yield rows, spot


def net_means(found: np.ndarray, count: int) -> np.ndarray:
    """Means (S, 3) over each ``count`` consecutive rows of ``found`` (S * count, 3)."""
    total = found[::count].copy()
    for number in range(1, count):
        total += found[number::count]
    return total / count
