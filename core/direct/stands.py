"""Where the rays of points start, and which side of their faces they see."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..lights.lamp_rays import towards
from ..rows import Rows


@dataclass(frozen=True)
class Stands(Rows):
    """Of K points whose irradiance is wanted.

    points   (K, 3) metres, where it is wanted
    origins  (K, 3) metres, where rays start: beside the points, clear of surfaces
    facing   (K, 3) unit normals of the points' faces, before which light arrives; None where the points' normals are
    """

    points: np.ndarray
    origins: np.ndarray
    facing: np.ndarray | None = None

    @cached_property
    def aside(self) -> np.ndarray:
        """Metres (K,) from the points to where their rays start."""
        away = self.origins - self.points
        return np.sqrt(np.einsum("ij,ij->i", away, away))

    def before(self, spot: np.ndarray, directions: np.ndarray) -> np.ndarray | bool:
        """Whether (S,) unit ``directions`` (S, 3) lead from each ``spot`` (S,) to the front of its face."""
        if self.facing is None:
            return True
        return np.einsum("ij,ij->i", self.facing.take(spot, axis=0), directions) > 0

    def ways(self, spot: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit directions (S, 3) and distances (S,), metres, from where the rays of each ``spot`` (S,) start to
        ``places`` (S, 3) m."""
        return towards(places - self.origins.take(spot, axis=0))
