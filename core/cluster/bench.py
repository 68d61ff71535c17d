"""What a worker does: tasks by name over what was sent to it once, whoever calls it. It needs no dask."""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from ..direct.direct_light import DirectLight
from ..direct.lit_scene import LitScene
from ..errors import ClusterError
from ..estimator.standpoints import Standpoints, plain_standpoints, standpoints
from ..estimator.visible_area import VisibleDiscs, visible_discs
from ..gather.records import RecordFinder
from ..gather.reflected_light import ReflectedLight
from ..memory import keep_memory
from ..parallel import alone
from ..photons.photon_light import PhotonLight, PhotonSearch
from ..photons.tracing import PhotonTracer
from ..points import Points
from ..rays import RayCaster
from ..scene import Scene
from ..settings import BakeSettings
from .packing import packed, unpacked

#: Bakes of which a worker keeps the scene at most.
MOST_BENCHES = 2

_benches: OrderedDict[str, Bench] = OrderedDict()
_lock = threading.Lock()


@cache
def code_identity() -> str:
    """Which code this is: of the core's source files, as they are."""
    digest = hashlib.sha256()
    core = Path(__file__).parents[1]
    for path in sorted(core.rglob("*.py")):
        digest.update(path.relative_to(core).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def worked(task: str, code: str, keys: Sequence[str], piece: np.ndarray, *shared: np.ndarray) -> np.ndarray:
    """What is :func:`done`, in a process that does nothing else, of another machine perhaps: the one function that
    Dask's workers are told. Raises ClusterError when the caller's ``code`` is another one.
    """
    if code != code_identity():
        raise ClusterError("A worker has another version of detp than this one: install the same on all.")
    keep_memory()
    return done(task, keys, piece, *shared)


def done(task: str, keys: Sequence[str], piece: np.ndarray, *shared: np.ndarray) -> np.ndarray:
    """Do the ``task`` of that name for a ``piece`` of a bake, all as bytes.

    ``shared`` is what was sent once, of which ``keys`` are the names, so that it is worked out once; the first is the
    scene.
    """
    with alone():
        with _lock:
            if keys[0] not in _benches:
                _benches[keys[0]] = Bench(*unpacked(shared[0]))
            bench = _benches[keys[0]]
            _benches.move_to_end(keys[0])
            while len(_benches) > MOST_BENCHES:
                _benches.popitem(last=False)
            for key, data in zip(keys[1:], shared[1:], strict=True):
                bench.lay(key, data)
        return packed(TASKS[task](bench, *unpacked(piece)))


def forget(key: str) -> None:
    """Keep nothing more of the scene that is called ``key``."""
    with _lock:
        _benches.pop(key, None)


class Bench:
    """Where a worker works on one bake: its ``scene``, ``points`` and ``settings``, and what follows from them."""

    def __init__(self, scene: Scene, points: Points, settings: BakeSettings):
        self.points, self.settings = points, settings
        self.lit = LitScene(scene, RayCaster(scene.corners, points.centres))
        self.reflected: ReflectedLight | None = None
        self.photons: PhotonLight | None = None
        self._laid: dict[str, str] = {}

    def lay(self, key: str, data: np.ndarray) -> None:
        """Have at hand what is called ``key``, "<what it is>:<of which time>"; what was laid there before goes."""
        what = key.partition(":")[0]
        if self._laid.get(what) != key:
            getattr(self, f"_lay_{what}")(*unpacked(data))
            self._laid[what] = key

    def _lay_records(self, *finder) -> None:
        found = RecordFinder(*finder)
        self.reflected = ReflectedLight(self.lit, found, self.settings.bounces)
        self._laid.pop("light", None)

    def _lay_light(self, direct: np.ndarray, indirect: np.ndarray) -> None:
        self.reflected.know(direct, indirect)

    def _lay_searches(self, tracing: tuple, searches: tuple) -> None:
        tracer = PhotonTracer(self.lit.scene, self.lit.caster, *tracing)
        found = [PhotonSearch(kind, VisibleDiscs.of(*told), *counts) for kind, told, *counts in searches]
        self.photons = PhotonLight(tracer, found, self.settings.seed)
        self.photons.make_gatherers(self.settings.gatherer)


def _stand(bench: Bench, begin: int, end: int) -> Standpoints:
    """Where the points from ``begin`` to before ``end`` can look around from."""
    points, rows = bench.points, slice(begin, end)
    centres, facing = points.centres[rows], points.facing[rows]
    if bench.settings.estimator == "plain":
        found = plain_standpoints(bench.lit.caster, centres, facing)
    else:
        found = standpoints(bench.lit.caster, centres, facing, None if points.inward is None else points.inward[rows])
    return Standpoints.joined(list(found))


TASKS: dict[str, Callable] = {
    "stand": _stand,
    "place": lambda bench, *discs: VisibleDiscs.joined(list(visible_discs(bench.lit.caster, *discs))).told(),
    "cast": lambda bench, piece: DirectLight.cast_piece(piece, bench.lit, bench.settings, bench.reflected),
    "photons": lambda bench, piece: bench.photons.found(piece),
}
