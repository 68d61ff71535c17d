"""Faces that cannot show the light that falls on them, since their vertices are too few."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

#: Faces that show more than this share of their light wrong are named, and those beyond the second one can be divided.
WRONG, DIVIDED = 0.25, 0.05

#: Faces of objects by names: Blender's own objects may go.
FacesByObject = dict[tuple[str, str | None], np.ndarray]


@dataclass(frozen=True)
class LossyFaces:
    """F faces of objects, those first that show most light wrong.

    objects  names and libraries (None for the file's own); owners (F,) and faces (F,): the rows there, and of the mesh
    shares   (F,) of the light that is wrong on each, beyond noise
    whole    the share of all faces together; NaN where nobody looked
    """

    objects: tuple[tuple[str, str | None], ...] = ()
    owners: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    faces: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    shares: np.ndarray = field(default_factory=lambda: np.zeros(0))
    whole: float = float("nan")

    @classmethod
    def of(cls, objects, owners, faces, shares: np.ndarray, areas: np.ndarray) -> LossyFaces:
        """Those of all faces, with ``areas`` (F,), that show too much wrong to let it be."""
        total = areas.sum()
        rows = np.flatnonzero(shares > DIVIDED)
        rows = rows[np.argsort(-(shares * areas)[rows], kind="stable")]
        whole = float(shares @ areas / total) if total > 0 else float("nan")
        return cls(tuple(objects), owners[rows], faces[rows], shares[rows], whole)

    def by_object(self, most: int | None = None, beyond: float = DIVIDED) -> FacesByObject:
        """The first ``most`` (None for all) of those that show more than a share ``beyond`` wrong."""
        rows = np.flatnonzero(self.shares > beyond)[:most]
        rows = rows[np.argsort(self.owners[rows], kind="stable")]
        owners, starts = np.unique(self.owners[rows], return_index=True)
        parts = np.split(self.faces[rows], starts[1:])
        return {self.objects[owner]: part for owner, part in zip(owners, parts, strict=False)}

    @property
    def wrong(self) -> FacesByObject:
        """Those that are named."""
        return self.by_object(None, WRONG)
