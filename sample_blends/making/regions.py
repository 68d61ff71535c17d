"""Flat ground around the things that stand on it, so that no vertex hides underneath them."""

from __future__ import annotations

import numpy as np
from mathutils import Vector
from mathutils.geometry import delaunay_2d_cdt

from .surfaces import Surface, steps


def region(outline, holes=(), cell: float = 0.2) -> Surface:
    """The floor z = 0 inside ``outline`` (n, 2) and outside each of ``holes``, in near-equilateral triangles.

    Outlines are polygons in metres; their edges are divided into about ``cell`` metres too.
    """
    loops = [_divided(np.asarray(loop, float), cell) for loop in (outline, *holes)]
    border = np.concatenate(loops)
    lattice = _lattice(border.min(axis=0), border.max(axis=0), cell)
    lattice = lattice[_inside(lattice, loops)]
    distance = np.concatenate(
        [np.linalg.norm(part[:, None] - border[None], axis=2).min(axis=1) for part in np.array_split(lattice, 64)]
    )
    points = np.concatenate([border, lattice[distance > 0.6 * cell]])
    starts = np.cumsum([0] + [len(loop) for loop in loops])
    edges = [
        (start + k, start + (k + 1) % len(loop))
        for start, loop in zip(starts, loops, strict=False)
        for k in range(len(loop))
    ]
    found, _, faces, *_ = delaunay_2d_cdt([Vector(p) for p in points], edges, [], 0, 1e-7, False)
    found, faces = np.array(found), np.array(faces)
    corners = found[faces]
    (ux, uy), (vx, vy) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    flat = np.abs(ux * vy - uy * vx) < 1e-3 * cell**2  # slivers along edges that rounding made a little concave
    faces = faces[_inside(corners.mean(axis=1), loops) & ~flat]
    used, renumbered = np.unique(faces, return_inverse=True)
    return Surface(np.column_stack([found[used], np.zeros(len(used))]), renumbered.reshape(faces.shape))


def circle(radius: float, sides: int, x: float = 0.0, y: float = 0.0) -> np.ndarray:
    """Corners (sides, 2) of a regular polygon."""
    angle = 2 * np.pi * np.arange(sides) / sides
    return np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)])


def rectangle(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    """Corners (4, 2) of an axis-aligned rectangle."""
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], float)


def _divided(loop: np.ndarray, cell: float) -> np.ndarray:
    parts = []
    for start, end in zip(loop, np.roll(loop, -1, axis=0), strict=True):
        length = np.linalg.norm(end - start)
        parts.append(start + (end - start) * (steps(0.0, length, cell)[:-1, None] / length))
    return np.concatenate(parts)


def _lattice(lower: np.ndarray, upper: np.ndarray, cell: float) -> np.ndarray:
    row_height = cell * np.sqrt(0.75)
    rows = np.arange(lower[1], upper[1], row_height)
    columns = np.arange(lower[0], upper[0] + cell, cell)
    x = columns[None] + 0.5 * cell * (np.arange(len(rows)) % 2)[:, None]
    return np.column_stack([x.ravel(), np.repeat(rows, len(columns))])


def _inside(points: np.ndarray, loops: list[np.ndarray]) -> np.ndarray:
    """Even-odd rule: inside the outline and outside the holes."""
    crossings = np.zeros(len(points), int)
    for loop in loops:
        for (x0, y0), (x1, y1) in zip(loop, np.roll(loop, -1, axis=0), strict=True):
            if y0 != y1:
                spans = (y0 > points[:, 1]) != (y1 > points[:, 1])
                crossings += spans & (points[:, 0] < x0 + (points[:, 1] - y0) * (x1 - x0) / (y1 - y0))
    return crossings % 2 == 1
