"""Where light is wanted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .checks import fill, float_rows, unit_rows
from .errors import NoMeshError

#: Components of normals that differ by less are the same.
SAME = 1e-5

#: Components of a unit normal smaller than this count as none: 26 directions that surfaces face.
_SLANT = 0.38


@dataclass(frozen=True)
class Points:
    """N places on surfaces at which light is wanted, N > 0.

    centres  (N, 3) metres
    normals  (N, 3) unit, that the surface is shaded by
    inward   (N, 3) metres, from a point on the edge of its face into the face; None where all lie inside
    facing   (N, 3) unit normals of the faces, in front of which rays start and light arrives; None: as ``normals``

    Raises NoMeshError without points, InvalidArrayError on anything else that is not as above.
    """

    centres: np.ndarray
    normals: np.ndarray
    inward: np.ndarray | None = None
    facing: np.ndarray | None = None

    def __post_init__(self):
        if len(self.centres) == 0:
            raise NoMeshError("There is no vertex to bake: choose at least one mesh with faces.")
        centres = float_rows(self.centres, "points")
        normals = unit_rows(self.normals, "normals of points", len(centres))
        inward = None if self.inward is None else float_rows(self.inward, "ways inward", 3, len(centres))
        facing = normals if self.facing is None else unit_rows(self.facing, "normals of faces", len(centres))
        fill(self, centres=centres, normals=normals, inward=inward, facing=facing)

    def __len__(self) -> int:
        return len(self.centres)

    @property
    def flat(self) -> bool:
        """Whether all are shaded by the normals of their faces."""
        return np.allclose(self.facing, self.normals, 0, SAME)


def facings(normals: np.ndarray) -> np.ndarray:
    """Number (K,), 0...26, of the direction that surfaces with unit ``normals`` (K, 3) face, to about 25 degrees."""
    steps = (normals > _SLANT).astype(np.int64) - (normals < -_SLANT) + 1
    return (steps[:, 0] * 3 + steps[:, 1]) * 3 + steps[:, 2]
