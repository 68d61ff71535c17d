"""When a bake is good enough, or will not get better: by the median error of its points, and by neighbourhoods of which
the median of all says nothing."""

from __future__ import annotations

import numpy as np

from .direct.direct_light import DirectLight
from .irradiance import Irradiance, error_within, share_within
from .photons.photon_light import PhotonLight
from .settings import NOISE_SHARE, BakeSettings

#: Rounds after which rays have gone where the first ones that looked into records found light. Those found it by luck,
#: so that before no points are done as long as a tenth of them are likely to be far off.
AIMED_AFTER = 12

#: Rounds of rays after which only light that is never found can still be missing.
MOST_ROUNDS = 512

#: Photons of which none reached a point are enough to call the points dark.
DARK_AFTER = 1 << 18

#: When photons are used up, more rays are of no use if half as many again, or more, left this share of the error.
FLAT, HALF_AGAIN = 0.95, 1.5

#: A number of photons says nothing of the error; rays are cast until they are as good, but no further than to this
#: share of the quality's error, with nine tenths of the points within TIMES as much as the quality's: where little
#: light is reflected, photons leave next to nothing to be as good as.
FINE = 0.25

#: Once half of the points keep to the error that is aimed at, neighbourhoods in which more than such a share of the
#: points are off by more than so many times that error are worked on, until they hold few of all points.
BEYOND, TIMES, FEW = 0.3, 3.0, 0.01

#: So are those of whose points more than such a share are off by more than the error itself by what photons left at
#: records: a whole wall has that in common, and no eye averages it out.
ALIKE, FEW_ALIKE = 0.5, 0.002

#: Such neighbourhoods are given up after so many rounds of rays of their own, or rays for each of all points on average
#: for an error of 4 % (their number grows as one over its square). An error that was asked for gives up after PATIENCE
#: times as many rays.
MOST_OWN_ROUNDS, MOST_RAYS, PATIENCE = 512, 150.0, 4.0

#: And when the photons have become so many times as many, but not before so many for an error of 4 %.
MORE_PHOTONS, PHOTONS_FOR_FEW = 4.0, 1 << 18

#: They are given up as well when all rays have become so many times as many, unless they are off by even more: by FAR
#: times the error. Where the light is hard to find in much of a scene, the last of it is not worth more than all.
MORE_RAYS, FAR = 1.5, 6.0


def far_off(light: Irradiance, error: float, rays: DirectLight | None, share: float = BEYOND) -> np.ndarray:
    """Which points (N,) belong to neighbourhoods, as ``rays`` know them, in which more than that ``share`` are off from
    the light by more than the ``error``."""
    errors = light.seen_errors
    with np.errstate(divide="ignore"):
        beyond = np.where(errors > 0, 1.0 - share_within(error / errors), 0.0)
    return (beyond if rays is None else rays.around_each(beyond)) > share


