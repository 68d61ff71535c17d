"""Light by photons: trace a batch, gather the segments that cross each disc, add them up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..estimator.estimate import Accumulator, IrradianceEstimate
from ..estimator.visible_area import VisibleDiscs
from ..gatherers.gatherer import Gatherer
from ..parallel import ordered_map
from ..random_streams import random_stream
from ..segments import Segments
from ..stages import Stopwatch
from .photon_journal import PhotonJournal
from .tracing import PhotonTracer

#: Particles traced at a time, and gathered at a time. Fixed, because the random numbers follow from them:
#: a seed gives the same light whatever the machine, the gatherer or the number of threads.
PHOTONS_PER_TRACE = 1 << 15
PHOTONS_PER_GATHER = 1 << 18


@dataclass
class PhotonSearch:
    """Looks for ``kind`` of light, "direct", "indirect" or "caustic", at ``placed`` discs.

    half      of all particles only those with even (0) or odd (1) numbers count; None: all
    most      segments after more bounces than this do not count; None: all do
    estimate  what has been found so far

    Attribute ``gatherer``, the search over the discs, to be set before photons come.
    """

    kind: str
    placed: VisibleDiscs
    half: int | None = None
    most: int | None = None
    estimate: IrradianceEstimate | None = None
    gatherer: ClassVar[Gatherer | None] = None

    def __post_init__(self):
        if self.estimate is None:
            self.estimate = IrradianceEstimate.empty(self.placed.area.nested)

    def wanted(self, segments: Segments) -> Segments:
        """Those of ``segments`` that count; they carry the scene's full power together."""
        if self.half is not None:
            segments = segments.taken(segments.particle & 1 == self.half).weighted(2.0)
        some = segments.of_kind(self.kind)
        return some if self.most is None else some.taken(some.bounce <= self.most)

    def count(self, particles: int) -> int:
        """How many of so many ``particles`` count."""
        return particles if self.half is None else (particles + 1 - self.half) // 2


class PhotonLight:
    """What photons bring to each of some ``searches``, batch after batch.

    Attributes: how many ``particles`` were traced so far, how many of their ``segments`` were gathered, and how many
    ``crossings`` were found; ``journal``, which keeps all of them where a bake is to be updated, or None.
    """

    journal: PhotonJournal | None = None

    def __init__(self, tracer: PhotonTracer, searches: Sequence[PhotonSearch], seed: int):
        self._tracer, self.searches, self._seed = tracer, searches, seed
        self._cut = np.zeros(3)
        self.particles = self.segments = self.crossings = 0

    @property
    def cut_flux(self) -> np.ndarray:
        """The (3,) W of the lights' flux that the bounce limit cut off."""
        return self._cut / max(self.particles, 1)

    def batch(self, particles: int, stopwatch: Stopwatch) -> Iterator[str]:
        """Trace so many ``particles`` more and gather their segments; yields what is being done.

        The time counts for the stopwatch's stages "trace" and "gather".
        """
        starts = range(self.particles, self.particles + particles, PHOTONS_PER_TRACE)
        shares = [min(PHOTONS_PER_TRACE, starts.stop - start) for start in starts]
        traces = ordered_map(
            lambda task: self._tracer.trace(task[0], self._generator(task[1]), task[1]),
            zip(shares, starts, strict=True),
        )
        yield "Tracing photons"
        parts = []
        for share, traced in zip(shares, stopwatch.timed("trace", traces), strict=True):
            segments = traced.segments
            if self.journal is not None:
                self.journal.keep(segments.weighted(share), traced.lights)
                # It keeps all; what is gathered is as without it, and so is what a step costs.
                segments = segments if any(search.kind == "direct" for search in self.searches) else segments.indirect
            # Each part carries the scene's full power; in its batch it stands for its share of the particles.
            parts.append(segments.weighted(share / particles))
            self._cut += traced.cut_flux * share
            yield "Tracing photons"
        segments = Segments.joined(parts)
        self.segments += len(segments)
        self.particles += particles
        for search in self.searches:
            for _ in self._gathered(search, segments, particles, stopwatch):
                yield "Gathering"

    def _gathered(self, search: PhotonSearch, segments: Segments, particles: int, stopwatch) -> Iterator[None]:
        with stopwatch("gather"):
            segments, placed = search.wanted(segments), search.placed
            accumulator = Accumulator(placed.discs, segments, search.count(particles), placed.area)
        yield
        for crossings in stopwatch.timed("gather", search.gatherer.crossings(segments)):
            self.crossings += len(crossings)
            with stopwatch("gather"):
                accumulator.add(crossings)
            yield
        with stopwatch("gather"):
            search.estimate = search.estimate.merged(accumulator.estimate())

    def _generator(self, start: int) -> np.random.Generator:
        """The random numbers of the particles from ``start`` on."""
        return random_stream(self._seed, "photons", start)
