"""Sums over samples, each of one or more rounds of rays that are spread evenly together, and independent of the others.

Points may have had different numbers of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..ranges import blocks
from .point_groups import PointGroups

#: Rounds of rays, of all points together, that are worked on in one array.
ROUNDS_PER_BATCH = 1 << 13

#: Samples that the variance usual in a group stands for at most: of so few points nobody knows it better.
MOST_OF_GROUP = 32.0

#: A point's rounds of one step make up at least so many samples: the fewer, the more evenly their rays are spread, and
#: the worse is known how noisy they are.
SAMPLES_AT_LEAST = 2

#: Below so many samples nobody knows how noisy they are; two, but for rounding.
LEAST_SAMPLES = 1.999


@dataclass(frozen=True)
class RoundSums:
    """What was found at N points; all of it grows in place. Channel by channel, since NumPy is slow along short axes.

    A sample of m rounds, whose mean irradiance is y, W/m^2, RGB, counts m times: sums over the samples are

    count    (N,) of m, the rounds
    weights  (N,) of m^2
    total    (3, N) of m y
    crossed  (3, N) of m^2 y
    squares  (3, N) of m^2 y^2
    """

    count: np.ndarray
    weights: np.ndarray
    total: np.ndarray
    crossed: np.ndarray
    squares: np.ndarray

    @classmethod
    def of(cls, points: int, channels: int = 3) -> RoundSums:
        """No rounds yet; of a single number a round, with one of the ``channels``."""
        return cls(*np.zeros((2, points)), *np.zeros((3, channels, points)))

    def part(self, rows: slice) -> RoundSums:
        """The sums at some of the points, which grow with these."""
        sums = (self.total, self.crossed, self.squares)
        return RoundSums(self.count[rows], self.weights[rows], *(each[:, rows] for each in sums))

    def add(self, batch: SampleBatch, samples: np.ndarray) -> None:
        """What the samples (S, 3) of a ``batch`` found."""
        rows, size = batch.rows, batch.size
        begin = np.cumsum(batch.count) - batch.count
        self.count[rows] += size * batch.count
        self.weights[rows] += size**2 * batch.count
        for channel, sample in enumerate(samples.T):
            total = np.add.reduceat(sample, begin)
            self.total[channel, rows] += size * total
            self.crossed[channel, rows] += size**2 * total
            self.squares[channel, rows] += size**2 * np.add.reduceat(sample**2, begin)

    def merge(self, other: RoundSums, weight: np.ndarray) -> None:
        """Count all rounds so far ``weight`` (N,) times, add those of the ``other`` sums, and empty these."""
        for name, power in (("count", 1), ("weights", 2), ("total", 1), ("crossed", 2), ("squares", 2)):
            mine, theirs = getattr(self, name), getattr(other, name)
            mine *= weight**power
            mine += theirs
            theirs[:] = 0.0

    @property
    def samples(self) -> np.ndarray:
        """How many samples of equal size these are worth (N,), at most as many as there are."""
        return np.divide(self.count**2, self.weights, out=np.zeros_like(self.count), where=self.weights > 0)

    @property
    def mean(self) -> np.ndarray:
        """Irradiance (3, N); zero without rounds."""
        return self.total / np.maximum(self.count, 1)

    @property
    def variance(self) -> np.ndarray:
        """Of a single round, (3, N), by what the samples' mean scatters; zero below two samples."""
        mean, samples = self.mean, self.samples
        known = samples >= LEAST_SAMPLES
        variance = self.squares - mean * (2.0 * self.crossed - mean * self.weights)
        variance *= known / (np.maximum(self.count, 1.0) * (1.0 - 1.0 / np.where(known, samples, 2.0)))
        return np.maximum(variance, 0.0, out=variance)

    def squared_error(self, value: np.ndarray, groups: PointGroups) -> np.ndarray:
        """Squared standard error (3, N) of :attr:`mean`, where all light is ``value`` (3, N); inf below two samples.

        Few samples that happen to agree do not prove that all would: to their own variance that relative one is added
        which the rounds have in the point's group, with the weight of one round, and of more where the group's points
        differ among themselves hardly more than variances of so few rounds must (empirical Bayes, as Smyth 2004).
        """
        squared, square = self.variance, value**2
        relative = np.minimum(squared / np.where(value > 0, square, np.inf), 1.0)
        usual = groups.means(relative)
        others = self._weight_of_group(relative, usual, groups)
        own = np.maximum(self.samples - 1, 0)
        # The mean of variances is right on average, and all that few samples tell. Where a group's points differ, it is
        # that of its noisy ones; for most of them the mean of the deviations is nearer.
        few = 1.0 / np.maximum(groups.means(self.samples) - 1.0, 1.0)
        alike = np.maximum(few, (others - 1.0) / (others + own))
        usual = (alike * usual + (1.0 - alike) * groups.means(np.sqrt(relative)) ** 2) * square
        squared *= own
        squared += others * usual
        # What is known from few samples may as well be more.
        squared *= 1.0 + 2.0 / (own + others)
        squared /= (own + others) * np.maximum(self.count, 1)
        squared[:, self.samples < LEAST_SAMPLES] = np.inf
        return squared

    def _weight_of_group(self, relative: np.ndarray, usual: np.ndarray, groups: PointGroups) -> np.ndarray:
        """The samples (3, N) that the mean of a group's ``relative`` variances (3, N), ``usual`` (3, N), stands for.

        Variances of normal samples with m degrees of freedom scatter by 2 / m in relative squares. What they scatter
        beyond that, c, is the points' own; the mean is then worth 2 / c of such samples.
        """
        chance = 2.0 / np.maximum(groups.means(self.samples) - 1.0, 1.0)
        scatter = groups.means(relative**2)
        scatter = np.divide(scatter, usual**2, out=np.full_like(usual, np.inf), where=usual > 0)
        own = (scatter - 1.0 - chance) / (1.0 + chance)
        return np.clip(2.0 / np.maximum(own, 2.0 / MOST_OF_GROUP), 1.0, MOST_OF_GROUP)

    def relative_variance(self, light: np.ndarray) -> np.ndarray:
        """Variance (N,) of a round's RGB sum, fully correlated, over ``light`` (N,) squared; nan below two samples."""
        red, green, blue = np.sqrt(self.variance)
        relative = (red + green + blue) / np.where(light > 0, light, np.inf)
        return np.where(self.samples >= LEAST_SAMPLES, relative**2, np.nan)


