"""What the study assumes: uniform lines through a ball, and points that fill it or lie on surfaces in it."""

from __future__ import annotations

import numpy as np

from ..discs import TangentDiscs
from ..segments import Segments

#: where points may lie, and the dimension that makes for the theory
KINDS = {"volume": 3.0, "surface": 2.0}
#: how far lines go on behind the unit ball
BEYOND = 0.3


def uniform_lines(count: int, generator: np.random.Generator) -> Segments:
    """Lines through the unit ball: uniform directions, uniform over the disc that the ball shows to each.

    They end BEYOND the ball's surface, or discs tangent to it would not be crossed.
    """
    direction = unit(generator.normal(size=(count, 3)))
    side = unit(np.cross(direction, generator.normal(size=(count, 3))))
    away = np.sqrt(generator.random(count))
    half = (np.sqrt(1.0 - away**2) + BEYOND)[:, None] * direction
    middle = away[:, None] * side
    return Segments.between(middle - half, middle + half)


def uniform_points(kind: str, count: int, generator: np.random.Generator) -> np.ndarray:
    """``count`` points (N, 3) in the unit ball ("volume") or on its surface ("surface")."""
    points = unit(generator.normal(size=(count, 3)))
    return points * generator.random((count, 1)) ** (1.0 / 3.0) if kind == "volume" else points


def spacing(kind: str, count: int) -> float:
    """Distance between neighbours of :func:`uniform_points`: (volume / n)^(1/3) or (area / n)^(1/2)."""
    return (4.0 / 3.0 * np.pi / count) ** (1.0 / 3.0) if kind == "volume" else (4.0 * np.pi / count) ** 0.5


def uniform_discs(kind: str, count: int, radius: float, generator: np.random.Generator) -> TangentDiscs:
    """Discs of one ``radius`` around such points, normals in all directions in the volume and inward on the surface."""
    points = uniform_points(kind, count, generator)
    normals = -points if kind == "surface" else generator.normal(size=points.shape)
    return TangentDiscs.of_radius(points, unit(normals), radius)


def unit(rows: np.ndarray) -> np.ndarray:
    """``rows`` (N, 3) at length one."""
    return rows / np.linalg.norm(rows, axis=1)[:, None]
