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
from .learnt_sums import LearntSums
from .nearby_light import NearbyLight
from .point_groups import PointGroups
from .round_plan import planned
from .round_sums import RoundSums
from .scene_lights import SceneLights
from .shadows import Shadows
from .spots import Spots

#: Rays from each point in one round to the lamps, to each of the surroundings, and by chance; a power of two.
RAYS_PER_ROUND = 4

#: Points whose rays are cast at a time.
POINTS_PER_CHUNK = 1 << 12

#: After so many rounds it is learnt where light comes from, then whenever they have doubled, and last after so many.
LEARN_AFTER, LEARN_LAST = 4, 64


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
        self._groups = PointGroups.of(points, normals)
        self._points, self._normals = points[self._groups.order], normals[self._groups.order]
        shadows, reach = Shadows(scene, caster), settings.shadow_distance or np.inf
        near = self._groups, self._points, self._normals
        self._lights = SceneLights(lights_of(scene), shadows, reach, RAYS_PER_ROUND, *near)
        self._place = np.empty_like(self._groups.order)
        self._place[self._groups.order] = np.arange(len(points))
        self._exact = np.zeros((3, len(points)))
        self._by_lamps, self._by_surroundings = (LearntSums.of(self._groups) for _ in range(2))
        self._learnt = False
        self._seen, self._guide = DirectionSums(len(self._groups.start) - 1), None
        self.done, self.rays = 0, 0

    @property
    def exact(self) -> bool:
        """Whether no further round would change anything after the first."""
        return self.rays_per_round == 0

    @property
    def rays_per_round(self) -> int:
        """Rays that one round casts, of all points."""
        return len(self._points) * sum(self._lights.costs)

    @property
    def irradiance(self) -> Irradiance:
        """What has been found so far."""
        light = self._relative_light()
        value, squared = self._exact.copy(), np.zeros_like(self._exact)
        kinds = [sums for sums, cost in zip(self._sums, self._lights.costs, strict=True) if cost]
        for sums in kinds:
            value += sums.mean(light)
        for sums in kinds:
            squared += sums.squared_error(value, light)
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
            if LEARN_AFTER <= end <= LEARN_LAST and end & (end - 1) == 0:
                self._learn()
            self.rays += sum(cost * int(rounds.sum()) for cost, rounds in zip(self._lights.costs, plan, strict=True))
            begin = self.done = end

    def _learn(self) -> None:
        """Aim from now on at where light was found."""
        self._learnt, light = True, self._relative_light()
        for sums in self._sums:
            sums.learnt(light)
        self._lights.learn()
        if self._lights.surroundings.rays_per_round:
            self._guide = self._seen.guide()

    @property
    def _sums(self) -> tuple[LearntSums, LearntSums]:
        return self._by_lamps, self._by_surroundings

    @property
    def nearby(self) -> NearbyLight:
        """Light at places near the points, by what their :class:`.PointGroups` have learnt so far."""
        return self._lights.nearby(self._exact, *(sums.plain_mean() for sums in self._sums))

    def _plan(self, begin: int, end: int, other: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Rounds (N,) that each point shall have next, of lamps and of surroundings."""
        light = self._relative_light(other)
        had, variance = zip(*(sums.planning(light) for sums in self._sums), strict=True)
        return planned(end - begin, had, variance, self._lights.costs)

    def _relative_light(self, other: np.ndarray | None = None, rows: slice = slice(None)) -> np.ndarray:
        """All light (K,) at those ``rows``, RGB sum, by plain means, to which errors are relative."""
        value = self._exact[:, rows] + self._by_lamps.plain_mean(rows) + self._by_surroundings.plain_mean(rows)
        if other is not None:
            value += other[rows].T
        red, green, blue = np.abs(value, out=value)
        return red + green + blue

    def _cast(self, part: slice, begin: int, plan: tuple[np.ndarray, np.ndarray]) -> None:
        """Cast the planned rays of the groups in ``part``, and add up what they find."""
        rows = slice(self._groups.start[part.start], self._groups.start[part.stop])
        points, normals, group = self._points[rows], self._normals[rows], self._groups.group[rows] - part.start
        if begin == 0 and self._lights.sharp is not None:
            self._exact[:, rows] = self._lights.sharp.exact(part, rows, points, normals, group).T
        if self._lights.soft is not None:
            generator, sums = self._generator(begin, rows.start, 0), self._phase(self._by_lamps).part(rows)
            lit = self._relative_light(rows=rows)
            self._lights.soft.cast(part, rows, points, normals, group, plan[0][rows], generator, sums, lit)
        if self._lights.surroundings.rays_per_round:
            self._look_around(part, rows, Spots.of(points, normals, group), begin, plan[1][rows])

    def _look_around(self, part: slice, rows: slice, spots: Spots, begin: int, rounds: np.ndarray) -> None:
        guide = None if self._guide is None else self._guide.part(part)
        seen = [] if begin < LEARN_LAST else None
        generator, sums = self._generator(begin, rows.start, 1), self._phase(self._by_surroundings).part(rows)
        aims = self._lights.aims(part, rows, spots, self._relative_light(rows=rows))
        self._lights.surroundings.cast(spots, rounds, guide, generator, sums, seen, aims)
        if seen:
            lit = self._relative_light(rows=rows)
            self._seen.add(part, seen, np.divide(1.0, lit, out=np.zeros_like(lit), where=lit > 0))

    def _phase(self, sums: LearntSums) -> RoundSums:
        return sums.after if self._learnt else sums.before

    def _generator(self, *key: int) -> np.random.Generator:
        return np.random.default_rng(np.random.SeedSequence(self._seed, spawn_key=(2, *map(int, key))))
