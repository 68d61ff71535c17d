"""Light by photons: trace a batch, gather the segments that cross each disc, add them up."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..estimator.crossing_sums import Accumulator, BatchSums, CrossingSums
from ..estimator.estimate import IrradianceEstimate
from ..estimator.visible_area import VisibleDiscs
from ..gatherers.choose import make_gatherer
from ..gatherers.gatherer import Gatherer
from ..parallel import interleaved, ordered_map, slices, worker_count
from ..random_streams import random_stream
from ..segments import Segments
from ..stages import Stopwatch
from .photon_journal import PhotonJournal
from .tracing import PhotonTracer, TracedPhotons

if TYPE_CHECKING:
    from ..cluster.crew import Crew

#: Particles of a batch at most. It is cut into so many pieces, but of so many particles at least, and at most. Fixed,
#: because the random numbers follow from them: a seed gives the same light whoever works on the pieces.
PHOTONS_PER_GATHER = 1 << 18
PIECES, LEAST_PER_PIECE, PHOTONS_PER_TRACE = 8, 1 << 13, 1 << 15

#: Rings of discs that may be summed up side by side, by threads with sums of their own of all discs.
MOST_SUMS = 1 << 24


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

    def gathered(self, segments: Segments) -> Generator[None, None, CrossingSums]:
        """Find what ``segments``, all of some particles, bring to the discs, step by step."""
        segments, placed = self.wanted(segments), self.placed
        # Only records are asked what halves of their photons differ by.
        accumulator = Accumulator(placed.discs, segments, placed.area, contrasts=self.half is not None)
        yield
        for crossings in self.gatherer.crossings(segments):
            accumulator.add(crossings)
            yield
        return accumulator.sums()

    def count(self, particles: int) -> int:
        """How many of so many ``particles`` count."""
        return particles if self.half is None else (particles + 1 - self.half) // 2


@dataclass(frozen=True)
class PhotonPiece:
    """Particles that are traced and gathered together: those from the number ``first`` to before ``last``, a ``share``
    of a batch."""

    first: int
    last: int
    share: float

    @classmethod
    def of_batch(cls, begin: int, particles: int) -> list[PhotonPiece]:
        """Those of so many ``particles``, from the number ``begin`` on."""
        size = int(np.clip(-(-particles // PIECES), LEAST_PER_PIECE, PHOTONS_PER_TRACE))
        parts = slices(particles, size)
        return [cls(begin + p.start, begin + p.stop, (p.stop - p.start) / particles) for p in parts]

    @property
    def particles(self) -> int:
        """How many they are."""
        return self.last - self.first


@dataclass(frozen=True)
class PieceSums:
    """What a ``piece`` of particles brings: the number of its ``segments``, the ``sums`` of each search, and the flux
    (3,) W that was ``cut`` of it, times its particles."""

    piece: PhotonPiece
    segments: int
    cut: np.ndarray
    sums: tuple[CrossingSums, ...]


class PhotonLight:
    """What photons bring to each of some ``searches``, batch after batch.

    Batches are worked on in pieces, each with sums of its own, which are added in their order: the light is the same by
    any number of threads, and by the workers of a ``crew``.

    Attributes: how many ``particles`` were traced so far, how many of their ``segments`` were gathered, and how many
    ``crossings`` were found; ``journal``, which keeps all of them where a bake is to be updated, or None: it takes that
    there is no crew.
    """

    journal: PhotonJournal | None = None

    def __init__(self, tracer: PhotonTracer, searches: Sequence[PhotonSearch], seed: int, crew: Crew | None = None):
        self._tracer, self.searches, self._seed, self._crew = tracer, searches, seed, crew
        self._cut = np.zeros(3)
        self.particles = self.segments = self.crossings = 0

    @property
    def cut_flux(self) -> np.ndarray:
        """The (3,) W of the lights' flux that the bounce limit cut off."""
        return self._cut / max(self.particles, 1)

    def make_gatherers(self, name: str) -> tuple[str, str]:
        """Make the searches' gatherers, one for all of the same discs, by ``name``, as :func:`.make_gatherer` does.

        The workers make theirs, if there are any.
        """
        made: dict[int, tuple[Gatherer, str]] = {}
        for search in self.searches:
            discs = search.placed.discs
            if self._crew is not None:
                discs = discs.taken(slice(0, 0))
            key = id(search.placed.discs.centres)
            made[key] = made.get(key) or make_gatherer(name, discs)
            search.gatherer, why = made[key]
        return search.gatherer.name, why

    def batch(self, particles: int, stopwatch: Stopwatch) -> Iterator[str]:
        """Trace so many ``particles`` more and gather their segments; yields what is being done.

        The time counts for the stopwatch's stages "trace" and "gather", that of workers for the latter.
        """
        pieces = PhotonPiece.of_batch(self.particles, particles)
        batches = [BatchSums(search.placed.area.nested) for search in self.searches]
        work = self._worked(pieces, stopwatch)
        if self._crew is not None:
            work = stopwatch.timed("gather", self._crew.photons(pieces))
        yield "Tracing photons"
        for found in work:
            if found is None:
                yield "Gathering"
                continue
            with stopwatch("gather"):
                self._count(found, batches)
            yield "Tracing photons"
        self.particles += particles
        with stopwatch("gather"):
            for search, batch in zip(self.searches, batches, strict=True):
                search.estimate = search.estimate.merged(batch.estimate(search.count(particles)))

    def found(self, piece: PhotonPiece) -> PieceSums:
        """What that ``piece`` brings, in one call: a worker's part."""
        *_, found = self._gathered(piece, self._traced(piece))
        return found

    def _worked(self, pieces: list[PhotonPiece], stopwatch: Stopwatch) -> Iterator[PieceSums | None]:
        """What the ``pieces`` bring, in their order, and None at each step on the way."""
        rings = sum(search.placed.area.nested.size for search in self.searches)
        together = int(np.clip(MOST_SUMS // max(rings, 1), 1, worker_count()))
        tasks = self._tasks(pieces, stopwatch)
        while some := list(islice(tasks, together)):
            found = []
            for step in stopwatch.timed("gather", interleaved(self._gathered(*task) for task in some)):
                if step is None:
                    yield None
                else:
                    found.append(step)
            yield from sorted(found, key=lambda each: each.piece.first)

    def _tasks(self, pieces: list[PhotonPiece], stopwatch: Stopwatch) -> Iterator[tuple[PhotonPiece, TracedPhotons]]:
        """The ``pieces``, each with what its particles do."""
        traces = ordered_map(self._traced, pieces)
        for piece, traced in zip(pieces, stopwatch.timed("trace", traces), strict=True):
            if self.journal is not None:
                self.journal.keep(traced.segments.weighted(piece.particles), traced.lights)
            yield piece, traced

    def _traced(self, piece: PhotonPiece) -> TracedPhotons:
        return self._tracer.trace(piece.particles, random_stream(self._seed, "photons", piece.first), piece.first)

    def _gathered(self, piece: PhotonPiece, traced: TracedPhotons) -> Iterator[PieceSums | None]:
        """None at each step, and at last what the piece brings."""
        segments, sums = traced.segments, []
        if self.journal is not None and all(search.kind != "direct" for search in self.searches):
            segments = segments.indirect  # it keeps all; what is gathered is as without it, and so is what a step costs
        # A piece carries the scene's full power; in the batch it stands for its share of it.
        segments = segments.weighted(piece.share)
        for search in self.searches:
            sums.append((yield from search.gathered(segments)))
        yield PieceSums(piece, len(segments), traced.cut_flux * piece.particles, tuple(sums))

    def _count(self, found: PieceSums, batches: Sequence[BatchSums]) -> None:
        """Count in what a piece of the ``batches``, one for each search, brought."""
        self._cut += found.cut
        self.segments += found.segments
        for batch, sums in zip(batches, found.sums, strict=True):
            self.crossings += sums.crossings
            batch.add(sums)
