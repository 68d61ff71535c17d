"""Looking for light all around, by compiled kernels: the same as looks_by_numpy.py, to rounding."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..compiled import kernels
from ..lights.light import Surroundings
from ..rays import FAR
from .direction_guide import Sightings
from .looks import Look
from .shadows import Shadows
from .surfaces import Met
from .surrounding_tables import table_of

_NOTHING, _NO_COORDINATES = np.empty(0), np.empty((2, 0), np.float32)


class LooksByKernels:
    """Looks for ``lights``, which only surfaces within ``reach`` metres shade; ``able`` when it can."""

    def __init__(self, lights: Sequence[Surroundings], shadows: Shadows, reach: float):
        self._shadows, self._reach = shadows, reach
        self._tables = {id(light): table_of(light, shadows.edged) for light in lights}
        self._distant = all(light.distant for light in lights)
        self.able = all(table is not None for table in self._tables.values())

    def aimed(self, light: Surroundings, look: Look, uniforms: np.ndarray) -> None:
        """Add what rays chosen by ``light`` bring."""
        compiled, most = kernels(), len(uniforms)
        chosen = np.empty((most, 3)), np.empty(most), np.empty((most, 3)), np.empty(most)
        self._tables[id(light)].aim(compiled, look, uniforms, chosen)
        arriving, weight, whole = np.empty((most, 3)), np.empty(most), np.empty(most)
        rows, cell = np.empty((2, most), np.int64)
        (near, towards), reach = np.empty((2, most, 3), np.float32), np.empty(most, np.float32)
        learnt = _NOTHING if look.guide is None else look.guide.density
        found = compiled.weigh_aimed(
            *_of(look), *chosen, learnt, *self._shadows.frame,
            rows, arriving, weight, whole, cell, near, towards, reach,
        )  # fmt: skip
        if found == 0:
            return
        rows, arriving, weight, whole, cell = (part[:found] for part in (rows, arriving, weight, whole, cell))
        blocked = self._shadows.block(compiled, near[:found], towards[:found], reach[:found], arriving)
        arriving[blocked] = 0.0
        look.found[rows] += arriving
        if look.seen is not None:
            light = np.abs(arriving) @ np.ones(3) / whole
            look.seen.append(Sightings(look.row[rows], cell, light, weight, whole))

    def by_chance(self, look: Look, uniforms: np.ndarray) -> None:
        """Add what rays along the cosine bring, or where the guide moves them."""
        compiled, most = kernels(), len(uniforms)
        guide = (_NOTHING,) * 3 if look.guide is None else (look.guide.density, look.guide.rows, look.guide.columns)
        directions, cosine, factor, cell = np.empty((most, 3)), np.empty(most), np.empty(most), np.empty(most, np.int64)
        near, towards = np.empty((2, most, 3), np.float32)
        centre, scale, _ = self._shadows.frame
        compiled.look_by_chance(
            *_of(look), uniforms, *guide, centre, scale, directions, cosine, factor, cell, near, towards
        )
        plain, densities = np.zeros((2, most))
        for rows, met, share in self._met(compiled, near, towards):
            radiance, density = np.empty((len(rows), 3)), np.empty(len(rows))
            for table in self._tables.values():
                table.meet(compiled, look, directions, rows, met, radiance, density)
                compiled.weigh_met(rows, share, radiance, density, cosine, factor, look.found, plain, densities)
        if look.seen is not None:
            chance = cosine / np.pi
            sent = densities + chance * factor
            look.seen.append(Sightings(look.row, cell, plain, chance / sent, (densities + chance) / sent))

    def _met(self, compiled, near, towards) -> Iterator[tuple[np.ndarray, Met, np.ndarray]]:
        """Rows (A,) of rays, what they met, and the share (A, 3) of the light from there that comes through."""
        _, scale, short = self._shadows.frame
        whole = (self._reach - short) * scale if self._distant else self._reach * scale
        reach = np.full(len(near), min(whole, FAR), np.float32)
        if not self._distant:
            yield from self._shadows.surfaces.walk(compiled, near, towards, reach)
            return
        share = np.ones((len(near), 3))
        rows = np.flatnonzero(~self._shadows.block(compiled, near, towards, reach, share))
        yield rows, Met(np.full(len(rows), -1, np.int32), *_NO_COORDINATES), share.take(rows, axis=0)


def _of(look: Look) -> tuple:
    spots = look.spots
    return spots.points, spots.normals, spots.first, spots.second, spots.group, look.spot, look.count
