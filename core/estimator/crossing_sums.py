"""What crossings of discs add up to, piece by piece of a batch of particles: from there estimates are made."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from ..discs import TangentDiscs
from ..gatherers.gatherer import Crossings
from ..parallel import ordered_map, slices
from ..segments import Segments
from .estimate import IrradianceEstimate
from .repeated_crossings import RepeatedCrossings
from .rings import OUTSIDE
from .visible_area import VisibleArea

#: Crossings that are looked at in one array, side by side with others.
CROSSINGS_PER_CHUNK = 1 << 14


@dataclass(frozen=True)
class CrossingSums:
    """What the crossings of N discs, of K rings each, by some segments add up to: no more than what they crossed.

    crossings, segments  how many were found, and searched
    power     (3,) the sum of all segments' squared flux, W^2
    place     (E,) disc * K + ring of all that were crossed, ascending
    total     (E, 3) the sum of their crossings' flux, W, RGB
    squares   (E, 3) of its square, W^2
    contrasts (E, 3) of it, RGB sum, with signs, W, see :class:`.IrradianceEstimate`
    disc      (D,) discs that particles crossed more than once, ascending
    repeated  (D, 3) what the squares of the particles' sums are more than the sums of squares, W^2
    common    the sum over particles of what each gives all discs together, W/m^2, RGB sum, and of its square
    """

    crossings: int
    segments: int
    power: np.ndarray
    place: np.ndarray
    total: np.ndarray
    squares: np.ndarray
    contrasts: np.ndarray
    disc: np.ndarray
    repeated: np.ndarray
    common: tuple[float, float]

    def among(self, discs: np.ndarray, rings: int) -> CrossingSums:
        """The same, of which some ``discs``, ascending, of so many ``rings`` are all that were crossed."""
        disc, ring = np.divmod(self.place, rings)
        return replace(self, place=np.searchsorted(discs, disc) * rings + ring, disc=np.searchsorted(discs, self.disc))


class Accumulator:
    """Adds the crossings of ``discs`` by some ``segments``, all of their particles, up to :class:`CrossingSums`.

    Only crossings inside the ``visible`` area count, by its K rings. Attributes ``total`` (N, K, 3) W and ``squares``
    (N, K, 3) W^2: the sums of the segments' flux, as they carry it, and of its square; ``contrasts`` (N, K, 3) W,
    see :class:`.IrradianceEstimate`, zero unless they are wanted.
    """

    def __init__(self, discs: TangentDiscs, segments: Segments, visible: VisibleArea, contrasts: bool = True):
        self._discs, self._segments, self._visible, self._contrasts = discs, segments, visible, contrasts
        self._areas = visible.nested
        self.total, self.squares, self.contrasts = np.zeros((3, *self._areas.shape, 3))
        self._crossed = np.zeros(self._areas.size, bool)
        self._count = 0
        self._repeated = RepeatedCrossings(len(discs), segments)
        self._first = int(segments.particle.min()) if segments.particle is not None and len(segments) else 0
        self._alone = np.zeros(0)

    def add(self, crossings: Crossings) -> np.ndarray:
        """Count these crossings in, each pair of which must come once; returns which (C,) were counted."""
        look = partial(self._visible.rings, self._discs, self._segments)
        found = ordered_map(look, map(crossings.taken, slices(len(crossings), CROSSINGS_PER_CHUNK)))
        ring = np.concatenate([np.empty(0, np.uint8), *found])
        kept = ring != OUTSIDE
        inside, (discs, rings) = crossings.taken(kept), self._areas.shape
        place = inside.disc * rings + ring[kept]
        self._crossed[place] = True
        self._count += len(crossings)
        for channel in range(3):
            flux = self._segments.flux[:, channel].take(inside.segment)
            parts = [(self.total, flux), (self.squares, flux * flux)]
            if self._contrasts:
                parts.append((self.contrasts, self._signed[channel].take(inside.segment)))
            for sums, part in parts:
                sums[:, :, channel] += np.bincount(place, part, discs * rings).reshape(discs, rings)
        if self._segments.particle is not None:
            self._repeated.add(inside)
            self._add_alone(inside)
        return kept

    @cached_property
    def _signed(self) -> np.ndarray:
        """Flux (3, S) of the segments, RGB sum, with the signs of their particle's halves."""
        particle = self._segments.particle
        number = np.arange(len(self._segments)) if particle is None else particle
        two, four = (np.where(number & bit, -1.0, 1.0) for bit in (2, 4))
        return np.stack([two, four, two * four]) * self._segments.flux.sum(axis=1)

    def _add_alone(self, crossings: Crossings) -> None:
        """Count what each particle gives all points together."""
        if len(crossings) == 0:
            return
        particle = self._segments.particle.take(crossings.segment).astype(np.int64) - self._first
        flux = self._segments.flux.sum(axis=1).take(crossings.segment)
        alone = np.bincount(particle, flux / self._areas[:, 0].take(crossings.disc), len(self._alone))
        alone[: len(self._alone)] += self._alone
        self._alone = alone

    def sums(self) -> CrossingSums:
        """What has been added up so far."""
        place, repeated = np.flatnonzero(self._crossed), self._repeated.products()
        disc = np.flatnonzero(repeated.any(axis=1))
        sums = (part.reshape(-1, 3).take(place, axis=0) for part in (self.total, self.squares, self.contrasts))
        common = float(self._alone.sum()), float(self._alone @ self._alone)
        power = (self._segments.flux**2).sum(axis=0)
        return CrossingSums(
            self._count, len(self._segments), power, place, *sums, disc, repeated.take(disc, axis=0), common
        )

    def estimate(self, particles: int) -> IrradianceEstimate:
        """The estimate by these segments alone, of so many ``particles``."""
        batch = BatchSums(self._areas)
        batch.add(self.sums())
        return batch.estimate(particles)


