"""Direct light by shadow rays: from each point to the lights, and where light surrounds it, to where it was found.

Rays come in rounds. After the first ones, groups of neighbouring points know from which directions light reaches them,
and aim there.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..irradiance import Irradiance
from ..parallel import ordered_map
from ..random_streams import random_stream
from ..ranges import blocks
from ..settings import BakeSettings
from .cast_piece import CastPiece
from .direction_guide import DirectionGuide, DirectionSums
from .learnt_sums import LearntSums
from .lit_scene import LitScene
from .nearby_lamps import NearbyLamps
from .point_groups import PointGroups
from .round_sums import RoundSums, in_whole_samples
from .scene_lights import SceneLights
from .spots import Spots
from .stands import Stands
from .surrounding_light import CONTRASTS, Look, Reflections

if TYPE_CHECKING:
    from ..cluster.crew import Crew

#: Rays from each point in one round to the lamps, to each of the surroundings, and by chance; a power of two.
RAYS_PER_ROUND = 4

#: Points whose rays are cast at a time, in a step of so many rounds; in one of more rounds fewer, down to the least, so
#: that whoever runs a bake soon gets a word in, and small scenes have work for all processors.
POINTS_PER_CHUNK, ROUNDS_PER_CHUNK, LEAST_PER_CHUNK = 1 << 11, 4, 1 << 8

#: Rays by chance from each point in one round once they gather reflected light; a power of two.
GATHER_RAYS = 16

#: Share of what is usual over all points in what contrasts of photons are said to be at a group's; and the median over
#: the mean of squares of a normal deviation, and of means of as many of them as there are contrasts.
SHARED, MEDIAN_OF_ONE, MEDIAN_OF_ALL = 0.5, 0.455, 0.907

#: Of squared contrasts no more is taken out than leaves this share: few rounds tell variances badly.
LEFT = 0.25

#: After so many rounds it is learnt where light comes from, then whenever they have doubled, and last after so many.
LEARN_AFTER, LEARN_LAST = 4, 64


class DirectLight:
    """Irradiance at N points with unit ``normals`` (N, 3), by rays from their ``stands``, or places (N, 3) m clear of
    surfaces that are points and stands at once.

    What one ray tells exactly is found once; the rest is the mean over rounds of rays, each of which is an independent
    estimate. Equal seeds give equal results on any number of threads. Surfaces farther than the settings' shadow
    distance do not shade a point from the world. From :meth:`gather` on, rays by chance also gather reflected light.

    The lights of ``lit`` count if it ``shines``: not where direct light is not looked for, or by photons. The workers
    of a ``crew`` cast the rays. ``groups``, when given, are those of points that are in their order.

    Attributes ``done``: how many rounds there were; ``rays``: how many rays they cast.
    """

    def __init__(
        self,
        lit: LitScene,
        stands: Stands | np.ndarray,
        normals: np.ndarray,
        settings: BakeSettings,
        shines: bool = True,
        crew: Crew | None = None,
        groups: PointGroups | None = None,
    ):
        self._seed, self._crew = settings.seed, crew
        stands = stands if isinstance(stands, Stands) else Stands(stands, stands)
        points = stands.origins
        self._groups = groups or PointGroups.of(points, normals)
        self._stands, self._normals = stands.taken(self._groups.order), normals[self._groups.order]
        self._points = self._stands.origins
        self._lit, self._reach = lit, settings.shadow_distance or np.inf
        self._lights = self._scene_lights(shines)
        self._place = np.empty_like(self._groups.order)
        self._place[self._groups.order] = np.arange(len(points))
        self._exact = np.zeros((3, len(points)))
        self._by_lamps, self._by_surroundings, self._reflected = (LearntSums.of(self._groups) for _ in range(3))
        # By how much what was reflected is off with each contrast of its photons, RGB sum.
        self._spread = RoundSums.of(len(points), CONTRASTS)
        self._followed: SceneLights | None = None
        self._learnt = False
        self._seen, self._guide = DirectionSums(len(self._groups.start) - 1), None
        self.done, self.rays = 0, 0
        self._first = 0  # of the points, among all of a bake

    def _scene_lights(self, shines: bool) -> SceneLights:
        near = self._groups, self._stands, self._normals
        return SceneLights(self._lit, shines, self._reach, RAYS_PER_ROUND, *near)

    def gather(self, reflected: Reflections) -> None:
        """Let rays by chance look up what surfaces reflect, from the next round on.

        Where they are followed on, all lights of the scene count.
        """
        self._lights.surroundings.gather(reflected, GATHER_RAYS)
        # Without lights of their own the points have learnt nothing of them.
        self._followed = self._lights if self._lights.any else self._scene_lights(True)
        # What was learnt of direct light alone would lead rays away from what surfaces reflect.
        self._seen, self._guide = DirectionSums(len(self._groups.start) - 1), None

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
        return len(self._points) * self._lights.rays_per_round

    @property
    def irradiance(self) -> Irradiance:
        """Direct light as found so far."""
        light = self._relative_light()
        value, squared = self._direct(light), np.zeros_like(self._exact)
        whole = value + self._reflected.mean(light)
        for sums, there in (
            (self._by_lamps, self._lights.soft),
            (self._by_surroundings, self._lights.surroundings.lit),
        ):
            if there:
                squared += sums.squared_error(whole, light)
        return self._in_place(value, squared)

    @property
    def reflected(self) -> Irradiance:
        """Reflected light as gathered so far, with the error that more rays would mend."""
        light = self._relative_light()
        value = self._reflected.mean(light)
        return self._in_place(value, self._reflected.squared_error(value + self._direct(light), light))

    def reflected_spread(self, common: float) -> Irradiance:
        """The same with the error that more photons, and more rays after them, would mend.

        Halves of the photons differ at a point by chance: points of a group, and groups, tell by how much. What they
        differ by since few rays look into few cells is taken out, as more rays mend that. It is no less than what all
        records have in ``common``, a relative standard error, of which a few halves know little.
        """
        light = self._relative_light()
        value = self._reflected.mean(light)
        whole, known = np.abs(value + self._direct(light)).sum(axis=0), self._spread.count > 0
        over = np.divide(1.0, whole, out=np.zeros(len(whole)), where=whole > 0)
        by_rays = self._spread.variance / np.maximum(self._spread.count, 1.0)
        squared, by_rays = (np.minimum(part * over**2, 1.0) for part in (self._spread.mean**2, by_rays))
        # The first contrast has the records' places in it too. As far as the others are as large, all count alike.
        first, *others = (_without(some.mean(), each.mean()) for some, each in zip(by_rays, squared, strict=True))
        alike = min(sum(others) / len(others) / first, 1.0) if first > 0 else 1.0
        parts = np.full(CONTRASTS, 1.0 / CONTRASTS)
        parts[0] += (1.0 - alike) * (1.0 - parts[0])
        squared, by_rays = (np.einsum("i,ij->j", parts, each) for each in (squared, by_rays))
        usual = _without(self._groups.means(by_rays), self._groups.means(squared))
        median = MEDIAN_OF_ONE + alike * (MEDIAN_OF_ALL - MEDIAN_OF_ONE)
        usual += SHARED * (_without(np.median(by_rays), np.median(squared) / median) - usual)
        reflected = np.abs(value).sum(axis=0)
        part = np.divide(reflected, whole, out=np.zeros(len(whole)), where=whole > 0)
        usual = np.maximum(usual, (common * part) ** 2)
        squared = usual * (np.abs(value) / np.maximum(reflected, 1e-300) * whole) ** 2
        return self._in_place(value, np.where(known, squared, np.inf))

    def around_each(self, values: np.ndarray) -> np.ndarray:
        """Means (N,) of ``values`` (N,) over the group of each point."""
        return self._groups.means(values[self._groups.order])[self._place]

    @property
    def group(self) -> np.ndarray:
        """Of :attr:`nearby_lamps` the group (N,) that each point belongs to."""
        return self._groups.group.take(self._place)

    def _direct(self, light: np.ndarray) -> np.ndarray:
        return self._exact + self._by_lamps.mean(light) + self._by_surroundings.mean(light)

    def _in_place(self, value: np.ndarray, squared: np.ndarray) -> Irradiance:
        """The Irradiance of the points in their own order, of ``value`` and ``squared`` error (3, N) in the groups'."""
        given = (np.ascontiguousarray(part.T).take(self._place, axis=0) for part in (value, np.sqrt(squared)))
        return Irradiance(*given)

    def rounds(self, first: int, last: int, where: np.ndarray | None = None) -> Iterator[float]:
        """Cast the rays of the rounds from ``first`` to before ``last``, yielding the share of them done (0..1).

        Only points of ``where`` (N,) cast any, whole groups; None for all.
        """
        where = None if where is None else where[self._groups.order]
        begin = first
        while begin < last:
            # Steps end where the rounds have doubled, whoever asks for how many of them.
            end = min(last, max(LEARN_AFTER, 1 << begin.bit_length()))
            points = max(POINTS_PER_CHUNK * ROUNDS_PER_CHUNK // (end - begin), LEAST_PER_CHUNK)
            groups = list(blocks(np.diff(self._groups.start), points))
            rounds = in_whole_samples(end - begin, len(self._points))
            if where is not None:
                rounds = np.where(where, rounds, 0)
                groups = [part for part in groups if rounds[self._rows(part)].any()]
            for part, _ in zip(groups, self._casts(groups, begin, rounds), strict=True):
                share = self._groups.start[part.stop] / len(self._points)
                yield min((begin - first + share * (end - begin)) / (last - first), 1.0)
            if LEARN_AFTER <= end <= LEARN_LAST and end & (end - 1) == 0:
                self._learn()
            self.rays += self._lights.rays_per_round * int(rounds.sum())
            begin = self.done = end

    def _casts(self, groups: list[slice], begin: int, rounds: np.ndarray) -> Iterator[None]:
        """Cast so many ``rounds`` (N,) of rays from the points of these ``groups``, side by side."""
        if self._crew is not None:
            return self._crew.cast(self, groups, begin, rounds)
        nearby = None if self._followed is None else self.nearby_lamps
        return ordered_map(lambda part: self._cast(part, begin, rounds, nearby), groups)

    def piece(self, part: slice, begin: int, rounds: np.ndarray) -> CastPiece:
        """All that it takes to cast ``rounds`` (N,) of rays from the groups in ``part`` elsewhere."""
        rows, start = self._rows(part), self._groups.start[part.start : part.stop + 1]
        group = PointGroups(np.arange(rows.stop - rows.start), self._groups.group[rows] - part.start, start - start[0])
        gathers, shines = self._followed is not None, self._lights.any
        place = self._stands.taken(rows), self._normals[rows], group
        return CastPiece(*place, self._first + rows.start, begin, rounds[rows], gathers, shines, *self._state(part))

    @classmethod
    def cast_piece(
        cls,
        piece: CastPiece,
        lit: LitScene,
        settings: BakeSettings,
        reflected: Reflections | None,
    ) -> tuple:
        """Cast the rays of a ``piece`` of the points. Returns what they brought, for :meth:`take`."""
        light = cls(lit, piece.stands, piece.normals, settings, piece.shines, groups=piece.groups)
        if piece.gathers:
            light.gather(reflected)
        every = slice(0, len(piece.groups.start) - 1)
        light._first = piece.first
        light._load(piece)
        light._cast(every, piece.begin, piece.rounds, light.nearby_lamps if piece.gathers else None)
        return light._state(every)[0]

    def take(self, part: slice, brought: tuple) -> None:
        """Let what the groups in ``part`` know be what their rays ``brought`` elsewhere."""
        for mine, theirs in zip(self._state(part)[0], brought, strict=True):
            if mine is not None:
                mine[...] = theirs

    def _state(self, part: slice) -> tuple[tuple, tuple]:
        """Of the groups in ``part``, views of what casting changes, and of what it only looks at."""
        rows = self._rows(part)
        phases = [(sums.after, sums.before) if self._learnt else (sums.before, sums.after) for sums in self._sums]
        changed = [self._exact[:, rows], *(sums[:, part] for sums in self._seen.sums)]
        for now in (self._spread, *(now for now, _ in phases)):
            each = now.part(rows)
            changed += [each.count, each.weights, each.total, each.crossed, each.squares]
        fixed = [None if self._guide is None else self._guide.density[part], self._learnt]
        for _, other in phases:
            fixed += [other.count[rows], other.total[:, rows]]
        for learnt in self._lights.learnt:
            changed += learnt.changed(part, rows)
            fixed.append(learnt.fixed(part))
        return tuple(changed), tuple(fixed)

    def _load(self, piece: CastPiece) -> None:
        """Know what is known elsewhere of the points of ``piece``."""
        density, self._learnt, *fixed = piece.fixed
        self._guide = None if density is None else DirectionGuide(density)
        for sums in self._sums:
            other = sums.before if self._learnt else sums.after
            other.count[:], other.total[:] = fixed.pop(0), fixed.pop(0)
        own = piece.changed[len(piece.changed) - 4 * len(self._lights.learnt) :][3::4]
        for learnt, sums in zip(self._lights.learnt, own, strict=True):
            learnt.load(fixed.pop(0), sums is not None)
        self.take(slice(0, len(self._groups.start) - 1), piece.changed)

    def _rows(self, part: slice) -> slice:
        """The points of the groups in ``part``."""
        return slice(int(self._groups.start[part.start]), int(self._groups.start[part.stop]))

    def _learn(self) -> None:
        """Aim from now on at where light was found."""
        self._learnt, light = True, self._relative_light()
        for sums in self._sums:
            sums.learnt(light)
        self._lights.learn()
        if self._lights.surroundings.rays_per_round:
            self._guide = self._seen.guide()

    @property
    def _sums(self) -> tuple[LearntSums, LearntSums, LearntSums]:
        return self._by_lamps, self._by_surroundings, self._reflected

    @property
    def nearby_lamps(self) -> NearbyLamps:
        """The lamps from places near the points, by what their :class:`.PointGroups` have learnt so far."""
        return (self._followed or self._lights).nearby_lamps(self._exact, self._by_lamps.plain_mean())

    def _relative_light(self, rows: slice = slice(None)) -> np.ndarray:
        """All light (K,) at those ``rows``, RGB sum, by plain means, to which errors are relative."""
        value = self._exact[:, rows] + sum(sums.plain_mean(rows) for sums in self._sums)
        red, green, blue = np.abs(value, out=value)
        return red + green + blue

    def _cast(self, part: slice, begin: int, rounds: np.ndarray, nearby: NearbyLamps | None) -> None:
        """Cast so many ``rounds`` (N,) of rays from the groups in ``part``, and add up what they find."""
        rows = self._rows(part)
        points, normals, group = self._points[rows], self._normals[rows], self._groups.group[rows] - part.start
        if begin == 0 and self._lights.sharp is not None:
            self._exact[:, rows] = self._lights.sharp.exact(part, rows, points, normals, group).T
        if self._lights.soft is not None:
            generator = self._generator(begin, self._first + rows.start, 0)
            sums = self._phase(self._by_lamps).part(rows)
            lit = self._relative_light(rows)
            self._lights.soft.cast(part, rows, points, normals, group, rounds[rows], generator, sums, lit)
        if self._lights.surroundings.rays_per_round:
            spots = Spots.of(points, normals, group, self._stands.taken(rows).facing)
            self._look_around(part, rows, spots, begin, rounds[rows], nearby)

    def _look_around(self, part: slice, rows: slice, spots: Spots, begin: int, rounds: np.ndarray, nearby) -> None:
        guide = None if self._guide is None else self._guide.part(part)
        seen = [] if begin < LEARN_LAST else None
        generator = self._generator(begin, self._first + rows.start, 1)
        direct, reflected = (self._phase(sums).part(rows) for sums in self._sums[1:])
        spread = self._spread.part(rows)
        aims = self._lights.aims(part, rows, spots, self._relative_light(rows))
        look = Look(spots, guide, generator, seen, aims, nearby, part.start)
        self._lights.surroundings.cast(look, rounds, direct, reflected, spread)
        if seen:
            lit = self._relative_light(rows)
            self._seen.add(part, seen, np.divide(1.0, lit, out=np.zeros_like(lit), where=lit > 0))

    def _phase(self, sums: LearntSums) -> RoundSums:
        return sums.after if self._learnt else sums.before

    def _generator(self, *key: int) -> np.random.Generator:
        return random_stream(self._seed, "rays", *key)


def _without(some: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """A ``whole`` variance without ``some`` that is in it, as far as that is sure."""
    return np.maximum(whole - some, LEFT * whole)
