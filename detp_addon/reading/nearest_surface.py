"""Finds the place on an evaluated surface that stands for an element of the mesh before its modifiers."""

from __future__ import annotations

import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from .read_meshes import MeshSurface

#: cosine between an element's normal and that of a face that may stand for it: a chamfer at 45 degrees may not
_AGREES = 0.75

#: how much farther than the nearest face one with an agreeing normal may be
_REACH = 3.0

#: the same as a share of how far corners usually lie from their middle, for elements that lie on several faces at once
_TOUCHING = 4e-4


def nearest_places(surface: MeshSurface, positions: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The triangle (E,) and the place on it (E, 3) nearest to each of ``positions`` (E, 3), in the mesh's own space.

    A face whose normal agrees with the element's, in ``normals`` (E, 3), is preferred to a slightly nearer one that
    does not; a zero normal agrees with every face. The triangle is -1 where the surface has no face or the position
    is not finite.
    """
    rows = np.flatnonzero(surface.kept)
    found = np.full(len(positions), -1)
    places = np.zeros((len(positions), 3))
    if len(rows) == 0:
        return found, places
    # Blender's tree holds float32, so it is built around the surface's middle.
    triangles = surface.triangles[rows]
    corners = surface.vertices[triangles.ravel()]
    middle = np.median(corners, axis=0)  # which no stray vertex moves
    touching = _TOUCHING * float(np.median(np.linalg.norm(corners - middle, axis=1)))
    tree = BVHTree.FromPolygons((surface.vertices - middle).tolist(), triangles.tolist(), all_triangles=True)
    finite = np.flatnonzero(np.isfinite(positions).all(axis=1))
    queries = zip(finite, (positions[finite] - middle).tolist(), normals[finite].tolist(), strict=True)
    for element, position, normal in queries:
        place, triangle = _nearest(tree, Vector(position), Vector(normal), touching)
        if triangle is not None:
            found[element] = rows[triangle]
            places[element] = place
    return found, places + middle


def _nearest(tree: BVHTree, position: Vector, normal: Vector, touching: float):
    place, facing, triangle, distance = tree.find_nearest(position)
    if triangle is None or normal.length_squared == 0.0 or facing.dot(normal) >= _AGREES:
        return place, triangle
    around = tree.find_nearest_range(position, _REACH * distance + touching)
    agreeing = [hit for hit in around if hit[1].dot(normal) >= _AGREES]
    if agreeing:
        place, _, triangle, _ = min(agreeing, key=lambda hit: (hit[3], hit[2]))
    return place, triangle
