"""Axis-aligned boxes: the convex set into which distant lights shoot and which segments leave."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .checks import float_rows


@dataclass(frozen=True)
class Bounds:
    """An axis-aligned box. ``lower`` and ``upper`` are (3,) in metres, lower <= upper."""

    lower: np.ndarray
    upper: np.ndarray

    @classmethod
    def of(cls, points: np.ndarray) -> Bounds:
        """The smallest box around ``points`` (N, 3), N >= 1."""
        points = float_rows(points, "points")
        return cls(points.min(axis=0), points.max(axis=0))

    @property
    def centre(self) -> np.ndarray:
        """The middle (3,), in metres."""
        return self.lower + 0.5 * (self.upper - self.lower)

    @property
    def size(self) -> np.ndarray:
        """The edge lengths (3,), in metres."""
        return self.upper - self.lower

    @property
    def radius(self) -> float:
        """Radius of the sphere around :attr:`centre` that holds the box, in metres."""
        return 0.5 * float(np.linalg.norm(self.size))

    @property
    def face_areas(self) -> np.ndarray:
        """Area (3,) of one face perpendicular to each axis, in square metres."""
        x, y, z = self.size
        return np.array([y * z, z * x, x * y])

    def expanded(self, margin: float) -> Bounds:
        """This box grown by ``margin`` metres on every side."""
        return Bounds(self.lower - margin, self.upper + margin)