class BatchSums:
    """The sums of a whole batch, whose segments carry the scene's full power together, over discs of nested ``areas``
    (N, K) m^2."""

    def __init__(self, areas: np.ndarray):
        self._areas = areas
        self._total, self._squares, self._contrasts = np.zeros((3, areas.size, 3))
        self._repeated, self._power = np.zeros((len(areas), 3)), np.zeros(3)
        self._segments, self._common = 0, np.zeros(2)

    def add(self, sums: CrossingSums) -> None:
        """Count in what other segments of the batch add up to."""
        self._total[sums.place] += sums.total
        self._squares[sums.place] += sums.squares
        self._contrasts[sums.place] += sums.contrasts
        self._repeated[sums.disc] += sums.repeated
        self._power += sums.power
        self._common += sums.common
        self._segments += sums.segments

    def estimate(self, particles: int) -> IrradianceEstimate:
        """The estimate by the batch, of so many ``particles``."""
        # The segments carry the scene's full power together: a particle alone would, times their number.
        sums = self._total, self._squares, self._contrasts
        total, squares, contrasts = (part.reshape(*self._areas.shape, 3) for part in sums)
        second = (part * particles**2 for part in (squares, self._repeated, self._single(total, squares)))
        share = particles / max(len(self._areas), 1)
        common = float(self._common[0] * share), float(self._common[1] * share**2)
        return IrradianceEstimate(total * particles, *second, contrasts * particles, self._areas, particles, common)

    def _single(self, total: np.ndarray, squares: np.ndarray) -> np.ndarray:
        """Squared flux (N, 3) of a crossing more: the mean of the disc's own crossings and one like those of all discs.

        Aimed lights send particles of unlike flux to unlike places, so that all segments' mean says little of a disc.
        As many equal crossings as would have the same sums count, (sum f)^2 / sum f^2.
        """
        total, squares = total.sum(axis=1), squares.sum(axis=1)
        equal = np.divide(total**2, squares, out=np.zeros_like(squares), where=squares > 0)
        mean = self._power / max(self._segments, 1)
        everywhere = np.divide(squares.sum(axis=0), equal.sum(axis=0), out=mean, where=equal.any(axis=0))
        return (squares + everywhere) / (equal + 1.0)
