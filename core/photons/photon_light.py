"""Light by photons: trace a batch, gather the segments that cross each disc, add them up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..estimator.estimate import Accumulator, IrradianceEstimate
from ..estimator.visible_area import VisibleDiscs
from ..gatherers.gatherer import Gatherer
from ..irradiance import Irradiance
from ..parallel import ordered_map
from ..segments import Segments
from ..stopwatch import Stopwatch
from .emission_guide import EmissionGuide
from .tracing import PhotonTracer

#: Particles traced at a time, and gathered at a time. Fixed, because the random numbers follow from them:
#: a seed gives the same light whatever the machine, the gatherer or the number of threads.
PHOTONS_PER_TRACE = 1 << 15
PHOTONS_PER_GATHER = 1 << 18


class PhotonLight:
    """What photons bring to ``placed`` discs: ``kinds`` of light, "direct", "indirect" or both, batch after batch.

    Attributes: how many ``particles`` were traced so far, how many of their ``segments`` were gathered, and how many
    ``crossings`` were found.
    """

    def __init__(self, tracer: PhotonTracer, placed: VisibleDiscs, kinds: Sequence[str], seed: int):
        self._tracer, self._placed, self._seed = tracer, placed, seed
        self._gatherer: Gatherer | None = None
        self._estimates = {kind: IrradianceEstimate.empty(placed.area.nested) for kind in kinds}
        self._cut = np.zeros(3)
        self.particles = self.segments = self.crossings = 0

    def part(self, kind: str) -> Irradiance:
        """The irradiance of one kind of light so far; none, for certain, of a kind that is not looked for."""
        if kind in self._estimates:
            return self._estimates[kind].irradiance
        return Irradiance.dark(len(self._placed.discs))

    @property
    def noise(self) -> Irradiance:
        """All of it, with a standard error that holds only what more photons would take away."""
        return sum((estimate.noise for estimate in self._estimates.values()), Irradiance.dark(len(self._placed.discs)))

    def prepare(self, gatherer: Gatherer, guide: EmissionGuide) -> None:
        """Let ``gatherer`` search the discs, and ``guide`` aim the lights: once, before the first batch."""
        self._gatherer, self._tracer = gatherer, self._tracer.guided(guide)

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
            # Each part carries the scene's full power; in its batch it stands for its share of the particles.
            parts.append(traced.segments.weighted(share / particles))
            self._cut += traced.cut_flux * share
            yield "Tracing photons"
        segments = Segments.joined(parts)
        self.segments += len(segments)
        self.particles += particles
        for kind in self._estimates:
            for _ in self._gathered(
                kind, segments.direct if kind == "direct" else segments.indirect, particles, stopwatch
            ):
                yield "Gathering"

    def _gathered(self, kind: str, segments: Segments, particles: int, stopwatch: Stopwatch) -> Iterator[None]:
        accumulator = Accumulator(self._placed.discs, segments, particles, self._placed.area)
        yield
        for crossings in stopwatch.timed("gather", self._gatherer.crossings(segments)):
            self.crossings += len(crossings)
            with stopwatch("gather"):
                accumulator.add(crossings)
            yield
        with stopwatch("gather"):
            self._estimates[kind] = self._estimates[kind].merged(accumulator.estimate())

    def _generator(self, start: int) -> np.random.Generator:
        """The random numbers of the particles from ``start`` on; key 0 is the pilot's (see core/radius.py)."""
        return np.random.default_rng(np.random.SeedSequence(self._seed, spawn_key=(1, start)))
