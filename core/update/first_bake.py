"""What is kept of a bake for updates: arrays, from which all else that these need is made again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..bake import Baking
from ..cluster.packing import KINDS as TRAVELLING
from ..direct.emitters import Emitters
from ..direct.lamp_light import LampLight
from ..direct.learnt_choice import LearntChoice
from ..direct.lit_scene import LitScene
from ..direct.nearby_lamps import NearbyLamps
from ..estimator.estimate import IrradianceEstimate
from ..estimator.standpoints import Standpoints
from ..estimator.visible_area import VisibleArea, VisibleDiscs
from ..fit.settled import Settled
from ..gather.records import Landings, RecordFinder
from ..gather.reflected_light import ReflectedLight
from ..gatherers.disc_index import DiscIndex
from ..irradiance import Irradiance
from ..lights.light import Light
from ..photons.photon_journal import PhotonPaths
from ..photons.photon_light import PhotonSearch
from ..points import Points
from ..rays import RayCaster
from ..result import BakeResult
from ..scene import Scene
from ..segments import Segments
from ..settings import BakeSettings
from .light_differences import Views, WantedPlaces

#: No difference need be known better than this share of the light.
LEAST_NOISE = 1e-3


@dataclass(frozen=True)
class LearntLamps:
    """Lamps of a bake, as G groups of points have learnt to choose among them.

    kinds    of each kind of lamps: which (L,) of the lights they are; the ranges of them between which groups choose,
             ``begin`` and ``end`` (G, K); and what these have learnt (G, K), None before they have
    centres  (G, 3) metres, the middles of the groups
    brought  (G, kinds) what light, RGB sum, groups found of each kind, in any unit
    group    (N,) of each of the points
    """

    kinds: tuple[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None], ...]
    centres: np.ndarray
    brought: np.ndarray
    group: np.ndarray

    @classmethod
    def of(cls, nearby: NearbyLamps, group: np.ndarray, lights: Sequence[Light]) -> LearntLamps:
        """Of those ``nearby``, which are among the ``lights``."""
        number, kinds = {id(light): row for row, light in enumerate(lights)}, []
        for kind in nearby.kinds:
            which = np.array([number[id(lamp)] for lamp in kind.lamps])
            kinds.append((which, *kind.learnt.fixed(slice(None))))
        return cls(tuple(kinds), nearby.centres, nearby.brought, group)

    def among(self, lights: Sequence[Light]) -> NearbyLamps:
        """The same of the ``lights`` of the bake."""
        lamps = []
        for which, *learnt in self.kinds:
            some = [lights[row] for row in which]
            lamps.append(LampLight(some, None, 0, LearntChoice.known(Emitters.of_lamps(some), *learnt), None))
        return NearbyLamps(lamps, self.centres, self.brought)


@dataclass(frozen=True)
class FirstRecords:
    """The C cells of a bake, and the light at their 2 C records.

    held, lookouts, sides, radii, finder   as in :class:`.Records`
    searches          of each kind of photons and half of the records
    direct, indirect  (2 C, 6) W/m^2, as :attr:`.RecordLight.found`
    common_error      as in :class:`.RecordLight`
    lamps             as groups of lookouts know them; None where there are no lights at all
    """

    held: Landings
    lookouts: Landings
    sides: np.ndarray
    radii: np.ndarray
    finder: RecordFinder
    searches: tuple[PhotonSearch, ...]
    direct: np.ndarray
    indirect: np.ndarray
    common_error: float
    lamps: LearntLamps | None


@dataclass(frozen=True)
class FirstBake:
    """A bake of ``points`` in ``scene`` with ``settings``, as far as updates need it.

    places         from where the points look
    lamps          as groups of points know them
    tracing        what the tracer of photons was made of beside the scene
    paths          of all photons
    by_rays        all light, with the errors by rays alone
    common_rounds  of rays, which all points cast, and ``most_rounds``, which those that are hardest to light did
    ray_count      how many rays each point casts in a round, and how many all points cast in all rounds
    """

    scene: Scene
    points: Points
    settings: BakeSettings
    places: Standpoints
    lamps: LearntLamps
    records: FirstRecords
    tracing: tuple
    paths: PhotonPaths
    by_rays: Irradiance
    common_rounds: int
    most_rounds: int
    ray_count: tuple[float, int]
    result: BakeResult

    @classmethod
    def of(
        cls, scene: Scene, points: Points, settings: BakeSettings, work: Baking, paths: PhotonPaths, result: BakeResult
    ) -> FirstBake:
        """Of a bake whose ``work`` is done; what that has made is not made again."""
        rays, light, records = work.rays, work.records, work.records.records
        seen = light.shadow_rays
        lamps = None if seen is None else LearntLamps.of(seen.nearby_lamps, seen.group, work.lit.lights)
        kept = FirstRecords(
            records.held, records.lookouts, records.sides, records.radii, records.finder, tuple(light.searches),
            *light.found.values(), light.common_error, lamps,
        )  # fmt: skip
        found = cls(
            scene, points, settings, work.places, LearntLamps.of(rays.nearby_lamps, rays.group, work.lit.lights), kept,
            work.tracing, paths, rays.irradiance + rays.reflected,
            work.common_rounds, rays.done, (rays.rays_per_round / len(points), rays.rays), result,
        )  # fmt: skip
        vars(found).update(lit=work.lit, reflected=light.reflected)
        return found

    @cached_property
    def lit(self) -> LitScene:
        """The scene, as rays look at it."""
        return LitScene(self.scene, RayCaster(self.scene.corners, self.points.centres))

    @cached_property
    def searches(self) -> list[PhotonSearch]:
        """The records' searches for photons, with what they found."""
        for search in self.records.searches:
            if search.gatherer is None:
                search.gatherer = DiscIndex(search.placed.discs)
        return list(self.records.searches)

    @cached_property
    def reflected(self) -> ReflectedLight:
        """What surfaces send on."""
        found = ReflectedLight(self.lit, self.records.finder, self.settings.bounces)
        found.know(self.records.direct, self.records.indirect)
        return found

    @cached_property
    def wanted(self) -> WantedPlaces:
        """From where the points look."""
        return WantedPlaces(self.places.origins, self.points.normals, self.points.facing, self.lamps.group)

    @cached_property
    def noise(self) -> float:
        """The relative error of half of the points at most, which may all be known exactly."""
        return max(float(np.median(self.result.light.relative_errors)), LEAST_NOISE)

    def look(self) -> Iterator[object]:
        """Find out what the points see, step by step, unless that is known: the attribute ``views``."""
        if "views" not in vars(self):
            finding = Views.of(self.wanted, self.reflected, self.records.finder, self.settings.seed)
            vars(self)["views"] = yield from finding

    @cached_property
    def nearby_lamps(self) -> NearbyLamps:
        """The lamps, as groups of points know them."""
        return self.lamps.among(self.lit.lights)


#: classes of what is kept
KINDS = (
    *TRAVELLING, BakeResult, FirstBake, FirstRecords, Irradiance, IrradianceEstimate, Landings, LearntLamps,
    PhotonPaths, PhotonSearch, RecordFinder, Segments, Settled, VisibleArea, VisibleDiscs,
)  # fmt: skip
