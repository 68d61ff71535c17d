"""What two scenes, or two sets of points, have in common: rows that are the same in all numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights.light import Light
from ..points import Points
from ..scene import Scene


def same_rows(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """For each row of ``after`` (M, C) that row of ``before`` (N, C) which is the same (M,), -1 where none is.

    No row of ``before`` belongs to two: of rows that occur several times each has its own.
    """
    # Zeros of both signs are the same.
    both = np.ascontiguousarray(np.concatenate([before, after]) + 0.0)
    _, kind = np.unique(both.view(np.dtype((np.void, both.dtype.itemsize * both.shape[1])))[:, 0], return_inverse=True)
    kind = kind.reshape(-1)
    old, new = _numbered(kind[: len(before)]), _numbered(kind[len(before) :])
    order = np.lexsort(old[::-1])
    keys, wanted = _keys(old, len(both))[order], _keys(new, len(both))
    place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.where(keys[place] == wanted, order[place], -1)


def same_triangles(before: Scene, after: Scene) -> np.ndarray:
    """For each triangle of ``after`` the one of ``before`` that is the same in place and material (T,), or -1."""
    return same_rows(_triangle_rows(before), _triangle_rows(after))


def same_points(before: Points, after: Points) -> np.ndarray:
    """For each point of ``after`` the same one of ``before`` (N,), or -1."""
    return same_rows(_point_rows(before), _point_rows(after))


def same_lights(before: Sequence[Light], after: Sequence[Light]) -> bool:
    """Whether these are equal lights in an equal order."""
    return len(before) == len(after) and all(map(_same, before, after))


def _same(one: object, other: object) -> bool:
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    if not hasattr(one, "__dict__"):
        return one == other
    # Which row of the scene a shining triangle is says nothing about it.
    names = [name for name in vars(one) if name != "rows" and not name.startswith("_")]
    return all(_same(getattr(one, name), getattr(other, name)) for name in names)


def _numbered(kind: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each row's ``kind`` (N,), and the how manieth of its kind it is (N,)."""
    order = np.argsort(kind, kind="stable")
    ordered = kind[order]
    begin = np.flatnonzero(np.diff(ordered, prepend=-1))
    count = np.empty(len(kind), np.int64)
    count[order] = np.arange(len(kind)) - np.repeat(begin, np.diff(np.append(begin, len(kind))))
    return kind, count


def _keys(numbered: tuple[np.ndarray, np.ndarray], most: int) -> np.ndarray:
    return numbered[0] * np.int64(most + 1) + numbered[1]


def _triangle_rows(scene: Scene) -> np.ndarray:
    count = len(scene.triangles)
    columns = [scene.corners.reshape(count, 9)]
    for name in ("albedo", "emission", "transmittance", "unshaded", "translucency"):
        value = getattr(scene, name)
        if value is None:
            value = scene.transmittance if name == "unshaded" else np.zeros((count, 3))
        columns += list(np.broadcast_to(value, (2, count, 3)))
    turning = np.zeros((count, 20))
    if scene.specular is not None:
        surface = scene.specular
        rows = np.arange(1, len(surface.triangles) + 1)[:, None] > 0
        parts = (surface.mirror, surface.gloss, surface.clear, surface.ior[:, None], surface.roughness[:, None])
        normals = surface.normals.reshape(-1, 9)
        turning[surface.triangles] = np.concatenate([rows * normals, *parts], axis=1)
    return np.concatenate([*columns, turning], axis=1)


def _point_rows(points: Points) -> np.ndarray:
    inward = np.zeros_like(points.centres) if points.inward is None else points.inward
    return np.concatenate([points.centres, points.normals, inward, points.facing], axis=1)
