"""Points that look at lights, with a frame each in which directions are compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..rows import Rows
from ..sampling import combined, disc, frames, hemisphere_uniforms

#: A group's common direction this close to a normal makes no frame with it.
_ALONG = 0.1


@dataclass(frozen=True)
class Spots(Rows):
    """K points from which light is looked for.

    points, normals  (K, 3) m, and unit vectors
    first, second    (K, 3) unit vectors that make a right-handed frame with each normal, much alike within a group
    group            (K,) int64, which of the groups that are worked on together, from 0
    facing           (K, 3) unit normals of the faces, before which light arrives; None where the normals are
    """

    points: np.ndarray
    normals: np.ndarray
    first: np.ndarray
    second: np.ndarray
    group: np.ndarray
    facing: np.ndarray | None = None

    @classmethod
    def of(cls, points: np.ndarray, normals: np.ndarray, group: np.ndarray, facing: np.ndarray | None = None) -> Spots:
        """With ``group`` (K,) ascending, where every number from 0 to the last occurs."""
        begin = np.flatnonzero(np.diff(group, prepend=-1))
        mean = np.add.reduceat(normals, begin, axis=0)
        lengths = np.linalg.norm(mean, axis=1, keepdims=True)
        mean = np.where(lengths > _ALONG, mean / np.maximum(lengths, _ALONG), normals[begin])
        common = frames(mean)[0][group]
        first = common - np.einsum("ij,ij->i", common, normals)[:, None] * normals
        length = np.linalg.norm(first, axis=1)
        first = np.where((length > _ALONG)[:, None], first / np.maximum(length, _ALONG)[:, None], frames(normals)[0])
        return cls(points, normals, first, np.cross(normals, first), group, facing)

    def before(self, directions: np.ndarray) -> np.ndarray | bool:
        """Whether (K,) unit ``directions`` (K, 3) lead to the front of each point's face."""
        return True if self.facing is None else np.einsum("ij,ij->i", self.facing, directions) > 0

    def directions(self, uniforms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Directions (K, 3), cosine-distributed by ``uniforms`` (K, 2), and their cosines (K,) > 0."""
        flat = disc(uniforms)
        cosine = np.sqrt(np.maximum(1.0 - flat[:, 0] ** 2 - flat[:, 1] ** 2, np.finfo(float).tiny))
        return combined(flat, cosine, self.first, self.second, self.normals), cosine

    def uniforms(self, directions: np.ndarray) -> np.ndarray:
        """The uniforms (K, 2) that :meth:`directions` makes these ``directions`` (K, 3) from."""
        across = np.einsum("ij,ij->i", self.first, directions)
        along = np.einsum("ij,ij->i", self.second, directions)
        return hemisphere_uniforms(np.stack([across, along], axis=1))
