"""What the study assumes: uniform lines through a ball, and points that fill it or lie on surfaces in it.

And what it needs of scenes, such as how far apart their points lie, in which it counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bounds import Bounds
from ..discs import TangentDiscs
from ..segments import Segments
from ..space_filling import BITS, cube_side, morton_codes

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


def mean_spacing(points: np.ndarray) -> float:
    """How far apart neighbours of ``points`` (N, 3) lie on average, in metres; 0 when all are in one place.

    That is the side of the cubes that hold two of the points each on average, over the side that points
    strewn with one per unit of area need for it. For thousands of points on surfaces it is within a fifth
    of sqrt(area / N). Points in the same place count as one: the corners of a mesh's faces share theirs.
    """
    # Sorted first: np.unique may go by hashes, which takes twenty times as long.
    codes = np.sort(morton_codes(points))
    codes = codes[np.diff(codes, prepend=codes[:1] + np.uint64(1)) != 0]
    if len(codes) < 2:
        return 0.0
    # Mean number in a cube, which doubles its side from one entry to the next.
    held, cubes = [1.0], codes
    while held[-1] < 2.0:
        cubes = cubes >> np.uint64(3)
        cubes = cubes[np.diff(cubes, prepend=cubes[:1] + np.uint64(1)) != 0]
        held.append(len(codes) / len(cubes))
    doublings = np.interp(np.log(2.0), np.log(held), np.arange(float(len(held))))
    return float(cube_side(points) * 2.0 ** (doublings - BITS) / 1.3)


def uniform_discs(kind: str, count: int, radius: float, generator: np.random.Generator) -> TangentDiscs:
    """Discs of one ``radius`` around such points, normals in all directions in the volume and inward on the surface."""
    points = uniform_points(kind, count, generator)
    normals = -points if kind == "surface" else generator.normal(size=points.shape)
    return TangentDiscs.of_radius(points, unit(normals), radius)


def unit(rows: np.ndarray) -> np.ndarray:
    """``rows`` (N, 3) at length one."""
    return rows / np.linalg.norm(rows, axis=1)[:, None]


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
