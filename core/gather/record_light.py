"""Light at records: direct by shadow rays, the rest by DETP, each half of the records by its own half of photons."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..direct.direct_light import DirectLight
from ..discs import TangentDiscs
from ..estimator.visible_area import SPARSE, VisibleDiscs, visible_discs
from ..lights.light import Light
from ..photons.photon_light import PhotonSearch
from ..rays import RayCaster
from ..scene import Scene
from ..settings import BakeSettings
from .records import WIDTH, Records
from .reflected_light import ReflectedLight

if TYPE_CHECKING:
    from ..cluster.crew import Crew

#: Rounds of shadow rays from each record at first, and at most: their noise is averaged by the points that look there.
FIRST_ROUNDS, MOST_ROUNDS = 4, 256


class RecordLight:
    """What is known of the light at ``records``, for ``reflected`` to be looked up.

    ``lights`` are all of the scene's; shadow rays go there, unless the direct light comes ``by_photons``. The
    workers of a ``crew`` do the heavy work.

    Attributes: the ``searches`` for photons; ``common_error``, the relative standard error of all records' mean, as far
    as photons are to blame.
    """

    def __init__(
        self,
        scene: Scene,
        caster: RayCaster,
        records: Records,
        settings: BakeSettings,
        lights: Sequence[Light],
        by_photons: bool,
        crew: Crew | None = None,
    ):
        self._caster, self._records, self._settings, self._crew = caster, records, settings, crew
        self.reflected = ReflectedLight(scene, caster, lights, records.finder, settings.bounces)
        self.searches: list[PhotonSearch] = []
        self.common_error = 0.0
        self._rays = None
        if lights and len(records) and not by_photons:
            held = records.held
            self._rays = DirectLight(scene, caster, held.stands, held.normals, settings, lights, crew)
        if crew is not None:
            crew.know_records(records.finder)

    def __len__(self) -> int:
        return len(self._records)

    @property
    def radius(self) -> float:
        """Of the records' smallest discs, metres."""
        return WIDTH * self._records.finder.finest

    @property
    def looking(self) -> tuple[np.ndarray, np.ndarray]:
        """From where (2 C, 3) m the records look for light, and their unit normals (2 C, 3)."""
        return self._records.held.stands, self._records.held.normals

    def look_at_lights(self, times: float = 1.0) -> Iterator[None]:
        """Cast shadow rays from the records, step by step: the first rounds, then as many ``times`` those before."""
        if self._rays is None or (self._rays.done and self._rays.exact):
            return
        done = self._rays.done
        rounds = (
            min(int(np.ceil(times * done)), MOST_ROUNDS - done) if done else 1 if self._rays.exact else FIRST_ROUNDS
        )
        for _ in self._rays.rounds(done, done + rounds):
            yield

    @property
    def rays(self) -> int:
        """Shadow rays so far."""
        return 0 if self._rays is None else self._rays.rays

    def place(self, kinds: Sequence[str]) -> Iterator[None]:
        """Place the records' discs and make the searches for ``kinds`` of photons, step by step."""
        placed = yield from self._placed(self._records.discs, SPARSE)
        # Where a wall or an edge is in the way, its outline is looked at closely.
        rows = np.flatnonzero(placed.area.partial)
        if len(rows):
            placed = placed.with_rows(rows, (yield from self._placed(self._records.discs.taken(rows), 1)))
        cells = len(self._records)
        halves = [placed.taken(slice(0, cells)), placed.taken(slice(cells, 2 * cells))]
        most = self._settings.bounces - 1
        self.searches = [PhotonSearch(kind, half, number, most) for kind in kinds for number, half in enumerate(halves)]

    def _placed(self, discs: TangentDiscs, every: int) -> Generator[None, None, VisibleDiscs]:
        parts = []
        place = partial(visible_discs, self._caster) if self._crew is None else self._crew.visible_discs
        for part in place(discs, every=every):
            parts.append(part)
            yield
        return VisibleDiscs.joined(parts)

    def update(self) -> None:
        """Let what has been found be looked up."""
        dark = np.zeros((2 * len(self._records), 3))
        found = {"direct": dark if self._rays is None else self._rays.irradiance.value, "indirect": dark.copy()}
        cells = len(self._records)
        for search in self.searches:
            rows = slice(search.half * cells, (search.half + 1) * cells)
            found[search.kind][rows] = search.estimate.irradiance.value
        self.reflected.know(found["direct"], found["indirect"])
        if self._crew is not None:
            self._crew.know_light(found["direct"], found["indirect"])
        whole = max(float(np.sum(found["direct"]) + np.sum(found["indirect"])), 1e-300)
        errors = (s.estimate.common_error * float(np.sum(s.estimate.irradiance.value)) / whole for s in self.searches)
        self.common_error = float(np.sqrt(sum(error**2 for error in errors)))
