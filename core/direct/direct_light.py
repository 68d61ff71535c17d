"""Direct light by shadow rays: from each point to the lights, and where light surrounds it, to where it was found.

Rays come in rounds. After the first ones, groups of neighbouring points know from which directions light reaches them,
and aim there; and points among others whose light is sure already are given fewer rounds.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..gatherers.ranges import blocks
from ..irradiance import Irradiance
from ..parallel import ordered_map
from ..photons.emission import lights_of
from ..rays import RayCaster
from ..scene import Scene
from ..settings import BakeSettings
from .direction_guide import DirectionSums
from .lamp_light import LampLight
from .point_groups import PointGroups
from .round_plan import planned
from .round_sums import RoundSums
from .shadows import Shadows
from .spots import Spots
from .surrounding_light import SurroundingLight

#: Rays from each point in one round to the lamps, to each of the surroundings, and by chance; a power of two.
RAYS_PER_ROUND = 4

#: Up to so many lamps without extent are all asked, exactly; of more, as of lamps with extent, some are chosen.
MOST_SHARP_LAMPS = 32

#: Points whose rays are cast at a time.
POINTS_PER_CHUNK = 1 << 12

#: After so many rounds it is learnt where light comes from, then whenever they have doubled, and last after so many.
LEARN_AFTER, LEARN_LAST = 4, 64

#: The first rounds count this much or more of what later ones do, however much noisier they were.
LEAST_WEIGHT = 1 / 64


class DirectLight:
    """Direct irradiance at ``points`` (N, 3) m, which lie clear of surfaces, with unit ``normals`` (N, 3).

    What one ray tells exactly is found once; the rest is the mean over rounds of rays, each of which is an independent
    estimate. Equal seeds give equal results on any number of threads. Surfaces farther than the settings' shadow
    distance do not shade a point from the world.

    Attributes ``done``: how many rounds there were, of all points on average; ``rays``: how many rays they cast.
    """

    def __init__(
        self, scene: Scene, caster: RayCaster, points: np.ndarray, normals: np.ndarray, settings: BakeSettings
    ):
        self._seed = settings.seed
        self._shadows = Shadows(scene, caster)
        lights = lights_of(scene)
        surroundings = [light for light in lights if hasattr(light, "met")]
        lamps = [light for light in lights if not hasattr(light, "met")]
        sharp = [lamp for lamp in lamps if lamp.sharp]
        sharp = sharp if len(sharp) <= MOST_SHARP_LAMPS else []
        self._sharp = LampLight(sharp, self._shadows, 1)
        self._lamps = LampLight([lamp for lamp in lamps if lamp not in sharp], self._shadows, RAYS_PER_ROUND)
        reach = settings.shadow_distance or np.inf
        self._surroundings = SurroundingLight(surroundings, self._shadows, reach, RAYS_PER_ROUND)
        self._groups = PointGroups.of(points, normals)
        self._points, self._normals = points[self._groups.order], normals[self._groups.order]
        self._place = np.empty_like(self._groups.order)
        self._place[self._groups.order] = np.arange(len(points))
        self._exact = np.zeros((3, len(points)))
        # By chosen lamps, and by surroundings before and after it was learnt where their light comes from.
        self._by_lamps, self._before, self._after = (RoundSums.of(len(points)) for _ in range(3))
        self._seen, self._guide = DirectionSums(len(self._groups.start) - 1), None
        self.done, self.rays = 0, 0

    @property
    def exact(self) -> bool:
        """Whether no further round would change anything after the first."""
        return self.rays_per_round == 0

    @property
    def rays_per_round(self) -> int:
        """Rays that one round casts, of all points."""
        return len(self._points) * (self._lamps.rays_per_round + self._surroundings.rays_per_round)

    @property
    def irradiance(self) -> Irradiance:
        """What has been found so far."""
        first = self._first_share(self._relative_light())
        value = self._exact + self._by_lamps.mean + first * self._before.mean + (1.0 - first) * self._after.mean
        squared = np.zeros_like(value)
        if self._lamps.rays_per_round:
            squared += self._by_lamps.squared_error(value, self._groups)
        if self._surroundings.rays_per_round:
            for sums, share in ((self._before, first), (self._after, 1.0 - first)):
                if share.any():
                    with np.errstate(invalid="ignore"):
                        error = share**2 * sums.squared_error(value, self._groups)
                    squared += np.where(share == 0.0, 0.0, error)
        given = (np.ascontiguousarray(part.T).take(self._place, axis=0) for part in (value, np.sqrt(squared)))
        return Irradiance(*given)

    def rounds(self, first: int, last: int, other: np.ndarray | None = None) -> Iterator[float]:
        """Cast the rays of the rounds from ``first`` to before ``last``, yielding the share of them done (0..1).

        Points with ``other`` (N, 3) W/m^2 light, which is found in another way, need less of these rays.
        """
        groups = list(blocks(np.diff(self._groups.start), POINTS_PER_CHUNK))
        other = None if other is None else other[self._groups.order]
        begin = first
        while begin < last:
            # Steps end where the rounds have doubled, whoever asks for how many of them.
            end = min(last, max(LEARN_AFTER, 1 << begin.bit_length()))
            plan = self._plan(begin, end, other)
            cast = ordered_map(lambda part, begin=begin, plan=plan: self._cast(part, begin, plan), groups)
            for part, _ in zip(groups, cast, strict=True):
                share = self._groups.start[part.stop] / len(self._points)
                yield min((begin - first + share * (end - begin)) / (last - first), 1.0)
            if LEARN_AFTER <= end <= LEARN_LAST and end & (end - 1) == 0 and self._surroundings.rays_per_round:
                self._guide = self._seen.guide()
            costs = self._lamps.rays_per_round, self._surroundings.rays_per_round
            self.rays += sum(cost * int(rounds.sum()) for cost, rounds in zip(costs, plan, strict=True))
            begin = self.done = end

    def _plan(self, begin: int, end: int, other: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Rounds (N,) that each point shall have next, of lamps and of surroundings."""
        light = self._relative_light(other)
        before, after = (self._groups.of_others(s.relative_variance(light)) for s in (self._before, self._after))
        lamps = self._groups.of_others(self._by_lamps.relative_variance(light))
        had = self._after.count + self._before.count * _trust(before, after)
        return planned(
            end - begin,
            (self._by_lamps.count, had),
            (lamps, np.where(np.isnan(after), before, after)),
            (self._lamps.rays_per_round, self._surroundings.rays_per_round),
        )

    def _relative_light(self, other: np.ndarray | None = None, rows: slice = slice(None)) -> np.ndarray:
        """All light (K,) at those ``rows``, RGB sum, by plain means, to which errors are relative."""
        lamps, before, after = (sums.part(rows) for sums in (self._by_lamps, self._before, self._after))
        value = self._exact[:, rows] + lamps.mean
        value += (before.total + after.total) / np.maximum(before.count + after.count, 1)
        if other is not None:
            value += other[rows].T
        red, green, blue = np.abs(value, out=value)
        return red + green + blue

    def _first_share(self, light: np.ndarray) -> np.ndarray:
        """Share (N,) that the rounds before learning have in the light of surroundings.

        It rests on how noisy the rounds were at the *other* points of the group, so that it is independent of what this
        point's own rounds found, and biases nothing. A single round after learning does not count: nobody knows how
        noisy it is.
        """
        before, after = (self._groups.of_others(s.relative_variance(light)) for s in (self._before, self._after))
        weight = self._before.count * _trust(before, after)
        return np.divide(weight, weight + self._after.count, out=np.ones_like(weight), where=self._after.count > 1)

    def _cast(self, part: slice, begin: int, plan: tuple[np.ndarray, np.ndarray]) -> None:
        """Cast the planned rays of the groups in ``part``, and add up what they find."""
        rows = slice(self._groups.start[part.start], self._groups.start[part.stop])
        points, normals = self._points[rows], self._normals[rows]
        if begin == 0:
            self._exact[:, rows] = self._sharp.exact(points, normals).T
        spots = Spots.of(points, normals, self._groups.group[rows] - part.start)
        if self._lamps.rays_per_round:
            generator = self._generator(begin, rows.start, 0)
            self._lamps.cast(points, normals, plan[0][rows], generator, self._by_lamps.part(rows), rows.start)
        if self._surroundings.rays_per_round:
            self._look_around(part, rows, spots, begin, plan[1][rows])

    def _look_around(self, part: slice, rows: slice, spots: Spots, begin: int, rounds: np.ndarray) -> None:
        guide = None if self._guide is None else self._guide.part(part)
        sums = self._before if guide is None else self._after
        seen = [] if begin < LEARN_LAST else None
        generator = self._generator(begin, rows.start, 1)
        self._surroundings.cast(spots, rounds, guide, generator, sums.part(rows), seen)
        if seen:
            light = self._relative_light(rows=rows)
            scale = np.divide(1.0, light, out=np.zeros_like(light), where=light > 0)
            self._seen.add(part, seen, scale)

    def _generator(self, *key: int) -> np.random.Generator:
        return np.random.default_rng(np.random.SeedSequence(self._seed, spawn_key=(2, *map(int, key))))


def _trust(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """What a round before learning is worth in later ones, by their variances (N,); 1 where that is not known."""
    ratio = np.divide(after, before, out=np.ones_like(before), where=before > 0)
    return np.clip(np.where(np.isnan(ratio), 1.0, ratio), LEAST_WEIGHT, 1.0)
