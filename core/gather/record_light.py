"""Light at records: direct by shadow rays, the rest by DETP, each half of the records by its own half of photons."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..direct.direct_light import DirectLight
from ..direct.lit_scene import LitScene
from ..discs import TangentDiscs
from ..estimator.visible_area import SPARSE, VisibleDiscs, placing
from ..photons.photon_light import PhotonSearch
from ..settings import BakeSettings
from ..stages import collected
from .records import LOOKOUTS, WIDTH, Records
from .reflected_light import ReflectedLight

if TYPE_CHECKING:
    from ..cluster.crew import Crew

#: Rounds of shadow rays from each lookout at first, and at most: their noise is averaged by the points that look there.
LOOKOUT_ROUNDS, MOST_LOOKOUT_ROUNDS = 1, 16


class RecordLight:
    """What is known of the light at ``records``, for ``reflected`` to be looked up.

    Shadow rays go to all lights of ``lit``, unless the direct light comes ``by_photons``. The workers of a ``crew`` do
    the heavy work.

    Attributes: the ``searches`` for photons; ``common_error``, the relative standard error of all records' mean, as far
    as photons are to blame.
    """

    def __init__(
        self,
        lit: LitScene,
        records: Records,
        settings: BakeSettings,
        by_photons: bool,
        crew: Crew | None = None,
    ):
        self._caster, self.records, self._settings, self._crew = lit.caster, records, settings, crew
        self.reflected = ReflectedLight(lit, records.finder, settings.bounces)
        self.searches: list[PhotonSearch] = []
        self.common_error = 0.0
        self.shadow_rays = None
        if lit.lights and len(records) and not by_photons:
            lookouts = records.lookouts
            self.shadow_rays = DirectLight(lit, lookouts.stands, lookouts.normals, settings, crew=crew)
        if crew is not None:
            crew.know_records(records.finder)

    def __len__(self) -> int:
        return len(self.records)

    @property
    def radius(self) -> float:
        """Of the records' smallest discs, metres."""
        return WIDTH * self.records.finder.finest

    @property
    def looking(self) -> tuple[np.ndarray, np.ndarray]:
        """From where (2 C, 3) m the records look for light, and their unit normals (2 C, 3)."""
        return self.records.held.stands, self.records.held.normals

    def look_at_lights(self, times: float = 1.0) -> Iterator[None]:
        """Cast shadow rays from the lookouts, step by step: the first rounds, then as many ``times`` those before."""
        if self.shadow_rays is None or (self.shadow_rays.done and self.shadow_rays.exact):
            return
        done = self.shadow_rays.done
        rounds = min(int(np.ceil(times * done)), MOST_LOOKOUT_ROUNDS - done) if done else LOOKOUT_ROUNDS
        for _ in self.shadow_rays.rounds(done, done + rounds):
            yield

    @property
    def rays(self) -> int:
        """Shadow rays so far."""
        return 0 if self.shadow_rays is None else self.shadow_rays.rays

    def place(self, kinds: Sequence[str]) -> Iterator[object]:
        """Place the records' discs and make the searches for ``kinds`` of photons, step by step."""
        placed = yield from self._placed(self.records.discs, SPARSE)
        # Where a wall or an edge is in the way, its outline is looked at closely.
        rows = np.flatnonzero(placed.area.partial)
        if len(rows):
            placed = placed.with_rows(rows, (yield from self._placed(self.records.discs.taken(rows), 1)))
        cells = len(self.records)
        halves = [placed.taken(slice(0, cells)), placed.taken(slice(cells, 2 * cells))]
        most = self._settings.bounces - 1
        self.searches = [PhotonSearch(kind, half, number, most) for kind in kinds for number, half in enumerate(halves)]

    def _placed(self, discs: TangentDiscs, every: int) -> Generator[object, None, VisibleDiscs]:
        return VisibleDiscs.joined((yield from collected(placing(self._caster, self._crew)(discs, every=every))))

    @property
    def found(self) -> dict[str, np.ndarray]:
        """What has been found: the "direct" and the "indirect" irradiance at the records, and what halves of their
        photons differ by in three ways, (2 C, 6) W/m^2."""
        found = {kind: np.zeros((2 * len(self.records), 6)) for kind in ("direct", "indirect")}
        if self.shadow_rays is not None:
            found["direct"][:, :3] = of_records(self.shadow_rays.irradiance.value)
        cells = len(self.records)
        for search in self.searches:
            rows = slice(search.half * cells, (search.half + 1) * cells)
            found[search.kind][rows] = search.estimate.with_contrasts
        return found

    def update(self) -> None:
        """Let what has been found be looked up."""
        found = self.found
        self.reflected.know(found["direct"], found["indirect"])
        if self._crew is not None:
            self._crew.know_light(found["direct"], found["indirect"])
        # Emission may be negative, and then sums may be zero or less.
        whole = max(float(sum(np.abs(light[:, :3]).sum() for light in found.values())), 1e-300)
        errors = (s.estimate.common_error * np.abs(s.estimate.irradiance.value).sum() / whole for s in self.searches)
        self.common_error = float(np.sqrt(sum(error**2 for error in errors)))


def of_records(light: np.ndarray) -> np.ndarray:
    """Means (2 C, 3) over the lookouts of each record, of ``light`` at all lookouts, in their order."""
    return light.reshape(-1, LOOKOUTS, light.shape[1]).mean(axis=1)
