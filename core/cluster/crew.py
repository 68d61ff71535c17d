"""The workers of one bake: what they are sent once, and the pieces of its heavy work, handed out and put together.

Pieces are cut as threads cut them, each with its own random stream, and come back in order. So the light is the same,
bit for bit, whoever does them.
"""

from __future__ import annotations

import uuid
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from itertools import count

import numpy as np

from ..direct.direct_light import DirectLight
from ..discs import TangentDiscs
from ..estimator.standpoints import POINTS_PER_CHUNK, Standpoints
from ..estimator.visible_area import VisibleDiscs
from ..forecast import processor_seconds
from ..gather.records import MOST_CELLS, RecordFinder
from ..memory import check_workers, workers_that_fit
from ..parallel import slices, worker_count
from ..photons.photon_light import PhotonPiece, PhotonSearch, PieceSums
from ..points import Points
from ..scene import Scene
from ..settings import BakeSettings
from .dask_hands import DaskHands, hands_at
from .packing import packed, unpacked
from .processes import ProcessHands, processes_at_hand

#: In place of a scheduler's address: processes of this machine, however little there is to do.
LOCAL = "local"

#: Seconds of one processor of the reference from which on a bake is worth the start of processes.
WORTH = 2.5


class Crew:
    """Has ``hands`` do the heavy parts of a bake of ``scene`` at ``points``; ``name`` tells it from all other bakes.

    Hands are given bytes by name, and do the tasks of bench.py with these.
    """

    def __init__(
        self, hands: ProcessHands | DaskHands, name: str, scene: Scene, points: Points, settings: BakeSettings
    ):
        self._hands, self._points, self._numbers = hands, points, count()
        self._scene = f"scene {name}"
        self._given = {"scene": self._scene}
        hands.give(self._scene, packed((scene, points, settings)))

    def _give(self, what: str, *values) -> None:
        """Give all the ``values`` of what is so called, in the place of those before."""
        before = self._given.get(what)
        self._given[what] = f"{what}:{next(self._numbers)}"
        self._hands.give(self._given[what], packed(values))
        if before is not None:
            self._hands.drop(before)

    def _map(self, task: str, pieces: Iterable[tuple], *needs: str) -> Iterator:
        """What the ``task`` makes of ``pieces``, of which it ``needs`` to know what has been given beside the scene."""
        keys = tuple(self._given[what] for what in ("scene", *needs) if what in self._given)
        return map(unpacked, self._hands.map(task, keys, map(packed, pieces)))

    def standpoints(self) -> Iterator[Standpoints]:
        """Where the points can look around from, some at a time."""
        pieces = ((rows.start, rows.stop) for rows in slices(len(self._points), POINTS_PER_CHUNK))
        return self._map("stand", pieces)

    def visible_discs(
        self,
        discs: TangentDiscs,
        inward: np.ndarray | None = None,
        every: int = 1,
        facing: np.ndarray | None = None,
    ) -> Iterator[VisibleDiscs]:
        """As :func:`..estimator.visible_area.visible_discs`."""

        def piece(rows: slice) -> tuple:
            beside, up = (None if each is None else each[rows] for each in (inward, facing))
            return discs.taken(rows), beside, every, up

        for told in self._map("place", map(piece, slices(len(discs), POINTS_PER_CHUNK))):
            yield VisibleDiscs.of(*told)

    def know_records(self, finder: RecordFinder) -> None:
        """Let all know where the records are."""
        self._give("records", finder.corner, finder.finest, finder.numbers, finder.cut)

    def know_light(self, direct: np.ndarray, indirect: np.ndarray) -> None:
        """Let all know the light at the records, as :meth:`.ReflectedLight.know` takes it."""
        self._give("light", direct, indirect)

    def know_searches(self, tracing: tuple, searches: Sequence[PhotonSearch]) -> None:
        """Let all know where photons are looked for, and of what their tracer is made beside the scene."""
        self._give("searches", tracing, [(s.kind, s.placed.told(), s.half, s.most) for s in searches])

    def photons(self, pieces: Sequence[PhotonPiece]) -> Iterator[PieceSums]:
        """What the ``pieces`` of photons bring to the searches."""
        return self._map("photons", ((piece,) for piece in pieces), "searches")

    def cast(self, light: DirectLight, groups: list[slice], begin: int, rounds: np.ndarray) -> Iterator[None]:
        """Cast ``rounds`` (N,) of rays from the points of ``light``, from the round ``begin`` on, by ``groups``."""
        pieces = ((light.piece(part, begin, rounds),) for part in groups)
        for part, brought in zip(groups, self._map("cast", pieces, "records", "light"), strict=True):
            light.take(part, brought)
            yield


@contextmanager
def crew_of(
    scene: Scene, points: Points, settings: BakeSettings, address: str | None = None, beside: int = 1
) -> Iterator[Crew | None]:
    """Who does the heavy parts of a bake; what they do is cancelled at the end.

    The workers of the Dask scheduler at ``address``; where that is LOCAL a process for each processor of this machine.
    Without an address as many of these as so many bakes ``beside`` each other leave, where there is work enough for
    them and memory; else nobody. Raises ClusterError when workers cannot be had, or do not suit, and OutOfMemoryError
    when this machine has not memory enough for them.
    """
    at_points = "photons" in (settings.direct_by, settings.indirect_by)
    discs = len(points) if at_points else min(len(points), 2 * MOST_CELLS)
    sizes, count = (len(scene.triangles), len(points), discs), worker_count()
    if address is None:
        count = min(count // beside, workers_that_fit(*sizes))
        pays = count > 1 and processor_seconds(len(points), settings) >= WORTH
        hands = processes_at_hand(count) if pays else nullcontext()
    elif address == LOCAL:
        check_workers(*sizes, count)
        hands = processes_at_hand(count)
    else:
        hands = hands_at(address)
    with hands as ready:
        yield None if ready is None else Crew(ready, uuid.uuid4().hex, scene, points, settings)
