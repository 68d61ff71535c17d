"""Pieces of surface in NumPy: nets of faces, boxes, turned and swept shapes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Surface:
    """Faces over vertices of their own. Each face counts its corners anticlockwise seen from its front.

    vertices  (V, 3) metres
    faces     (F, 3) or (F, 4) vertex indices
    material  slot of the object's materials: one for all faces, or (F,) one for each
    smooth    whether the faces are shaded smoothly
    """

    vertices: np.ndarray
    faces: np.ndarray
    material: int | np.ndarray = 0
    smooth: bool = False

    def of(self, material: int | np.ndarray = 0, smooth: bool = False) -> Surface:
        """The same faces with another material slot and shading."""
        return replace(self, material=material, smooth=smooth)

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Surface:
        """Shifted by metres."""
        return replace(self, vertices=self.vertices + np.array([x, y, z]))

    def turned(self, degrees: float, axis: str = "z") -> Surface:
        """Turned about an axis through the origin, anticlockwise seen from the axis' tip."""
        cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        first, second = {"x": (1, 2), "z": (0, 1)}[axis]
        vertices = self.vertices.copy()
        vertices[:, first] = cosine * self.vertices[:, first] - sine * self.vertices[:, second]
        vertices[:, second] = sine * self.vertices[:, first] + cosine * self.vertices[:, second]
        return replace(self, vertices=vertices)

    def flipped(self) -> Surface:
        """With front and back exchanged."""
        return replace(self, faces=self.faces[:, ::-1])

    def welded(self) -> Surface:
        """With vertices within a micrometre of each other made one."""
        _, first, inverse = np.unique(np.round(self.vertices, 6), axis=0, return_index=True, return_inverse=True)
        return replace(self, vertices=self.vertices[first], faces=inverse.reshape(-1)[self.faces])


def joined(surfaces: list[Surface]) -> Surface:
    """Surfaces of one shading, with equally many corners per face, as one."""
    starts = np.cumsum([0] + [len(s.vertices) for s in surfaces[:-1]])
    return Surface(
        np.concatenate([s.vertices for s in surfaces]),
        np.concatenate([s.faces + start for s, start in zip(surfaces, starts, strict=True)]),
        np.concatenate([np.broadcast_to(s.material, len(s.faces)) for s in surfaces]),
        surfaces[0].smooth,
    )


def net(points: np.ndarray, closed: bool = False) -> Surface:
    """Quads between neighbours of ``points`` (n, m, 3); the front is where first axis x second axis points.

    ``closed`` joins the last row of the first axis to the first one.
    """
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    following = np.roll(index, -1, axis=0) if closed else index[1:]
    index = index if closed else index[:-1]
    quads = np.stack([index[:, :-1], following[:, :-1], following[:, 1:], index[:, 1:]], axis=-1)
    return Surface(points.reshape(-1, 3), quads.reshape(-1, 4))


def steps(start: float, stop: float, cell: float) -> np.ndarray:
    """Evenly spaced numbers from start to stop, about ``cell`` apart."""
    return np.linspace(start, stop, max(1, round(abs(stop - start) / cell)) + 1)


def quad(corners, cell: float) -> Surface:
    """A four-sided patch (4, 3), anticlockwise from its front, diced into cells of about ``cell`` metres."""
    a, b, c, d = np.asarray(corners, float)
    u = steps(0.0, max(np.linalg.norm(b - a), np.linalg.norm(c - d)), cell)
    v = steps(0.0, max(np.linalg.norm(d - a), np.linalg.norm(c - b)), cell)
    u, v = (u / u[-1])[:, None, None], (v / v[-1])[None, :, None]
    return net((1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d)


def box(lower, upper, cell: float = 1e9, without: str = "") -> Surface:
    """An axis-aligned box with its front outside, diced; ``without`` names sides to leave out, such as "-z +x"."""
    (x0, y0, z0), (x1, y1, z1) = lower, upper
    sides = {
        "-x": [(x0, y1, z0), (x0, y0, z0), (x0, y0, z1), (x0, y1, z1)],
        "+x": [(x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1)],
        "-y": [(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)],
        "+y": [(x1, y1, z0), (x0, y1, z0), (x0, y1, z1), (x1, y1, z1)],
        "-z": [(x0, y1, z0), (x1, y1, z0), (x1, y0, z0), (x0, y0, z0)],
        "+z": [(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)],
    }
    return joined([quad(corners, cell) for side, corners in sides.items() if side not in without.split()])


def lathe(profile, sides: int, square: float | tuple = 0.0) -> Surface:
    """A profile of (radius, z) turned about the z axis; listed upwards, its front is outside.

    ``square`` (one number, or one for each point of the profile) goes from a circle at 0 to the square
    around that circle at 1; squares need a number of sides that is a multiple of 8.
    """
    profile = np.asarray(profile, float)
    angle = 2 * np.pi * np.arange(sides) / sides
    corner = 1 / np.maximum(np.abs(np.cos(angle)), np.abs(np.sin(angle)))
    square = np.broadcast_to(square, len(profile))
    radius = profile[:, 0] * (1 + square * (corner[:, None] - 1))
    z = np.broadcast_to(profile[:, 1], radius.shape)
    points = np.stack([radius * np.cos(angle)[:, None], radius * np.sin(angle)[:, None], z], axis=-1)
    return net(points, closed=True)


def ball(radius: float, across: int) -> Surface:
    """A closed sphere around the origin, of six patches of ``across`` by ``across`` quads."""
    cube = box((-1, -1, -1), (1, 1, 1), 2.0 / across).welded()
    directions = np.tan(0.25 * np.pi * cube.vertices)
    return replace(cube, vertices=radius * directions / np.linalg.norm(directions, axis=1)[:, None], smooth=True)


def frame(half_x: float, half_y: float, profile, cell: float) -> Surface:
    """A profile of (outwards, z) led around the rectangle (2 half_x, 2 half_y) with mitred corners.

    Listed upwards its front is outside, listed downwards inside.
    """
    x, y = steps(-half_x, half_x, cell)[:-1], steps(-half_y, half_y, cell)[:-1]
    loop = np.concatenate(
        [
            np.column_stack([x / half_x, np.full(len(x), -1.0)]),
            np.column_stack([np.ones(len(y)), y / half_y]),
            np.column_stack([-x / half_x, np.ones(len(x))]),
            np.column_stack([np.full(len(y), -1.0), -y / half_y]),
        ]
    )
    outwards, z = np.asarray(profile, float).T
    points = np.empty((len(loop), len(z), 3))
    points[..., 0] = loop[:, :1] * (half_x + outwards)
    points[..., 1] = loop[:, 1:] * (half_y + outwards)
    points[..., 2] = z
    return net(points, closed=True)


def tube(path: np.ndarray, radii: np.ndarray, sides: int) -> Surface:
    """A tube around ``path`` (n, 3), open at both ends; ``radii`` is (n,), or (n, sides) for other cross-sections."""
    tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    across = np.empty_like(path)
    across[0] = np.cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    for row in range(1, len(path)):  # carried along without twist
        across[row] = across[row - 1] - tangents[row] * (across[row - 1] @ tangents[row])
    across /= np.linalg.norm(across, axis=1)[:, None]
    up = np.cross(tangents, across)
    angle = (2 * np.pi * np.arange(sides) / sides)[:, None, None]
    radii = np.broadcast_to(np.asarray(radii, float).reshape(len(path), -1), (len(path), sides))
    return net(path + radii.T[..., None] * (np.cos(angle) * across + np.sin(angle) * up), closed=True)
