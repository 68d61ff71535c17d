"""From counts to seconds: what each comparison costs, and how fast this machine is."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache

import numpy as np

from .discs import TangentDiscs
from .gatherers.disc_index import DiscIndex
from .gatherers.streams import LANES
from .parallel import ordered_map, worker_count
from .segments import Segments

#: Nanoseconds of one processor for each thing that Counts counts, by kind of search, on the reference machine: fitted
#: to the searches of the samples and of ten real scenes by `detp study`, which fits them anew wherever it runs. Their
#: ratios decide which gatherer "auto" takes, and are not measured in a bake: a scene must give the same light on every
#: machine. The searches share the code for patches, discs, tests and crossings, and so its costs.
_SHARED = {"patches": 94.0, "discs": 22.0, "tests": 49.0, "crossings": 87.0}
UNIT_COSTS = {
    "grid": {"segments": 128.0, "nodes": 93.0, **_SHARED},
    "tree": {"segments": 306.0, "nodes": 32.0, **_SHARED},
    "sphere-cache": {"nodes": 17.0, "lists": 6100.0, **_SHARED},
    "brute-force": {"tests": 30.0},
}

#: Nanoseconds to build a search, for each disc; the grid's cells and entries are known beforehand, see search_plan.py.
BUILD_COSTS = {"grid": 4000.0, "tree": 2900.0, "sphere-cache": 2600.0, "brute-force": 0.0}

#: How much longer than by its processor time a search takes where several processors share it, beside the others: the
#: tree's operations are shorter, and more often wait for the interpreter's lock.
SHARED_OUT = {"tree": 1.08}

#: Work of fewer reference seconds is not worth the tenth of a second that measuring a machine takes.
WORTH_MEASURING = 1.0

#: Reference seconds of the search that a machine is measured by.
STANDARD = 0.022


@dataclass(frozen=True)
class Machine:
    """This machine beside the reference.

    slowness  seconds of one processor here over those that UNIT_COSTS give
    parallel  how many times faster all processors together are
    """

    slowness: float
    parallel: float

    def wall_seconds(self, processor_seconds: float, lanes: int = 1 << 30) -> float:
        """How long work takes that the reference does in ``processor_seconds``, cut into that many ``lanes``."""
        return processor_seconds * self.slowness / min(self.parallel, max(1, lanes))


def search_seconds(kind: str, counts: dict[str, int], segments: int, chunk: int) -> float:
    """Reference seconds of one processor to search ``segments``, from the ``counts`` of a few of them.

    ``kind`` is a key of UNIT_COSTS. All counts grow with the segments, except that the Sphere Cache makes its lists
    once for every ``chunk`` of them.
    """
    costs = UNIT_COSTS[kind]
    each = sum(cost * counts[name] for name, cost in costs.items() if name != "lists") / max(1, counts["segments"])
    return 1e-9 * (each * segments + costs.get("lists", 0.0) * counts.get("lists", 0) * np.ceil(segments / chunk))


def search_lanes(segments: int, chunk: int) -> int:
    """Into how many parts the gatherers cut ``segments`` to search them side by side, see gatherers/streams.py."""
    return -(-segments // max(1, min(chunk, max(-(-segments // LANES), chunk // 2))))


def build_seconds(kind: str, discs: int) -> float:
    """Reference seconds of one processor to build a search of that ``kind`` over so many discs, to a factor of two."""
    return 1e-9 * BUILD_COSTS[kind] * discs


def seconds_here(processor_seconds: float, lanes: int) -> float:
    """About how long work takes here that the reference does in ``processor_seconds``, cut into that many ``lanes``.

    For what is done in a moment the machine is not measured: it counts as the reference.
    """
    machine = this_machine() if processor_seconds >= WORTH_MEASURING else Machine(1.0, worker_count())
    return machine.wall_seconds(processor_seconds, lanes)


@cache
def this_machine() -> Machine:
    """Measured once per process, in about a tenth of a second."""
    rounds = [measured_machine() for _ in range(3)]
    slowness = sorted(machine.slowness for machine in rounds)
    # Two threads that meet an idle processor too late look like one.
    return Machine(slowness[1], max(machine.parallel for machine in rounds))


def measured_machine() -> Machine:
    """How fast it is at this moment: one search on every processor at the same time."""
    search, segments = _standard_search()
    workers = worker_count()
    begin = time.perf_counter()
    used = sum(ordered_map(lambda _: _processor_seconds(search, segments), range(workers)))
    parallel = float(np.clip(used / (time.perf_counter() - begin), 1.0, workers))
    return Machine(used / workers / STANDARD, parallel)


def bare_segments(origins: np.ndarray, ends: np.ndarray) -> Segments:
    """Segments from ``origins`` to ``ends`` (S, 3) m for a search of which only the crossings matter."""
    return Segments(origins, ends, np.ones((len(origins), 3)), np.zeros(len(origins), np.uint16))


def _processor_seconds(search: DiscIndex, segments: Segments) -> float:
    begin = time.thread_time()
    for _ in search.crossings(segments):
        pass
    return time.thread_time() - begin


@cache
def _standard_search() -> tuple[DiscIndex, Segments]:
    discs, segments = _standard_field(4000, 4000)
    search = DiscIndex(discs, "grid")
    # The first time is slower.
    _processor_seconds(search, segments)
    return search, segments


def _standard_field(points: int, lines: int) -> tuple[TangentDiscs, Segments]:
    """Discs on a sphere and in it, as far apart as they are wide, and chords: some of all that a search does."""
    generator = np.random.default_rng(1)
    normals = _unit(generator.normal(size=(points, 3)))
    shells = np.where(np.arange(points) % 2, 1.0, generator.random(points) ** (1.0 / 3.0))
    discs = TangentDiscs.of_radius(normals * shells[:, None], -normals, 0.06)
    ends = _unit(generator.normal(size=(2, lines, 3)))
    return discs, bare_segments(*ends)


def _unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)
