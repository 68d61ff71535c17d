"""Direct light by shadow rays: from each point to the lights, and where light surrounds it, to where it was found.

Rays come in rounds. After the first ones, groups of neighbouring points know from which directions light reaches them,
and aim there; and points among others whose light is sure already are given fewer rounds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..gatherers.ranges import blocks
from ..irradiance import Irradiance
from ..lights.light import Light
from ..parallel import ordered_map
from ..rays import RayCaster
from ..scene import Scene
from ..settings import BakeSettings
from .direction_guide import DirectionSums
from .lamp_light import LampLight
from .learnt_sums import LearntSums
from .looks import ReflectedLight
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

#: Rays by chance from each point in one round once they gather reflected light; a power of two.
GATHER_RAYS = 16

#: Share of what is usual over all points in what the records' halves are said to differ by at a group's; and the median
#: of squared normal deviations over their mean.
SHARED, MEDIAN_OF_SQUARES = 0.5, 0.455


class DirectLight:
    """Irradiance at ``points`` (N, 3) m, which lie clear of surfaces, with unit ``normals`` (N, 3), by rays from there.

    What one ray tells exactly is found once; the rest is the mean over rounds of rays, each of which is an independent
    estimate. Equal seeds give equal results on any number of threads. Surfaces farther than the settings' shadow
    distance do not shade a point from the world. From :meth:`gather` on, rays by chance also gather reflected light.

    ``lights`` are all that count: none where the direct light is not looked for, or by photons.

    Attributes ``done``: how many rounds there were, of all points on average; ``rays``: how many rays they cast.
    """

    def __init__(
        self,
        scene: Scene,
        caster: RayCaster,
        points: np.ndarray,
        normals: np.ndarray,
        settings: BakeSettings,
        lights: Sequence[Light],
    ):
        self._seed = settings.seed
        self._shadows = Shadows(scene, caster)
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
        self._by_lamps = RoundSums.of(len(points))
        self._around, self._reflected = LearntSums(self._groups), LearntSums(self._groups)
        # By how much the two halves of the records differ, RGB sum, and rounds of rays that tell.
        self._spread = np.zeros((2, len(points)))
        self._seen, self._guide = DirectionSums(len(self._groups.start) - 1), None
        self.done, self.rays = 0, 0

    def gather(self, reflected: ReflectedLight) -> None:
        """Let rays by chance look up what surfaces reflect, from the next round on."""
        self._surroundings.gather(reflected, GATHER_RAYS)

    @property
    def points(self) -> int:
        """How many there are."""
        return len(self._points)

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
        """Direct light as found so far."""
        light = self._relative_light()
        value, whole = self._direct(light), self._direct(light) + self._reflected.value(light)
        squared = np.zeros_like(value)
        if self._lamps.rays_per_round:
            squared += self._by_lamps.squared_error(whole, self._groups)
        if self._surroundings.lit:
            squared += self._around.squared_error(whole, light)
        return self._in_place(value, squared)

    @property
    def reflected(self) -> Irradiance:
        """Reflected light as gathered so far, with the error that more rays would mend."""
        light = self._relative_light()
        value = self._reflected.value(light)
        return self._in_place(value, self._reflected.squared_error(value + self._direct(light), light))

    def reflected_spread(self, common: float) -> Irradiance:
        """The same with the error that more photons, and more rays after them, would mend.

        The halves of the records differ at a point by chance: points of a group, and groups, tell by how much. It is no
        less than what all records have in ``common``, a relative standard error, of which two halves know little.
        """
        light = self._relative_light()
        value = self._reflected.value(light)
        whole = np.abs(value + self._direct(light)).sum(axis=0)
        mean = np.divide(self._spread[0], self._spread[1], out=np.zeros(len(whole)), where=self._spread[1] > 0)
        relative = np.minimum(np.divide(mean, whole, out=np.zeros(len(whole)), where=whole > 0) ** 2, 1.0)
        usual = self._groups.means(relative)
        usual += SHARED * (np.median(relative) / MEDIAN_OF_SQUARES - usual)
        reflected = np.abs(value).sum(axis=0)
        part = np.divide(reflected, whole, out=np.zeros(len(whole)), where=whole > 0)
        usual = np.maximum(usual, (common * part) ** 2)
        squared = usual * (np.abs(value) / np.maximum(reflected, 1e-300) * whole) ** 2
        return self._in_place(value, np.where(self._spread[1] > 0, squared, np.inf))

    def around_each(self, values: np.ndarray) -> np.ndarray:
        """Means (N,) of ``values`` (N,) over the group of each point."""
        return self._groups.means(values[self._groups.order])[self._place]

    def rounds(
        self, first: int, last: int, other: np.ndarray | None = None, where: np.ndarray | None = None
    ) -> Iterator[float]:
        """Cast the rays of the rounds from ``first`` to before ``last``, yielding the share of them done (0..1).

        Points with ``other`` (N, 3) W/m^2 light, which is found in another way, need less of these rays. Only points
        of ``where`` (N,) cast any, whole groups; None for all.
        """
        groups = list(blocks(np.diff(self._groups.start), POINTS_PER_CHUNK))
        other = None if other is None else other[self._groups.order]
        where = None if where is None else where[self._groups.order]
        begin = first
        while begin < last:
            # Steps end where the rounds have doubled, whoever asks for how many of them.
            end = min(last, max(LEARN_AFTER, 1 << begin.bit_length()))
            plan = self._plan(begin, end, other)
            if where is not None:
                plan = tuple(np.where(where, rounds, 0) for rounds in plan)
            cast = ordered_map(lambda part, begin=begin, plan=plan: self._cast(part, begin, plan), groups)
            for part, _ in zip(groups, cast, strict=True):
                share = self._groups.start[part.stop] / len(self._points)
                yield min((begin - first + share * (end - begin)) / (last - first), 1.0)
            if LEARN_AFTER <= end <= LEARN_LAST and end & (end - 1) == 0 and self._surroundings.rays_per_round:
                self._guide = self._seen.guide()
            costs = self._lamps.rays_per_round, self._surroundings.rays_per_round
            self.rays += sum(cost * int(rounds.sum()) for cost, rounds in zip(costs, plan, strict=True))
            begin = self.done = end

    def _direct(self, light: np.ndarray) -> np.ndarray:
        return self._exact + self._by_lamps.mean + self._around.value(light)

    def _in_place(self, value: np.ndarray, squared: np.ndarray) -> Irradiance:
        """The Irradiance of the points in their own order, of ``value`` and ``squared`` error (3, N) in the groups'."""
        return Irradiance(
            *(np.ascontiguousarray(part.T).take(self._place, axis=0) for part in (value, np.sqrt(squared)))
        )

    def _plan(self, begin: int, end: int, other: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Rounds (N,) that each point shall have next, of lamps and of surroundings."""
        light = self._relative_light(other)
        lamps = self._groups.of_others(self._by_lamps.relative_variance(light))
        around, reflected = self._around.variance(light), self._reflected.variance(light)
        had = self._around.had(light)
        if self._surroundings.gathers:
            had = self._reflected.had(light)
            around = np.where(np.isnan(around), 0.0, around) + reflected
        return planned(
            end - begin,
            (self._by_lamps.count, had),
            (lamps, around),
            (self._lamps.rays_per_round, self._surroundings.rays_per_round),
        )

    def _relative_light(self, other: np.ndarray | None = None, rows: slice = slice(None)) -> np.ndarray:
        """All light (K,) at those ``rows``, RGB sum, by plain means, to which errors are relative."""
        value = self._exact[:, rows] + self._by_lamps.part(rows).mean
        value += self._around.plain(rows) + self._reflected.plain(rows)
        if other is not None:
            value += other[rows].T
        red, green, blue = np.abs(value, out=value)
        return red + green + blue

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
        way = "before" if guide is None else "after"
        direct, reflected = (getattr(sums, way).part(rows) for sums in (self._around, self._reflected))
        seen = [] if begin < LEARN_LAST else None
        generator = self._generator(begin, rows.start, 1)
        self._surroundings.cast(spots, rounds, guide, generator, direct, reflected, self._spread[:, rows], seen)
        if seen:
            light = self._relative_light(rows=rows)
            scale = np.divide(1.0, light, out=np.zeros_like(light), where=light > 0)
            self._seen.add(part, seen, scale)

    def _generator(self, *key: int) -> np.random.Generator:
        return np.random.default_rng(np.random.SeedSequence(self._seed, spawn_key=(2, *map(int, key))))
