"""What two scenes, or two sets of points, have in common: rows that are the same in all numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from ..hashing import mixed
from ..lights.light import Light
from ..points import Points
from ..scene import Scene

#: What the strength of a light is called, one of these, and the share by which rounding may change it.
STRENGTHS, ROUNDING = ("power", "irradiance", "radiance"), 1e-6


def same_rows(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """For each row of ``after`` (M, C) that row of ``before`` (N, C) which is the same (M,), -1 where none is.

    No row of ``before`` belongs to two: of rows that occur several times each has its own.
    """
    # Most stand where they stood, and only the others need to be looked for.
    both = min(len(before), len(after))
    kept = (before[:both] == after[:both]).all(axis=1)
    old, new = (np.append(np.flatnonzero(~kept), np.arange(both, len(rows))) for rows in (before, after))
    found = _same_anywhere(before[old], after[new]) if len(old) and len(new) else np.full(len(new), -1)
    same = np.arange(len(after))
    same[new] = np.where(found >= 0, np.append(old, -1)[found], -1)
    return same


def _same_anywhere(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """As :func:`same_rows`, wherever the rows stand."""
    # Zeros of both signs are the same.
    before, after = (np.ascontiguousarray(rows + 0.0) for rows in (before, after))
    kind = np.unique(np.concatenate([mixed(before), mixed(after)]), return_inverse=True)[1]
    old, new = _numbered(kind[: len(before)]), _numbered(kind[len(before) :])
    order = np.argsort(old, kind="stable")
    place = np.minimum(np.searchsorted(old[order], new), len(order) - 1)
    found = order[place]
    same = (old[found] == new) & (before[found] == after).all(axis=1)
    return np.where(same, found, -1)


def _numbered(kind: np.ndarray) -> np.ndarray:
    """Numbers (N,), of the ``kind`` (N,) of each row and the how manieth of its kind it is."""
    order = np.argsort(kind, kind="stable")
    begin = np.flatnonzero(np.diff(kind[order], prepend=-1))
    count = np.empty(len(kind), np.int64)
    count[order] = np.arange(len(kind)) - np.repeat(begin, np.diff(np.append(begin, len(kind))))
    return (kind << 32) | count


def same_triangles(before: Scene, after: Scene) -> np.ndarray:
    """For each triangle of ``after`` the one of ``before`` that is the same in place and material (T,), or -1."""
    return same_rows(*_triangle_rows(before, after))


def same_points(before: Points, after: Points) -> np.ndarray:
    """For each point of ``after`` the same one of ``before`` (N,), or -1."""
    return same_rows(_point_rows(before), _point_rows(after))


def same_lights(before: Sequence[Light], after: Sequence[Light]) -> bool:
    """Whether these are equal lights in an equal order."""
    return len(before) == len(after) and all(map(_same, before, after))


def light_scale(before: Sequence[Light], after: Sequence[Light]) -> np.ndarray | None:
    """By what (3,) all strengths of lights, lamps and worlds, were multiplied, RGB, when they are equal otherwise.

    None where anything else has changed, or not all by the same.
    """
    if len(before) != len(after):
        return None
    pairs = [(np.zeros(3), np.zeros(3))]
    for one, other in zip(before, after, strict=True):
        if type(one) is not type(other):
            return None
        given = [field.name for field in fields(one) if field.init]
        if not all(name in STRENGTHS or _same(getattr(one, name), getattr(other, name)) for name in given):
            return None
        pairs += [(getattr(one, name), getattr(other, name)) for name in given if name in STRENGTHS]
    if any(np.shape(one) != np.shape(other) for one, other in pairs):
        return None
    old, new = (np.concatenate([np.reshape(pair[side], (-1, 3)) for pair in pairs]) for side in (0, 1))
    if np.array_equal(old, new):
        return np.ones(3)
    squares = (old**2).sum(axis=0)
    scale = np.divide((old * new).sum(axis=0), squares, out=np.ones(3), where=squares > 0)
    return scale if np.allclose(new, scale * old, rtol=ROUNDING, atol=0.0) else None


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


def _triangle_rows(*scenes: Scene) -> list[np.ndarray]:
    """What each triangle of the ``scenes`` is, as far as any of them has such things: (T, C) numbers each."""
    columns: list[list[np.ndarray]] = [[scene.corners.reshape(-1, 9)] for scene in scenes]
    for name in ("albedo", "emission", "transmittance", "unshaded", "translucency"):
        values = [_property(scene, name) for scene in scenes]
        sided = any(value.ndim == 3 for value in values)
        if any(value.any() for value in values):
            for found, value in zip(columns, values, strict=True):
                found += list(np.broadcast_to(value, (2, *value.shape[-2:]))) if sided else [value]
    if any(scene.specular is not None for scene in scenes):
        for found, scene in zip(columns, scenes, strict=True):
            found.append(_turning(scene))
    return [np.concatenate(found, axis=1) for found in columns]


def _property(scene: Scene, name: str) -> np.ndarray:
    value = getattr(scene, name)
    if value is None:
        return scene.transmittance if name == "unshaded" else np.zeros((len(scene.triangles), 3))
    return value


def _turning(scene: Scene) -> np.ndarray:
    """How specular triangles (T, C) are; zero for others."""
    turning = np.zeros((len(scene.triangles), 20))
    surface = scene.specular
    if surface is not None:
        parts = (surface.mirror, surface.gloss, surface.clear, surface.ior[:, None], surface.roughness[:, None])
        turning[surface.triangles] = np.concatenate([surface.normals.reshape(-1, 9), *parts], axis=1)
    return turning


def _point_rows(points: Points) -> np.ndarray:
    inward = np.zeros_like(points.centres) if points.inward is None else points.inward
    return np.concatenate([points.centres, points.normals, inward, points.facing], axis=1)
