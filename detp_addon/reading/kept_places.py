"""Places that stay where they were on faces: what updates a bake looks for light where the bake did."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.fit.shown_faces import FacePlaces, ShownFaces
from .face_places import SEED, PlacedFaces

#: an object by its name and library
Name = tuple[str, str | None]


@dataclass(frozen=True)
class KeptPlaces:
    """The places on the faces of objects with these ``names``, of which each triangle has one of the ``owners`` (T,).

    values   (T, 3) that the triangles showed
    density  of the places, a square metre
    """

    names: tuple[Name, ...]
    owners: np.ndarray
    values: np.ndarray
    places: FacePlaces
    density: float

    @classmethod
    def of(cls, names: Sequence[Name], shown: PlacedFaces) -> KeptPlaces:
        """Those of objects with ``names`` as they are ``shown``."""
        faces = shown.faces
        return cls(tuple(names), shown.owners, faces.values, shown.places, faces.density)

    def drawn(self, names: Sequence[Name], faces: ShownFaces, owners: np.ndarray) -> FacePlaces:
        """Places on ``faces`` of objects with ``names``, to which the ``owners`` (T,) belong.

        Where an object's triangles show the values that they showed, wherever it stands and however it is bent, their
        places are the same parts of them. Elsewhere there are new ones.
        """
        row, count = np.full(len(self.values), -1), len(faces.values)
        mine = dict(zip(self.names, _parts(self.owners, len(self.names)), strict=True))
        for name, part in zip(names, _parts(owners, len(names)), strict=True):
            old = mine.get(name, slice(0, 0))
            if np.array_equal(_from_zero(self.values[old]), _from_zero(faces.values[part])):
                row[old] = np.arange(part.start, part.stop)
        old = np.flatnonzero(row >= 0)
        kept, at = self.places.on(old)[0], row[old]
        triangle, weights, expected = at[kept.triangle], kept.weights, np.zeros(count)
        expected[at] = kept.expected
        others = np.ones(count, bool)
        others[at] = False
        if others.any():
            used = np.zeros(faces.count, bool)
            used[faces.values[others]] = True
            some, at = faces.of_values(used)
            fresh = some.drawn(SEED, self.density)
            triangle = np.concatenate([triangle, at[fresh.triangle]])
            weights = np.concatenate([weights, fresh.weights])
            expected[at] = fresh.expected
        return FacePlaces(triangle, weights, (faces.areas / np.maximum(expected, 1e-300))[triangle], expected)


def _parts(owners: np.ndarray, count: int) -> Iterator[slice]:
    """The triangles of each of ``count`` objects, whose numbers ``owners`` (T,) ascend."""
    ends = np.searchsorted(owners, np.arange(count + 1)).tolist()
    return map(slice, ends[:-1], ends[1:])


def _from_zero(values: np.ndarray) -> np.ndarray:
    """An object's values counted from its first one."""
    return values - values.min() if len(values) else values
