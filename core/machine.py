"""How fast this machine is beside the reference: seconds of one here for seconds of the other."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache

import numpy as np

from .discs import TangentDiscs
from .gatherers.disc_index import DiscIndex
from .parallel import ordered_map, worker_count
from .segments import Segments

#: Reference seconds of the search that a machine is measured by.
STANDARD = 0.042


@dataclass(frozen=True)
class Machine:
    """This machine beside the reference.

    slowness  seconds of one processor here over those of the reference
    parallel  how many times faster all processors together are
    """

    slowness: float
    parallel: float

    def wall_seconds(self, processor_seconds: float) -> float:
        """How long work takes here that one processor of the reference does in ``processor_seconds``."""
        return processor_seconds * self.slowness / self.parallel


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


def _processor_seconds(search: DiscIndex, segments: Segments) -> float:
    begin = time.thread_time()
    for _ in search.crossings(segments):
        pass
    return time.thread_time() - begin


@cache
def _standard_search() -> tuple[DiscIndex, Segments]:
    """Discs on a sphere and in it, as far apart as they are wide, and chords: some of all that a search does."""
    generator, count = np.random.default_rng(1), 4000
    normals = _unit(generator.normal(size=(count, 3)))
    shells = np.where(np.arange(count) % 2, 1.0, generator.random(count) ** (1.0 / 3.0))
    search = DiscIndex(TangentDiscs.of_radius(normals * shells[:, None], -normals, 0.06))
    segments = Segments.between(*_unit(generator.normal(size=(2, count, 3))))
    # The first time is slower.
    _processor_seconds(search, segments)
    return search, segments


def _unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)
