"""The triangles over which values at vertices are shown, and places drawn on them at which to look for light."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..random_streams import random_stream
from ..sampling import LATTICE
from ..sampling import triangle as barycentric
from ..triangles import normals_and_areas

#: Places beyond one for each value: so many for each value, and at least so many, all in proportion to area.
MORE, LEAST_MORE = 0.75, 1 << 12


def more_places(values: int) -> float:
    """How many places there are beyond one for each of so many ``values``."""
    return max(MORE * values, LEAST_MORE)


@dataclass(frozen=True)
class ShownFaces:
    """T triangles that show U values, each interpolated linearly between three of them.

    values   (T, 3) which of the U values each corner shows
    corners  (T, 3, 3) metres; normals (T, 3, 3) unit shading normals there
    count    U
    beside   (P, 2) values that lie at one place, on faces between which the surface bends by ``angles`` (P,) radians
    """

    values: np.ndarray
    corners: np.ndarray
    normals: np.ndarray
    count: int
    beside: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    angles: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def areas(self) -> np.ndarray:
        """Areas (T,) in m^2."""
        return normals_and_areas(self.corners)[1]

    @cached_property
    def around(self) -> np.ndarray:
        """A third (U,) m^2 of the areas of all triangles that show each value."""
        return np.bincount(self.values.ravel(), np.repeat(self.areas / 3.0, 3), self.count)

    def short_edges(self, share: float) -> tuple[np.ndarray, np.ndarray]:
        """Pairs (Q, 2) of values at the ends of edges that are shorter than this ``share`` of the size of the faces
        around both; and by how much (Q,) light may differ there: their length as such a share, and the angle between
        the normals in radians.
        """
        ends = self.values[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        differ, turn = ((part - np.roll(part, -1, axis=1)).reshape(-1, 3) for part in (self.corners, self.normals))
        squares = np.einsum("ij,ij->i", differ, differ) / np.maximum(self.around[ends].min(axis=1), 1e-300)
        rows = np.flatnonzero((squares < share**2) & (ends[:, 0] != ends[:, 1]))
        _, once = np.unique(np.sort(ends[rows], axis=1), axis=0, return_index=True)
        rows = rows[once]
        return ends[rows], np.sqrt(squares[rows] + np.einsum("ij,ij->i", turn[rows], turn[rows]))

    def of_values(self, used: np.ndarray) -> tuple[ShownFaces, np.ndarray]:
        """The triangles (S,) that show values which are ``used`` (U,), as rows of these; values are counted anew."""
        kept = np.flatnonzero(used[self.values].all(axis=1))
        numbers = np.cumsum(used) - 1
        some = numbers[self.values[kept]], self.corners[kept], self.normals[kept]
        pairs = np.flatnonzero(used[self.beside].all(axis=1))
        return ShownFaces(*some, int(used.sum()), numbers[self.beside[pairs]], self.angles[pairs]), kept

    @property
    def density(self) -> float:
        """Places a square metre beyond one for each value."""
        return more_places(self.count) / max(self.areas.sum(), 1e-300)

    def drawn(self, seed: int, density: float | None = None) -> FacePlaces:
        """Places on the triangles: one near the vertices of each value, and more in proportion to area, of that
        ``density`` a square metre, None for the usual one."""
        generator = random_stream(seed, "places")
        near, corner, share = self._one_for_each(generator)
        uniforms = generator.random((len(near), 2))
        weights = barycentric(uniforms)
        # The part of a triangle that is nearer to this corner than to the others, by barycentric coordinates.
        turns = (np.arange(3) - (corner - weights.argmax(axis=1))[:, None]) % 3
        weights = np.take_along_axis(weights, turns, axis=1)
        more = (self.density if density is None else density) * self.areas
        ends = np.floor(np.cumsum(more) + generator.random()).astype(np.int64)
        triangle = np.repeat(np.arange(len(more)), np.diff(ends, prepend=0))
        shift = generator.random((len(more), 2))[triangle]
        spread = barycentric((np.arange(len(triangle))[:, None] * LATTICE + shift) % 1.0)
        triangle, weights = np.concatenate([near, triangle]), np.concatenate([weights, spread])
        return FacePlaces(triangle, weights, (self.areas / np.maximum(share + more, 1e-300))[triangle], share + more)

    def _one_for_each(self, generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """For each value that is shown one of its triangles, by area, and its corner there; and how many places each
        triangle (T,) gets in the mean.
        """
        values, areas = self.values.ravel(), np.repeat(np.maximum(self.areas, 1e-300), 3)
        order = np.argsort(values, kind="stable")
        sums = np.cumsum(areas[order])
        total = np.bincount(values, areas, self.count)
        shown = np.flatnonzero(total > 0)
        ends = np.searchsorted(values[order], shown, side="right")
        before = np.append(0.0, sums)[np.searchsorted(values[order], shown)]
        drawn = np.searchsorted(sums, before + generator.random(len(shown)) * (sums[ends - 1] - before), side="right")
        chosen = order[np.minimum(drawn, ends - 1)]
        share = (areas / total[values]).reshape(-1, 3).sum(axis=1)
        return chosen // 3, chosen % 3, share


@dataclass(frozen=True)
class FacePlaces:
    """K places on triangles.

    triangle  (K,)
    weights   (K, 3) barycentric coordinates
    area      (K,) m^2 that each stands for
    expected  (T,) how many there are in the mean on each triangle
    """

    triangle: np.ndarray
    weights: np.ndarray
    area: np.ndarray
    expected: np.ndarray

    def on(self, kept: np.ndarray) -> tuple[FacePlaces, np.ndarray]:
        """The places on the triangles ``kept`` (S,), by their rows there; and which of these (L,) they are."""
        number = np.full(max(self.triangle.max(initial=-1), kept.max(initial=-1)) + 1, -1)
        number[kept] = np.arange(len(kept))
        rows = np.flatnonzero(number[self.triangle] >= 0)
        return FacePlaces(number[self.triangle[rows]], self.weights[rows], self.area[rows], self.expected[kept]), rows

    def of(self, corners: np.ndarray) -> np.ndarray:
        """What (K, d) is there of what is given at the ``corners`` (T, 3, d) of all triangles."""
        return np.einsum("kc,kcd->kd", self.weights, corners[self.triangle])
