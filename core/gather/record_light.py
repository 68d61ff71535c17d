"""Light at records: direct by shadow rays, the rest by DETP, each half of the records by its own half of photons."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..direct.direct_light import DirectLight
from ..direct.lit_scene import LitScene
from ..discs import TangentDiscs
from ..estimator.visible_area import SPARSE, VisibleDiscs, placing
from ..group_sums import group_means
from ..photons.photon_light import PhotonSearch
from ..settings import BakeSettings
from ..stages import collected
from .records import LOOKOUTS, WIDTH, Landings, Records
from .reflected_light import ReflectedLight

if TYPE_CHECKING:
    from ..cluster.crew import Crew

#: Rounds of shadow rays from each lookout at first, and at most: their noise is averaged by the points that look there.
LOOKOUT_ROUNDS, MOST_LOOKOUT_ROUNDS = 2, 32

#: Where an edge of light runs through their cells, records look at the lights from more places, those first that are
#: seen most, until what is left has no more than this share of all their light in doubt, or there are so many places.
IN_DOUBT, MOST_PLACES = 0.01, 1 << 15


class RecordLight:
    """What is known of the light at ``records``, for ``reflected`` to be looked up.

    Shadow rays go to all lights of ``lit``, unless the direct light comes ``by_photons``. The workers of a ``crew`` do
    the heavy work.

    Attributes: the ``searches`` for photons; ``shadow_rays``, the light at the records' lookouts; ``common_error``, the
    relative standard error of all records' mean, as far as photons and places are to blame.
    """

    def __init__(
        self,
        lit: LitScene,
        records: Records,
        settings: BakeSettings,
        by_photons: bool,
        crew: Crew | None = None,
    ):
        self._lit, self.records, self._settings, self._crew = lit, records, settings, crew
        self.reflected = ReflectedLight(lit, records.finder, settings.bounces)
        self.searches: list[PhotonSearch] = []
        self.common_error = 0.0
        # Looks at the lights, and for which record each is; whether a record looks from all places that it may.
        self._looks: list[tuple[DirectLight, np.ndarray]] = []
        self._straight: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None  # what they have found
        self._close = np.zeros(2 * len(records), bool)
        if lit.lights and len(records) and not by_photons:
            self._look_from(records.lookouts, np.repeat(np.arange(2 * len(records)), LOOKOUTS))
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
        """Cast shadow rays from the lookouts, step by step: the first rounds, then as many ``times`` those before; and
        from more places, where that is called for."""
        for light, _ in self._looks:
            yield from _rounds(light, times)
        if self._looks:
            self._straight = self._means()
            lookouts, record = self._closer()
            if len(record):
                self._look_from(lookouts, record)
                yield from _rounds(self._looks[-1][0], times)
                self._straight = self._means()

    def _look_from(self, lookouts: Landings, record: np.ndarray) -> None:
        """Look at the lights from these K ``lookouts`` as well, each for a ``record`` (K,)."""
        light = DirectLight(self._lit, lookouts.stands, lookouts.normals, self._settings, crew=self._crew)
        self._looks.append((light, record))

    def _closer(self) -> tuple[Landings, np.ndarray]:
        """From where, and for which records, it is to be looked at the lights beside the lookouts.

        What the lookouts of the others around and of a cell's other record differ by tells which these are: would they
        be chosen by their own, small patches of light would count where they were met, and not where they were missed.
        """
        light, variance, count = self._straight
        seen, group = self.records.seen, self.shadow_rays.group[::LOOKOUTS]
        around = np.bincount(group, variance)[group] - variance
        around /= np.maximum(np.bincount(group)[group] - 1, 1)
        whole = seen @ np.abs(light).sum(axis=1)
        doubt = seen**2 * np.maximum(around, np.roll(variance, len(self))) / count
        doubt[self._close] = 0.0
        order = np.argsort(-doubt)
        left = doubt.sum() - np.cumsum(doubt[order]) + doubt[order]  # before each
        places = np.cumsum(seen[order])
        chosen = order[(left > (IN_DOUBT * whole) ** 2) & (places <= MOST_PLACES)]
        self._close[chosen] = True
        record, lookouts = self.records.more_lookouts(chosen)
        return lookouts, record

    def _means(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What comes straight from the lights (2 C, 3) W/m^2; the variance (2 C,) of its RGB sum over the places from
        where each record looks, and how many (2 C,) these are."""
        parts = [(light.irradiance.value, record) for light, record in self._looks]
        light, record = (np.concatenate(part) for part in zip(*parts, strict=True))
        mean, _ = group_means(light, record, 2 * len(self))
        away, count = (light - mean[record]).sum(axis=1), np.bincount(record)
        return mean, np.bincount(record, away**2) / (count - 1), count

    @property
    def shadow_rays(self) -> DirectLight | None:
        """The lookouts' light; None where no light is looked for."""
        return self._looks[0][0] if self._looks else None

    @property
    def rays(self) -> int:
        """Shadow rays so far."""
        return sum(light.rays for light, _ in self._looks)

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
        return VisibleDiscs.joined((yield from collected(placing(self._lit.caster, self._crew)(discs, every=every))))

    @property
    def found(self) -> dict[str, np.ndarray]:
        """What has been found: the "direct" and the "indirect" irradiance at the records, and what halves of their
        photons differ by in three ways, (2 C, 6) W/m^2."""
        found = {kind: np.zeros((2 * len(self.records), 6)) for kind in ("direct", "indirect")}
        if self._looks:
            found["direct"][:, :3] = self._straight[0]
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
        errors = [s.estimate.common_error * np.abs(s.estimate.irradiance.value).sum() / whole for s in self.searches]
        if self._looks:
            seen = self.records.seen
            whole = max(float(sum(seen @ np.abs(light[:, :3]).sum(axis=1) for light in found.values())), 1e-300)
            _, variance, count = self._straight
            errors.append(np.sqrt(seen**2 @ (variance / count)) / whole)
        self.common_error = float(np.sqrt(sum(error**2 for error in errors)))


def _rounds(light: DirectLight, times: float) -> Iterator[None]:
    """The first rounds of ``light``, step by step, then as many ``times`` those before."""
    done = light.done
    if not (done and light.exact):
        rounds = min(int(np.ceil(times * done)), MOST_LOOKOUT_ROUNDS - done) if done else LOOKOUT_ROUNDS
        for _ in light.rounds(done, done + rounds):
            yield
