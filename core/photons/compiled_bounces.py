"""The same as bounces.py by compiled kernels, by the same random numbers."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np

from ..direct.surfaces import MOST_PASSAGES
from ..lights.light import Particles
from ..segments import Segments
from .bounces import EMISSION_LIFT, GRAZING_COSINE, HIT_DIMENSIONS, REACH_BEHIND, Bounces
from .specular import FACET_DIMENSIONS

#: Segments for which there is room at first, for each particle; memory that is not written costs nothing.
ROOM = 6


@dataclass(frozen=True)
class CompiledBounces:
    """Follows particles with the kernels ``compiled`` as ``bounces`` does without them."""

    compiled: ModuleType
    bounces: Bounces

    def followed(self, sent: Particles, first: int, generator: np.random.Generator) -> tuple[Segments, np.ndarray]:
        """As :meth:`Bounces.followed`: every generation of segments is written behind the one before it."""
        caster, count = self.bounces.caster, len(sent.origins)
        paths, cut = _Paths.empty(ROOM * count), np.zeros(3)
        going = np.empty((count, 3)), np.zeros(count, np.uint16), *(np.empty((count, 3), np.float32) for _ in range(2))
        self.compiled.launch(
            sent.origins, sent.directions, sent.flux, EMISSION_LIFT * caster.tolerance, first, caster.centre,
            caster.scale, paths.arrays, going,
        )  # fmt: skip
        begin, start = 0, np.empty(0) if sent.start is None else sent.start.copy()
        fixed = self._fixed()
        while count:
            hits = caster.cast(*going[2:])
            uniforms = self._uniforms(hits[0], generator)
            paths = paths.with_room(begin + count + len(uniforms[0]))
            alive = self.compiled.bounce(
                hits, paths.arrays, begin, going, start[: count if begin == 0 else 0], *fixed[:2], uniforms, *fixed[2:],
                cut,
            )  # fmt: skip
            begin, count = begin + count, alive
            going = tuple(array[:alive] for array in going)
        return self._kept(paths.until(begin), len(sent.origins), start), cut

    def _fixed(self) -> tuple:
        """What the kernel knows of the scene."""
        bounces, caster = self.bounces, self.bounces.caster
        nothing = np.empty((0, 3))
        transmittance = nothing if bounces.transmittance is None else bounces.transmittance
        tables = (nothing,) * 3 if bounces.specular is None else bounces.specular.tables
        return (
            (caster.edged, caster.normals, bounces.albedo, transmittance, bounces.kinds),
            tables,
            (REACH_BEHIND * caster.tolerance, GRAZING_COSINE, caster.tolerance),
            (bounces.bounds.centre, bounces.bounds.radius, caster.centre, caster.scale),
            (bounces.most, MOST_PASSAGES),
        )

    def _uniforms(self, triangle, generator) -> tuple[np.ndarray, np.ndarray]:
        met = np.count_nonzero(triangle >= 0)
        uniforms = generator.random((met, HIT_DIMENSIONS))
        if self.bounces.specular is None:
            return uniforms, np.empty((0, FACET_DIMENSIONS))
        glossy = np.count_nonzero(self.bounces.kinds.take(triangle[triangle >= 0]) >= 0)
        return uniforms, generator.random((glossy, FACET_DIMENSIONS))

    def _kept(self, segments: Segments, sent: int, start: np.ndarray) -> Segments:
        """Without what is blocked before it shines, and without direct light unless that is wanted.

        The first ``sent`` have left the lights.
        """
        if not self.bounces.direct:
            # Where nothing passes straight on, direct light is what left the lights.
            return segments.indirect if self.bounces.transmittance is not None else segments.taken(slice(sent, None))
        dark = np.flatnonzero(start < 0)
        return segments.taken(np.delete(np.arange(len(segments)), dark)) if len(dark) else segments


@dataclass(frozen=True)
class _Paths:
    """Segments one after another, with room behind them: origins, ends, flux, bounce, particle."""

    arrays: tuple[np.ndarray, ...]

    @classmethod
    def empty(cls, room: int) -> _Paths:
        """Room for so many."""
        vectors = (np.empty((room, 3)) for _ in range(3))
        return cls((*vectors, np.empty(room, np.uint16), np.empty(room, np.uint32)))

    def with_room(self, count: int) -> _Paths:
        """The same, with room for so many."""
        have = len(self.arrays[0])
        if count <= have:
            return self
        grown = _Paths.empty(2 * count)
        for new, old in zip(grown.arrays, self.arrays, strict=True):
            new[:have] = old
        return grown

    def until(self, count: int) -> Segments:
        """The first so many."""
        return Segments(*(array[:count] for array in self.arrays))
