"""Tangent discs: where irradiance is estimated, and how wide around each point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .checks import fill, float_rows, unit_rows
from .errors import InvalidArrayError, InvalidSettingError
from .rows import Rows


@dataclass(frozen=True)
class TangentDiscs(Rows):
    """Discs tangent to the surface at the estimation points.

    centres  (N, 3) metres
    normals  (N, 3) unit; light counts that arrives against the normal
    radii    (N,)   metres

    Raises InvalidArrayError on other shapes or non-finite values, or a radius <= 0.
    """

    centres: np.ndarray
    normals: np.ndarray
    radii: np.ndarray

    def __post_init__(self):
        centres = float_rows(self.centres, "disc centres")
        normals = unit_rows(self.normals, "disc normals", len(centres))
        radii = float_rows(self.radii, "disc radii", None, len(centres))
        if (radii <= 0).any():
            raise InvalidArrayError("disc radii must be greater than zero.")
        fill(self, centres=centres, normals=normals, radii=radii)

    @classmethod
    def of_radius(cls, centres: np.ndarray, normals: np.ndarray, radius: float) -> TangentDiscs:
        """Discs that all have one ``radius`` in metres, as the study uses them.

        Raises InvalidSettingError when the radius is not a finite number above zero.
        """
        if not (np.isfinite(radius) and radius > 0):
            raise InvalidSettingError(f"The disc radius must be a finite number above 0 m, not {radius:g}.")
        return cls(centres, normals, np.full(len(centres), float(radius)))

    @property
    def extents(self) -> np.ndarray:
        """How far each disc reaches from its centre along the axes, (N, 3) in metres."""
        return self.radii[:, None] * np.sqrt(np.maximum(1.0 - self.normals**2, 0.0))

    @property
    def areas(self) -> np.ndarray:
        """Area (N,) of each disc in square metres."""
        return np.pi * self.radii**2
