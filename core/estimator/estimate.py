"""From sums over crossings to irradiance: the density estimate, and its standard error."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..errors import InvalidArrayError
from ..irradiance import Irradiance
from ..parallel import ordered_map, slices
from .nested_discs import nested_estimate

#: Points that are worked out together, so that their arrays stay in the processor's cache.
POINTS_PER_CHUNK = 1 << 12


@dataclass(frozen=True)
class IrradianceEstimate:
    """Irradiance at N points as sums over independent particles, so that two estimates of the same points merge.

    A particle alone, scaled to the scene's full power, would send X through a ring of a point's disc; then

    total     (N, K, 3) sum of X over the particles, W, RGB, by the rings of rings.py
    squares   (N, K, 3) sum of its crossings' squares, W^2
    repeated  (N, 3) what the squares of the sums are more than that, since particles come again, W^2
    single    (N, 3) square that one crossing more would likely bring, W^2
    contrasts (N, K, 3) sum of X, RGB sum, of one half of the particles, less that of the other, W: by whether their
              number has a 2 in it, a 4, and just one of both
    areas     (N, K) m^2 of the nested discs
    samples   how many particles there are
    common    the sum over particles of what each alone would give all points' mean, W/m^2, RGB sum, and of its square:
              what is wrong with all of them at once, which no single point tells
    """

    total: np.ndarray
    squares: np.ndarray
    repeated: np.ndarray
    single: np.ndarray
    contrasts: np.ndarray
    areas: np.ndarray
    samples: int
    common: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def empty(cls, areas: np.ndarray) -> IrradianceEstimate:
        """The estimate before the first particle, of discs whose nested ``areas`` (N, K) m^2 are given."""
        rings, whole = (*areas.shape, 3), (len(areas), 3)
        return cls(np.zeros(rings), np.zeros(rings), np.zeros(whole), np.zeros(whole), np.zeros(rings), areas, 0)

    @property
    def common_error(self) -> float:
        """Relative standard error of the mean over all points; 0 when it is dark."""
        total, squares = self.common
        if self.samples < 2 or total == 0.0:
            return 0.0
        return float(np.sqrt(max(squares * self.samples / total**2 - 1.0, 0.0) / (self.samples - 1)))

    @cached_property
    def irradiance(self) -> Irradiance:
        """The irradiance by :mod:`.nested_discs`, and its standard error.

        The flux of the segments that cross a disc over its area [study, DETP] is the mean of X over A, and has the
        variance (mean (X/A)^2 - (mean X/A)^2) / (n - 1). The standard error counts one crossing more than there were:
        where few crossed, and least of all where none did, the crossings alone do not tell how many it might have been
        (as Agresti and Coull 1998 do for proportions). From few particles it is widened as Student's t asks, so that
        twice of it holds 95 % at any number. The blur that is known to be left counts in it.
        """
        value, noise, blur, _ = self._found
        return Irradiance(value, np.hypot(noise, blur))

    @property
    def noise(self) -> Irradiance:
        """The same without the blur in the standard error: what goes as one over the root of the particles."""
        value, noise, _, _ = self._found
        return Irradiance(value, noise)

    @property
    def with_contrasts(self) -> np.ndarray:
        """The irradiance, and what halves of the particles differ by from it in three ways, RGB sum: (N, 6) W/m^2."""
        value, _, _, differ = self._found
        return np.column_stack([value, differ])

    @cached_property
    def _found(self) -> np.ndarray:
        """Irradiance, noise, blur and contrasts, (4, N, 3) W/m^2."""
        count = len(self.total)
        found = np.empty((4, count, 3))
        chunks = slices(count, POINTS_PER_CHUNK)
        for rows, some in zip(chunks, ordered_map(self._estimated, chunks), strict=True):
            found[:, rows] = some
        return found

    def _estimated(self, rows: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        samples, areas = max(self.samples, 1), self.areas[rows]
        sums = self.total, self.squares, self.single, self.contrasts
        value, moment, blur, differ = nested_estimate(*(part[rows] / samples for part in sums), areas, samples)
        if samples < 2:
            return value, np.full(value.shape, np.inf), np.zeros(value.shape), differ
        # Particles that come again do so anywhere on the disc: their products hardly differ from ring to ring.
        moment += self.repeated[rows] / (samples * areas[:, :1] ** 2)
        variance = np.maximum(moment - value**2, 0.0) / (samples - 1)
        return value, _student(samples - 1) * np.sqrt(variance), np.sqrt(blur), differ

    def merged(self, other: IrradianceEstimate) -> IrradianceEstimate:
        """This estimate together with an independent one of the same points.

        Raises InvalidArrayError when the number of points differs.
        """
        if self.total.shape != other.total.shape:
            raise InvalidArrayError("Only estimates of the same points can be merged.")
        samples = self.samples + other.samples
        single = (self.single * self.samples + other.single * other.samples) / max(samples, 1)
        sums = {name: getattr(self, name) + getattr(other, name) for name in _SUMS}
        return replace(self, **sums, single=single, samples=samples, common=tuple(np.add(self.common, other.common)))

    def taken(self, rows: np.ndarray) -> IrradianceEstimate:
        """That of some ``rows`` of points alone."""
        return replace(self, **{name: getattr(self, name)[rows] for name in (*_SUMS, "single", "areas")})

    def exchanged(self, gone: IrradianceEstimate, come: IrradianceEstimate) -> IrradianceEstimate:
        """This estimate with what some of its particles brought, ``gone``, exchanged for what has ``come``.

        Both count the same ``samples`` as this one.
        """
        sums = {name: getattr(self, name) - getattr(gone, name) + getattr(come, name) for name in _SUMS}
        # Differences of what is equal leave rounding, which must not become light or negative squares.
        rounding = _ROUNDING * (self.squares + come.squares)
        sums["squares"] = np.where(sums["squares"] > rounding, sums["squares"], 0.0)
        sums["total"] = np.where(sums["squares"] > 0.0, sums["total"], 0.0)
        return replace(self, **sums, common=tuple(np.add(np.subtract(self.common, gone.common), come.common)))


#: what is summed over particles, and the share that differences of such sums may be off by
_SUMS, _ROUNDING = ("total", "squares", "repeated", "contrasts"), 1e-12


def _student(freedom: int) -> float:
    """The 97.5 % quantile of Student's t over that of the normal distribution (Abramowitz and Stegun 26.7.5)."""
    z = 1.959964
    terms = (
        z,
        (z**3 + z) / 4,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
    )
    return sum(term / freedom**power for power, term in enumerate(terms)) / z
