"""Faces that cannot show the light that falls on them, since their vertices are too few."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np

from ...core.fit.vertex_fit import FaceLosses

#: Faces that show more than this share of their light wrong are named, and those beyond the second one can be divided,
#: and are named where there are no others: a spot in the sun is a small part of a large floor.
WRONG, DIVIDED = 0.25, 0.05

#: Faces of objects by names: Blender's own objects may go.
FacesByObject = dict[tuple[str, str | None], np.ndarray]


@dataclass(frozen=True)
class LossyFaces:
    """F faces of objects, those first that show most light wrong.

    objects  names and libraries (None for the file's own); owners (F,) and faces (F,): the rows there, and of the mesh
    shares   (F,) of the light that is wrong on each, beyond noise
    whole    the same of all faces together, where a spot hundreds of times brighter counts little more than the usual
             light does; NaN where nobody looked
    """

    objects: tuple[tuple[str, str | None], ...] = ()
    owners: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    faces: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    shares: np.ndarray = field(default_factory=lambda: np.zeros(0))
    whole: float = float("nan")

    @classmethod
    def of(cls, objects, owners, faces, losses: FaceLosses) -> LossyFaces:
        """Those of all faces (F), with their ``losses``, that show too much wrong to let it be."""
        shares, seen = losses.share, losses.area * losses.bright
        rows = np.flatnonzero(shares > DIVIDED)
        rows = rows[np.argsort(-(shares * seen)[rows], kind="stable")]
        whole = float(shares @ seen / seen.sum()) if seen.any() else float("nan")
        return cls(tuple(objects), owners[rows], faces[rows], shares[rows], whole)

    def of_objects(self, kept: Collection[tuple[str, str | None]]) -> LossyFaces:
        """Those of the objects ``kept``."""
        rows = np.array([key in kept for key in self.objects], bool)[self.owners]
        return replace(self, owners=self.owners[rows], faces=self.faces[rows], shares=self.shares[rows])

    def by_object(self, most: int | None = None, beyond: float = DIVIDED) -> FacesByObject:
        """The first ``most`` (None for all) of those that show more than a share ``beyond`` wrong."""
        rows = np.flatnonzero(self.shares > beyond)[:most]
        rows = rows[np.argsort(self.owners[rows], kind="stable")]
        owners, starts = np.unique(self.owners[rows], return_index=True)
        parts = np.split(self.faces[rows], starts[1:])
        return {self.objects[owner]: part for owner, part in zip(owners, parts, strict=False)}

    @property
    def limit(self) -> float:
        """The share of wrong light beyond which faces are named: the usual one, or the lower one if none is beyond."""
        return WRONG if (self.shares > WRONG).any() else DIVIDED

    @property
    def wrong(self) -> FacesByObject:
        """Those that are named."""
        return self.by_object(None, self.limit)
