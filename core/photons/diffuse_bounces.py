"""Particles among surfaces that only reflect diffusely, by compiled kernels: what most scenes' tracing is."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np

from ..bounds import Bounds
from ..rays import RayCaster
from ..segments import Segments

#: How many tolerances behind their hit segments end, along the surface's normal.
REACH_BEHIND = 2

#: The smallest cosine for which a segment is lengthened to reach the tolerance behind its hit.
GRAZING_COSINE = 0.01


@dataclass(frozen=True)
class DiffuseBounces:
    """Follows particles with the kernels ``compiled`` as tracing.py does without them, by the same random numbers.

    normals, albedo  (T, 3) of the caster's triangles; ``bounds`` is left by segments that meet nothing
    """

    compiled: ModuleType
    caster: RayCaster
    normals: np.ndarray
    albedo: np.ndarray
    bounds: Bounds

    def followed(
        self, origins, directions, flux, bounce, particle, most: int, generator: np.random.Generator
    ) -> tuple[list[Segments], np.ndarray]:
        """All segments of R > 0 particles until at most ``most`` bounces more, and the flux (3,) W cut there."""
        parts, cut = [], np.zeros(3)
        near, towards = self.caster.seen_by_embree(origins), directions.astype(np.float32)
        origins, directions, flux = (np.require(array, requirements="CW") for array in (origins, directions, flux))
        while len(origins):
            count = len(origins)
            triangle, u, v = self.caster.cast(near, towards)
            choice = generator.random(np.count_nonzero(triangle >= 0))
            ends, rows = np.empty((count, 3)), np.empty(count, np.int64)
            kept, points = np.empty((count + 1, 3)), np.empty((count + 1, 3))
            alive = self.compiled.meet(
                triangle, u, v, self.caster.edged, self.normals, self.albedo, origins, directions, flux, choice,
                REACH_BEHIND * self.caster.tolerance, GRAZING_COSINE, self.bounds.centre, self.bounds.radius,
                ends, rows, kept, points,
            )  # fmt: skip
            parts.append(Segments(origins, ends, flux, bounce, particle))
            rows, flux = rows[:alive], kept[:alive]
            if len(parts) > most:
                return parts, cut + flux.sum(axis=0)
            bounce, particle = bounce.take(rows) + np.uint16(1), particle.take(rows)
            before, origins, directions = directions, np.empty((alive, 3)), np.empty((alive, 3))
            near, towards = np.empty((alive, 3), np.float32), np.empty((alive, 3), np.float32)
            self.compiled.reflect(
                rows, triangle, self.normals, before, points, generator.random((alive, 2)), self.caster.tolerance,
                self.caster.centre, self.caster.scale, origins, directions, near, towards,
            )  # fmt: skip
        return parts, cut
