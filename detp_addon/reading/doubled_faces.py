"""Shining faces that lie where another does: of both a ray meets but one."""

from __future__ import annotations

import numpy as np

from ...core.hashing import mixed
from ...core.rays import RayCaster
from ...core.triangles import cross, dots, normals_and_areas
from .surface_places import PATCHES
from .triangle_geometry import safe_unit

#: positions are the same, and in one plane, within this share of twice their distance from the middle of all, or of
#: what is usual of that; of the faces around an edge so many are compared
_SAME, _MOST_AROUND = 1e-7, 16


def share_alone(corners: np.ndarray, body: np.ndarray | None = None) -> np.ndarray:
    """Share (T,) of each of the triangles with ``corners`` (T, 3, 3) that lies on none of those before it.

    Faces that coincide have edges in common, also where they are cut into triangles otherwise. Those of another
    ``body`` (T,) that face the other way do not count: boxes that touch hide them.
    """
    corners, steps = _from_middle(corners)
    first, second = _pairs_around_edges(corners, steps)
    step = steps[first].max(axis=1)[:, None]
    normals = safe_unit(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))[0]
    heights = np.einsum("kci,ki->kc", corners[second] - corners[first][:, :1], normals[first])
    flat = (np.abs(heights) <= step).all(axis=1)
    if body is not None:
        flat &= (body[first] == body[second]) | (dots(normals[first], normals[second]) > 0.0)
    first, second, step = first[flat], second[flat], step[flat]
    places = np.einsum("pc,kci->kpi", PATCHES, corners[second])
    within = np.ones(places.shape[:2], bool)
    for k in range(3):
        start = corners[first, k]
        inward = safe_unit(cross(normals[first], corners[first, (k + 1) % 3] - start))[0]
        within &= np.einsum("kpi,ki->kp", places - start[:, None], inward) >= -step
    covered = np.zeros((len(corners), len(PATCHES)), bool)
    np.logical_or.at(covered, second, within)
    return 1.0 - covered.mean(axis=1)


def flush_with(caster: RayCaster, corners: np.ndarray) -> np.ndarray:
    """Whether (T,) the middles of triangles with ``corners`` (T, 3, 3) lie in triangles of the ``caster`` that face the
    same way."""
    normals, middles = normals_and_areas(corners)[0], corners.mean(axis=1)
    off = caster.tolerance(middles)
    hits = caster.first_hits(middles + off[:, None] * normals, -normals, 2.0 * off)
    depth = dots(middles - hits.points, normals)
    return (hits.triangle >= 0) & (depth <= off) & (dots(caster.normals[hits.triangle], normals) > 0.0)


def _from_middle(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ``corners`` (T, 3, 3) as seen from the middle of all, and how exact each is, (T, 3), in powers of two.

    What lies far away makes nothing else coarse.
    """
    corners = corners - np.median(corners.reshape(-1, 3), axis=0) if len(corners) else corners
    away = np.abs(corners).max(axis=2, initial=0.0)
    usual = np.median(away) if len(corners) else 0.0
    step = np.maximum(2.0 * _SAME * np.maximum(away, usual), np.finfo(float).tiny)
    return corners, np.exp2(np.floor(np.log2(step)))


def _pairs_around_edges(corners: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (K,), (K,) of triangles, the earlier first, that have an edge in common, with positions to ``steps``
    (T, 3)."""
    places = np.rint(corners / steps[..., None]).astype(np.int64).reshape(-1, 3)
    # Unlike places that happened to get one number would only be compared in vain.
    vertices = np.unique(mixed(places), return_inverse=True)[1].reshape(-1, 3)
    edges = np.sort(np.stack([vertices, np.roll(vertices, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    key = edges[:, 0] * len(places) + edges[:, 1]
    order = np.argsort(key, kind="stable")
    edge, triangle = key[order], order // 3
    pairs = [
        np.stack([triangle[:-gap], triangle[gap:]])[:, edge[:-gap] == edge[gap:]]
        for gap in range(1, min(_MOST_AROUND, len(edge)))
    ]
    first, second = np.concatenate([np.zeros((2, 0), np.int64), *pairs], axis=1)
    other = first != second  # what is smaller than a step has one edge twice
    return np.divmod(np.unique(first[other] * len(corners) + second[other]), max(len(corners), 1))