class StopRule:
    """Whether one bake has what was asked for, or will not get it, by what is seen each time that light was found.

    Either of ``rays`` and ``photons`` may be None, when that light is not looked for. ``cells`` of records are lit by
    photons and looked up by rays; 0 where there are none.

    Attributes: ``error``, the median relative one of all points that count; ``over``, that error, or that of what is
    worked on, over what is aimed at; ``missing`` (N,), points whose neighbourhoods are worked on, None for all;
    ``half_well``, whether half of the points keep to the error that is aimed at; ``fine``, whether the error is so
    small that nobody would ask for less, where none was asked for.
    """

    def __init__(self, settings: BakeSettings, rays: DirectLight | None, photons: PhotonLight | None, cells: int):
        self._settings, self._rays, self._photons, self._cells = settings, rays, photons, cells
        self.error, self.over, self.half_well, self.fine = float("nan"), 0.0, False, False
        self.missing: np.ndarray | None = None
        self._last, self._rounds_before, self._flat = float("nan"), 0, False
        # Rounds, photons and rays when half of the points first were well; whether neighbourhoods are very far off.
        self._well: tuple[int, int, int] | None = None
        self._very_far = False

    def look(self, light: Irradiance, by_photons: Irradiance) -> None:
        """Look at all the ``light``, blur included, and at what more photons would mend of it; ``error`` is known."""
        rounds, goal, aim = self._rounds, self._settings.aimed_noise, NOISE_SHARE * self._settings.target_error
        self._flat = rounds >= max(HALF_AGAIN * self._rounds_before, AIMED_AFTER) and self.error > FLAT * self._last
        self._last, self._rounds_before = self.error, rounds
        self.fine = rounds >= AIMED_AFTER and self.error <= FINE * aim and light.high_error <= TIMES * aim
        self.missing, self.over, self.half_well = None, 0.0, False
        if goal is not None and np.isfinite(self.error):
            self.over = self.error / goal
            if self._cells and self._rays.done < AIMED_AFTER:
                self.over = max(self.over, light.high_error / (TIMES * goal))
            self.half_well = self.over <= 1.0
            if self.half_well:
                self._well = self._well or (rounds, self._particles, 0 if self._rays is None else self._rays.rays)
                self._look_for_missing(light, by_photons, goal)

    def _look_for_missing(self, light: Irradiance, by_photons: Irradiance, goal: float) -> None:
        """Find the neighbourhoods in which too many points are far off, and by how much they are over their aim."""
        self.over, self._very_far = 0.0, False
        parts = [(light, TIMES * goal, BEYOND, FEW)]
        if self._cells:
            parts.append((Irradiance(light.value, by_photons.standard_error), goal, ALIKE, FEW_ALIKE))
        for part, error, share, few in parts:
            missing = far_off(part, error, self._rays, share)
            if missing.mean() > few:
                self.missing = missing if self.missing is None else self.missing | missing
                self.over = max(self.over, error_within(part.seen_errors[missing], 1.0 - share) / error)
        if self.missing is not None:
            self._very_far = far_off(light, FAR * goal, self._rays).mean() > FEW

    @property
    def _rounds(self) -> int:
        return 0 if self._rays is None else self._rays.done

    @property
    def _particles(self) -> int:
        return 0 if self._photons is None else self._photons.particles

    @property
    def reached(self) -> bool:
        """Whether the error that was asked for is."""
        goal = self._settings.aimed_noise
        return goal is not None and self.error <= goal and self.over <= 1.0

    @property
    def dark(self) -> bool:
        """Whether so many photons have found nothing that there is nothing to find."""
        if not np.isnan(self.error):
            return False
        return self._photons is None or (self._settings.photons is None and self._particles >= DARK_AFTER)

    @property
    def flat(self) -> bool:
        """Whether many more rays have hardly brought the error down: what is left of it is in the records."""
        return self._flat and self.missing is None

    @property
    def common_rounds(self) -> int:
        """Rounds of rays from all points; others were for neighbourhoods that were far off."""
        return self._rounds if self._well is None else self._well[0]

    @property
    def rays_given_up(self) -> bool:
        """Whether more of them are of no use, or not worth what they take."""
        if self.missing is None:
            return self._rounds >= MOST_ROUNDS
        return self._rounds - self._well[0] >= MOST_OWN_ROUNDS or self._rays.rays > self._most_rays

    @property
    def _most_rays(self) -> float:
        patience = 1.0 if self._settings.error is None else PATIENCE
        most = patience * MOST_RAYS * self._times * self._rays.points
        return most if self._very_far else min(most, MORE_RAYS * self._well[2])

    @property
    def photons_given_up(self) -> bool:
        """Whether neighbourhoods that are far off have had so many of them that more will not help."""
        if self.missing is None:
            return False
        return self._particles >= max(MORE_PHOTONS * self._well[1], PHOTONS_FOR_FEW * self._times)

    @property
    def _times(self) -> float:
        """How many times as many rays or photons the error that is aimed at takes as one of 4 %."""
        return (0.04 / self._settings.aimed_noise) ** 2