@dataclass(frozen=True)
class SampleBatch:
    """Samples of equal ``size``, in rounds, of some points.

    rows   (K,) the points, ascending
    count  (K,) > 0, of samples of each
    """

    rows: np.ndarray
    count: np.ndarray
    size: int

    @property
    def spot(self) -> np.ndarray:
        """The point (S,) of each sample."""
        return np.repeat(self.rows, self.count)


def sample_sizes(rounds: np.ndarray | int) -> np.ndarray:
    """Rounds (K,) in each sample of points that get so many ``rounds`` (K,): the largest power of two that still makes
    SAMPLES_AT_LEAST of them."""
    return 1 << np.maximum(np.frexp(np.maximum(rounds, 1) / SAMPLES_AT_LEAST)[1] - 1, 0).astype(np.int64)


def in_whole_samples(rounds: int, points: int) -> np.ndarray:
    """About so many ``rounds`` for each of so many points, (N,), that make up whole samples.

    Points round up and down in turn, to be right on average.
    """
    turn = (np.arange(points) * 0.6180339887498949) % 1.0
    size = sample_sizes(rounds)
    return size * np.maximum((rounds / size + turn).astype(np.int64), 1)


def batches(rounds: np.ndarray) -> Iterator[SampleBatch]:
    """Batches of bounded size of points that get so many ``rounds`` (K,), as far as whole samples make them up."""
    sizes = sample_sizes(rounds)
    for size in np.unique(sizes[rounds > 0]).tolist():
        rows = np.flatnonzero((sizes == size) & (rounds > 0))
        count = rounds[rows] // size
        for part in blocks(count * size, ROUNDS_PER_BATCH):
            yield SampleBatch(rows[part], count[part], size)


def net_means(found: np.ndarray, count: int) -> np.ndarray:
    """Means (S, C) over each ``count`` consecutive rows of ``found`` (S * count, C)."""
    return found.reshape(-1, count, found.shape[1]).mean(axis=1)
