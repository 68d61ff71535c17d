"""From counts to seconds: what each comparison costs, and how fast this machine is."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache

import numpy as np

from .discs import TangentDiscs
from .gatherers.counts import Counts
from .gatherers.disc_index import DiscIndex
from .gatherers.streams import LANES
from .parallel import ordered_map, worker_count
from .segments import Segments

#: Nanoseconds of one processor for each thing that Counts counts, by kind of search, on the reference machine: fitted
#: to the samples' searches by `detp study`, which fits them anew wherever it runs. Their ratios decide which
#: gatherer "auto" takes, and are not measured in a bake: a scene must give the same light on every machine.
UNIT_COSTS = {
    "grid": {"segments": 247.0, "nodes": 100.0, "patches": 176.0, "discs": 36.0, "tests": 76.0, "crossings": 95.0},
    "tree": {"segments": 199.0, "nodes": 57.0, "patches": 176.0, "discs": 36.0, "tests": 76.0, "crossings": 95.0},
    "sphere-cache": {"nodes": 21.0, "patches": 176.0, "discs": 36.0, "tests": 76.0, "crossings": 95.0, "lists": 9000.0},
    "brute-force": {"tests": 30.0},
    "compiled grid": {
        "segments": 200.0, "nodes": 20.0, "patches": 12.0, "discs": 2.5, "tests": 40.0, "crossings": 40.0,
    },
}  # fmt: skip

#: Nanoseconds to build a search, for each disc; the grid's cells and entries are known beforehand, see grid_cells.py.
BUILD_COSTS = {"grid": 5000.0, "tree": 4200.0, "sphere-cache": 3500.0, "brute-force": 0.0, "compiled grid": 1000.0}

#: What the search that a machine is measured by takes on the reference machine, over what UNIT_COSTS give for it: it is
#: simpler than the scenes that they were fitted to.
STANDARD = 0.71


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


@cache
def this_machine() -> Machine:
    """Measured once per process, in about a tenth of a second: one search again and again, alone and side by side."""
    discs, segments = _standard_field(4000, 4000)
    search, counts = DiscIndex(discs, "grid"), Counts()
    _exhaust(search, segments, counts)
    taken = min(_processor_seconds(search, segments) for _ in range(3))
    expected = search_seconds("grid", counts.totals(), len(segments), len(segments))
    # The best of a few: what else the machine does only takes away.
    return Machine(taken / (STANDARD * expected), max(_parallel(search, segments) for _ in range(2)))


def bare_segments(origins: np.ndarray, ends: np.ndarray) -> Segments:
    """Segments from ``origins`` to ``ends`` (S, 3) m for a search of which only the crossings matter."""
    return Segments(origins, ends, np.ones((len(origins), 3)), np.zeros(len(origins), np.uint16))


def _parallel(search, segments: Segments) -> float:
    """How many times faster all processors search than one, at least 1 and at most their number."""
    workers = worker_count()
    if workers == 1:
        return 1.0
    begin = time.perf_counter()
    used = sum(ordered_map(lambda _: _processor_seconds(search, segments), range(workers)))
    return float(np.clip(used / (time.perf_counter() - begin), 1.0, workers))


def _processor_seconds(search, segments: Segments) -> float:
    begin = time.thread_time()
    _exhaust(search, segments)
    return time.thread_time() - begin


def _exhaust(search, segments: Segments, counts: Counts | None = None) -> None:
    for _ in search.crossings(segments, counts):
        pass


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
