"""The lights of a scene by the way in which points look for their light, with what the points learn of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights.emissive import EmissiveTriangles
from ..lights.light import Light, is_lamp
from .lamp_light import LampLight
from .learnt_choice import LearntChoice
from .lit_scene import LitScene
from .nearby_lamps import NearbyLamps
from .point_groups import PointGroups
from .spots import Spots
from .stands import Stands
from .surrounding_light import SurroundingLight
from .triangle_choice import TriangleChoice

#: Up to so many lamps without extent are all asked, exactly; of more, as of lamps with extent, some are chosen.
MOST_SHARP_LAMPS = 32


class SceneLights:
    """The lights of ``lit``, if it ``shines``, for points with ``normals`` (N, 3), whose rays start at ``stands``, in
    the order of their ``groups``.

    A round has ``rays`` to lamps, to each of the surroundings, and by chance. Surfaces farther than ``reach`` metres do
    not shade a point from the world.

    Attributes ``sharp`` and ``soft``: the lamps that are asked exactly and by choice, None without any;
    ``surroundings``: all other lights.
    """

    def __init__(
        self,
        lit: LitScene,
        shines: bool,
        reach: float,
        rays: int,
        groups: PointGroups,
        stands: Stands,
        normals: np.ndarray,
    ):
        points = stands.origins
        self._groups = groups
        self._centres = np.ascontiguousarray(groups.means(points.T).T[groups.start[:-1]])
        shadows, lights = lit.shadows, lit.lights if shines else []
        self._around = lit.surroundings if shines else []
        lamps = [light for light in lights if is_lamp(light)]
        sharp = [lamp for lamp in lamps if lamp.sharp]
        sharp = sharp if len(sharp) <= MOST_SHARP_LAMPS else []
        soft = [lamp for lamp in lamps if lamp not in sharp]

        def choice(among: Sequence[Light], each: bool = True) -> LearntChoice:
            return LearntChoice(lit.emitters(among), groups, points, normals, each)

        self.sharp = LampLight(sharp, shadows, 0, choice(sharp, False), stands) if sharp else None
        self.soft = LampLight(soft, shadows, rays, choice(soft), stands) if soft else None
        self.surroundings = SurroundingLight(self._around, shadows, reach, rays)
        shining = [light for light in self._around if isinstance(light, EmissiveTriangles)]
        self._shining = [(light, choice([light])) for light in shining]

    @property
    def any(self) -> bool:
        """Whether there are lights at all."""
        return bool(self._around) or self.sharp is not None or self.soft is not None

    @property
    def rays_per_round(self) -> int:
        """Rays from each point in a round."""
        return self.surroundings.rays_per_round + (0 if self.soft is None else self.soft.rays_per_round)

    def aims(self, part: slice, rows: slice, spots: Spots, lit: np.ndarray) -> dict[int, TriangleChoice]:
        """How the ``spots``, which are the ``rows`` of all points and the groups in ``part``, aim at shining triangles,
        by these lights' identities. ``lit`` (K,) is what light, RGB sum, has been found at each."""
        found = {}
        for light, learnt in self._shining:
            choice = learnt.choice(part, rows, spots.points, spots.normals, spots.group)
            found[id(light)] = TriangleChoice(light, choice, learnt, part, rows, choice.scale(lit))
        return found

    @property
    def learnt(self) -> list[LearntChoice]:
        """What the points have learnt of lamps and of shining triangles."""
        lamps = [lamps.learnt for lamps in (self.sharp, self.soft) if lamps is not None]
        return [*lamps, *(learnt for _, learnt in self._shining)]

    def learn(self) -> None:
        """Choose by what has been found so far from now on."""
        for learnt in self.learnt:
            learnt.learn()

    def nearby_lamps(self, exact: np.ndarray, by_lamps: np.ndarray) -> NearbyLamps:
        """The lamps from places near the points, by what their groups have learnt, and by the light (3, N) that was
        found of sharp lamps and of soft ones."""
        kinds = [(self.soft, by_lamps), (self.sharp, exact)]
        kinds = [(lamps, found) for lamps, found in kinds if lamps is not None]
        brought = np.zeros((len(self._groups.start) - 1, len(kinds)))
        for column, (_, light) in enumerate(kinds):
            brought[:, column] = np.add.reduceat(np.abs(light).sum(axis=0), self._groups.start[:-1])
        return NearbyLamps([lamps for lamps, _ in kinds], self._centres, brought)
