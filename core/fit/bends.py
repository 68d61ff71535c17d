"""Where shown triangles meet along an edge: by how much the values there bend away from a plane."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..triangles import angles_between, normals_and_areas
from .shown_faces import ShownFaces

#: Two triangles whose far corners lie farther off the ends of their edge, as a share of its length, are slivers beside
#: each other, whose values say little of how light bends.
ASIDE = 0.5


@dataclass(frozen=True)
class Bends:
    """H pairs of triangles that share the values of an edge, and no other triangle does; ``count`` U values in all.

    values     (H, 4) those of the edge's ends, and of the far corner of either triangle
    weights    (H, 4) of these values in the bend: how far the line between the far corners, were both triangles in one
               plane, passes above the edge
    triangles  (H, 2)
    angles     (H,) radians, by which the surface bends there
    """

    values: np.ndarray
    weights: np.ndarray
    triangles: np.ndarray
    angles: np.ndarray
    count: int

    @classmethod
    def of(cls, faces: ShownFaces) -> Bends:
        """All of the ``faces``."""
        ends = np.roll(faces.values, -1, axis=1).ravel(), np.roll(faces.values, -2, axis=1).ravel()
        key = np.minimum(*ends).astype(np.int64) * faces.count + np.maximum(*ends)
        order = np.argsort(key, kind="stable")
        begin = np.flatnonzero(np.diff(key[order], prepend=-1))
        begin = begin[np.diff(begin, append=len(order)) == 2]
        pair = np.stack([order[begin], order[begin + 1]]) if len(begin) else np.zeros((2, 0), np.int64)
        triangles, corner = np.divmod(pair, 3)
        place = faces.corners[triangles, (corner + 1) % 3]
        # Seen from the first triangle, the edge runs from its next corner to the one after.
        start, edge = place[0], faces.corners[triangles[0], (corner[0] + 2) % 3] - place[0]
        length = np.sqrt(np.maximum(np.einsum("ij,ij->i", edge, edge), 1e-300))
        away = faces.corners[triangles, corner] - start
        along = np.einsum("nij,ij->ni", away, edge) / length**2
        height = np.sqrt(np.maximum(np.einsum("nij,nij->ni", away, away) - (along * length) ** 2, 0.0))
        far = height[::-1] / np.maximum(height.sum(axis=0), 1e-300)
        second = (far * along).sum(axis=0)
        values = np.stack([ends[0][pair[0]], ends[1][pair[0]], *faces.values[triangles, corner]], axis=1)
        weights = np.stack([second - 1.0, -second, *far], axis=1)
        apart = (values[:, 0] != values[:, 1]) & (values[:, 2] != values[:, 3])
        kept = np.flatnonzero(apart & (second > -ASIDE) & (second < 1.0 + ASIDE))
        triangles = triangles.T[kept]
        one, other = normals_and_areas(faces.corners)[0][triangles].swapaxes(0, 1)
        return cls(values[kept], weights[kept], triangles, angles_between(one, other), faces.count)

    def __len__(self) -> int:
        return len(self.values)

    @property
    def pairs(self) -> np.ndarray:
        """The values (6 H, 2) in the square of each bend, whose factors :meth:`products` gives."""
        return np.concatenate([self.values[:, list(pair)] for pair in combinations(range(4), 2)])

    def products(self, held: np.ndarray) -> np.ndarray:
        """Factors (6 H,) of :attr:`pairs` in the bends' squares that count ``held`` (H,) times."""
        return np.concatenate([held * self.weights[:, a] * self.weights[:, b] for a, b in combinations(range(4), 2)])

    def squares(self, held: np.ndarray) -> np.ndarray:
        """Factors (U,) of the squares of each value in these."""
        return self._added(held[:, None] * self.weights**2)

    def at(self, values: np.ndarray) -> np.ndarray:
        """The bends (H, ...) where the ``values`` are (U, ...)."""
        return np.einsum("hc,hc...->h...", self.weights, values.take(self.values, axis=0))

    def smoothed(self, squares: np.ndarray, rings: int) -> np.ndarray:
        """Means (H,) of the bends' ``squares`` (H,) over so many ``rings`` around each."""
        around = np.maximum(self._added(np.ones_like(self.weights)), 1.0)
        for _ in range(rings):
            squares = (self._added(np.repeat(squares, 4)) / around).take(self.values).mean(axis=1)
        return squares

    def _added(self, each: np.ndarray) -> np.ndarray:
        """Sums (U,) of what is given for ``each`` (H, 4) of the values."""
        return np.bincount(self.values.ravel(), each.ravel(), self.count)
