"""What a bake does next: more shadow rays, more photons, or nothing, because its error, time or photons are reached.

The variance of direct light falls as 1 / rounds of shadow rays, that of the rest as 1 / photons. Each step goes where
it takes most variance away for its cost, which at the end leaves both as a least-cost bake would have them.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from .costs import CROSSING, PHOTON, PLACING_OVER_STANDING, RAY, SEGMENT
from .direct.direct_light import DirectLight
from .estimator.visible_area import SPARSE
from .irradiance import Irradiance
from .photons.photon_light import PHOTONS_PER_GATHER, PhotonLight
from .settings import BakeSettings
from .stages import Stopwatch
from .stop_rule import StopRule

#: The first steps, so that there is light to look at soon, and the variance is known: so many rounds, but no fewer rays
#: of all points, which else may well agree by luck.
FIRST_ROUNDS, FIRST_RAYS = 4, 1024
FIRST_PHOTONS = 1 << 15

#: With records, so many photons for each of their cells first, up to so many in all.
PHOTONS_PER_CELL, MOST_FIRST_PHOTONS = 8, 1 << 18

#: The first rounds of rays that look into records: the least, which serve this error, and the most; they grow as one
#: over the error squared.
LEAST_GATHER, GATHER_ERROR, MOST_GATHER = 2, 0.068, 4

#: In a bake of a given time, the share of it that each first step may take on a machine so many times slower than the
#: nominal one.
FIRST_SHARE, SLOWEST = 0.25, 2.0

#: When placing discs takes more than this share of the time that is left, their outlines are looked at sparsely.
MOST_PLACING = 0.25

#: The smallest and largest later steps.
LEAST_PHOTONS = 1 << 12
MOST_ROUNDS_PER_STEP = 64

#: A later step is no smaller than one over this of the rounds or photons before, since each has to be summed up.
LEAST_ROUNDS, LEAST_OF_PHOTONS = 4, 16

#: A later step of photons may take this share of the time that is left, even if that more than doubles them.
LEAST_OF_TIME = 0.2

#: Variance by rays over that by photons from which photons are of no use, once no more rays are cast; and the reverse.
SPENT = 2.0

#: Variance by photons over that by rays from which rays are of no use; and when photons then save less than this share
#: of what they should, the records differ by where they lie.
STUCK, STALE = 20.0, 0.2

#: A point's relative standard error counts as no more than this, so that dark corners do not take all the work.
LARGEST_ERROR = 0.5

#: What a step is expected to save at least, over what it would if variance fell as one over the rays or photons. Of
#: new photons at records only the rays see something that come after them.
LEAST_WORTH, LATE = 0.05, 0.6


@dataclass(frozen=True)
class Step:
    """So many ``rounds`` of shadow rays, or so many ``photons``."""

    rounds: int = 0
    photons: int = 0


def first_rounds(direct: DirectLight, settings: BakeSettings, start: float) -> int:
    """With how many rounds of shadow rays a bake begins: as many as a part of its time surely allows, but at least two,
    to have an error. It began at ``start`` (of time.perf_counter).
    """
    if direct.exact:
        return 1
    if settings.seconds is None or settings.indirect_by == "off":
        return max(FIRST_ROUNDS, -(-FIRST_RAYS // direct.rays_per_round))
    left = _seconds_left(settings, start)
    return int(np.clip(FIRST_SHARE * left / (SLOWEST * RAY * direct.rays_per_round), 2, FIRST_ROUNDS))


def look_in_every(settings: BakeSettings, standing: float, start: float) -> int:
    """Of the directions of a disc's outline every so many are looked in, as :func:`.visible_discs` takes it.

    To find where the points stand took ``standing`` seconds; the bake began at ``start`` (of time.perf_counter).
    """
    return 1 if PLACING_OVER_STANDING * standing <= MOST_PLACING * _seconds_left(settings, start) else SPARSE


class Refinement:
    """Chooses the steps of one bake, which began at ``start`` (of time.perf_counter), after its first rounds.

    Either of ``rays`` and ``photons`` may be None, when that light is not looked for. ``cells`` of records are lit by
    photons and looked up by rays; 0 where there are none. ``stopwatch`` has the stages shadow, trace and gather.

    Attribute ``rule``, by which the bake ends.
    """

    def __init__(
        self,
        settings: BakeSettings,
        rays: DirectLight | None,
        photons: PhotonLight | None,
        stopwatch: Stopwatch,
        start: float,
        cells: int = 0,
    ):
        self._settings, self._rays, self._photons, self._cells = settings, rays, photons, cells
        self._stopwatch, self._start = stopwatch, start
        self.rule = StopRule(settings, rays, photons, cells)
        # Rays see new photons at records only when they are cast after them: so many rounds are due.
        first = LEAST_GATHER * (GATHER_ERROR / (settings.aimed_noise or GATHER_ERROR)) ** 2
        self._due = int(np.clip(first, LEAST_GATHER, MOST_GATHER)) if cells else 0
        # What rays and photons leave of the error; what a step of each saved of late, over what it was to save; and how
        # many there were before.
        self._parts, self._worth, self._before = (0.0, 0.0), [1.0, 1.0], (0, 0)

    def observe(self, by_rays: Irradiance, by_photons: Irradiance, light: Irradiance, error: float) -> None:
        """Look at what has been found: ``light`` is all, blur included, the others what more of each would mend.

        ``error`` is the median relative one of all points that count.
        """
        self.rule.error = error
        if self._photons is not None and self._cells and self._due:
            return
        self.rule.look(light, by_photons)
        lit = np.flatnonzero(np.abs(light.value).sum(axis=1) > 0)
        if self.rule.half_well:
            weights = np.zeros(len(lit)) if self.rule.missing is None else self.rule.missing[lit].astype(float)
        else:
            weights = _weights(light.relative_errors, error)
        parts = _mean_variance(by_rays, light, lit, weights), _mean_variance(by_photons, light, lit, weights)
        self._learn(parts)
        self._parts = parts

    def _learn(self, parts: tuple[float, float]) -> None:
        """See what the last step saved: the more photons there are, the smaller the discs they are used in."""
        amounts = self._amounts
        for kind, (before, now) in enumerate(zip(self._before, amounts, strict=True)):
            promised = self._parts[kind] * (1.0 - before / now) if 0 < before < now else 0.0
            if np.isfinite(promised) and promised > 0.0:
                kept = np.clip((self._parts[kind] - parts[kind]) / promised, LEAST_WORTH, 1.0)
                self._worth[kind] = 0.5 * (self._worth[kind] + float(kept))
        self._before = amounts

    @property
    def _amounts(self) -> tuple[int, int]:
        """Rounds of rays and photons so far."""
        rounds = 0 if self._rays is None else self._rays.done
        return rounds, 0 if self._photons is None else self._photons.particles

    def next(self) -> Step | None:
        """The next step; None when the bake is done."""
        if self._photons is not None and self._photons.particles == 0:
            return Step(photons=min(self._first_photons(), self._settings.most_photons or FIRST_PHOTONS))
        if self._due:
            due, self._due = self._due, 0
            return Step(rounds=due)
        if self.rule.dark or self.rule.reached:
            return None
        rays, photons = self._more_rays(), self._more_photons()
        if rays is not None and photons is None and self._photons is not None and self._settings.aimed_noise is None:
            # The photons are used up, and their noise will remain.
            return None if self.rule.fine or self._gain(rays) <= self._gain(Step(photons=1)) else self._in_time(rays)
        if rays is None and photons is not None and self._parts[0] > SPENT * self._parts[1]:
            return None  # the rays are used up, and more photons would not help
        if self._cells and photons is None and self._parts[1] > SPENT * self._parts[0]:
            return None  # the other way round
        if self._cells and photons is None and self.rule.flat:
            return None
        step = max(filter(None, (rays, photons)), key=self._gain, default=None)
        if step is not None and step.photons and self._stale():
            return None  # records are off by where they lie, and more photons do not help
        step = None if step is None else self._in_time(step)
        if step is not None and step.photons and self._cells:
            self._due = max(min(self._rays.done // 2, MOST_ROUNDS_PER_STEP), 1)
        return step

    @property
    def fraction(self) -> float:
        """The share done, 0..1, of what the settings ask for."""
        shares = [0.0]
        if self._settings.seconds is not None:
            shares.append((time.perf_counter() - self._start) / self._settings.seconds)
        if self._settings.photons is not None and self._photons is not None:
            shares.append(self._photons.particles / self._settings.photons)
        if self._settings.aimed_noise is not None and self.rule.error > 0:
            shares.append((self._settings.aimed_noise / self.rule.error) ** 2)
        return float(min(max(shares), 1.0))

    def _stale(self) -> bool:
        """Whether records differ by as much as before, however many photons light them.

        An error that was asked for by its number has more patience: the next photons may tell otherwise.
        """
        rays, photons = self._parts
        asked = self._settings.error is not None
        return not asked and self._cells > 0 and self._worth[1] < STALE and photons > STUCK * rays

    def _more_rays(self) -> Step | None:
        if self._rays is None or self._rays.exact or np.isnan(self.rule.error) or self.rule.rays_given_up:
            return None
        done = self._rays.done
        wanted = min(done, MOST_ROUNDS_PER_STEP)
        if self.rule.missing is not None:
            return Step(rounds=max(done - self.rule.common_rounds, wanted))
        if self._settings.aimed_noise is not None and np.isfinite(self.rule.over):
            least = int(np.ceil(done * (self.rule.over**2 - 1.0)))
            wanted = min(wanted, max(least, done // LEAST_ROUNDS, 1))
        return Step(rounds=wanted)

    def _more_photons(self) -> Step | None:
        if self._photons is None or self.rule.photons_given_up:
            return None
        done, wanted = self._photons.particles, self._photons.particles
        if np.isfinite(self._left):
            # Summing up takes time as well, so that short bakes should not take many steps.
            wanted = max(wanted, int(LEAST_OF_TIME * self._left / max(self._measured(Step(photons=1)), 1e-12)))
        wanted = min(wanted, PHOTONS_PER_GATHER)
        if self._settings.aimed_noise is not None and np.isfinite(self.rule.over):
            least = max(done * (self.rule.over**2 - 1.0), done / (1 if self._cells else LEAST_OF_PHOTONS))
            wanted = min(wanted, max(1, int(np.ceil(least / LEAST_PHOTONS))) * LEAST_PHOTONS)
        if self._settings.most_photons is not None:
            wanted = min(wanted, self._settings.most_photons - done)
        return Step(photons=wanted) if wanted > 0 else None

    def _gain(self, step: Step) -> float:
        """Variance that ``step`` takes away, over its cost."""
        kind, more = (0, step.rounds) if step.rounds else (1, step.photons)
        saved = self._worth[kind] * self._parts[kind] * more / (self._amounts[kind] + more)
        return saved * (LATE if kind and self._cells else 1.0) / max(self._cost(step), 1e-12)

    def _cost(self, step: Step) -> float:
        """Seconds of a step: measured where time is what counts, else nominal."""
        if self._settings.seconds is not None:
            return self._measured(step)
        if step.rounds:
            share = 1.0 if self.rule.missing is None else float(self.rule.missing.mean())
            return step.rounds * self._rays.rays_per_round * RAY * share
        found = self._photons.segments * SEGMENT + self._photons.crossings * CROSSING
        return step.photons * found / self._photons.particles

    def _measured(self, step: Step) -> float:
        seconds = self._stopwatch.seconds
        if step.rounds:
            return step.rounds * seconds["shadow"] / self._rays.done
        return step.photons * (seconds["trace"] + seconds["gather"]) / self._photons.particles

    @property
    def _left(self) -> float:
        """Seconds that are left."""
        return _seconds_left(self._settings, self._start)

    def _first_photons(self) -> int:
        """Fewer when time is short, but never none: without reflected light a scene looks wrong."""
        affordable = FIRST_SHARE * self._left / (SLOWEST * PHOTON)
        first = np.clip(PHOTONS_PER_CELL * self._cells, FIRST_PHOTONS, MOST_FIRST_PHOTONS)
        return int(np.clip(affordable, LEAST_PHOTONS, first))

    def _in_time(self, step: Step) -> Step | None:
        """The step, or as much of it as the time that is left allows; None when that is nothing."""
        share = self._left / max(self._measured(step), 1e-12) if np.isfinite(self._left) else 1.0
        if share >= 1.0:
            return step
        if step.rounds:
            rounds = int(step.rounds * share)
            return Step(rounds=rounds) if rounds > 0 else None
        photons = int(step.photons * share)
        return Step(photons=photons) if photons >= LEAST_PHOTONS else None


def _seconds_left(settings: BakeSettings, start: float) -> float:
    """Of a bake that began at ``start`` (of time.perf_counter); inf when its time is not limited."""
    return np.inf if settings.seconds is None else settings.seconds - (time.perf_counter() - start)


def _weights(errors: np.ndarray, median: float) -> np.ndarray:
    """How much the ``median`` error of all points falls with each one's variance, given its standard error (L,).

    With errors e and the median m, mean erf(m / (e sqrt 2)) = 1/2, see irradiance.py; the derivative of m by e^2 is in
    proportion to exp(-m^2 / 2 e^2) / e^3. Points that are far better or far worse hardly matter.
    """
    if not (np.isfinite(median) and median > 0):
        return np.ones(len(errors))
    ratio = np.clip(errors / median, 0.01, 100.0)
    return np.exp(-0.5 / ratio**2) / ratio**3


def _mean_variance(part: Irradiance, light: Irradiance, rows: np.ndarray, weights: np.ndarray) -> float:
    """Weighted mean over some points of the squared error of a ``part`` over all ``light``."""
    total = weights.sum()
    relative = part.standard_error[rows].sum(axis=1) / np.abs(light.value[rows]).sum(axis=1)
    return float(weights @ np.minimum(relative, LARGEST_ERROR) ** 2 / total) if total > 0 else 0.0
