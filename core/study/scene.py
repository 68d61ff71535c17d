"""A real scene for the study: where its discs lie, and photon path segments that were traced in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bounds import Bounds
from ..discs import TangentDiscs
from ..segments import Segments
from .fields import mean_spacing


@dataclass(frozen=True)
class StudyScene:
    """What the study needs of a scene.

    name       shown in tables
    triangles  how many
    centres    (N, 3) metres and normals (N, 3) unit: the estimation points
    radius     metres, what a bake of quality "preview" takes
    segments   in the order they were traced
    """

    name: str
    triangles: int
    centres: np.ndarray
    normals: np.ndarray
    radius: float
    segments: Segments

    @property
    def spacing(self) -> float:
        """Distance between neighbouring points, metres."""
        return mean_spacing(self.centres)

    @property
    def around(self) -> float:
        """Radius of the sphere around all points and segments, r0 of Cauchy and Crofton, metres."""
        return Bounds.of(np.concatenate([self.centres, self.segments.origins, self.segments.ends])).radius

    def discs(self, radius: float) -> TangentDiscs:
        """Whole discs of that ``radius``, as in the study."""
        return TangentDiscs.of_radius(self.centres, self.normals, radius)
