"""The faces that show a mesh's colours, and places on them at which to look for light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.fit.shown_faces import FacePlaces, ShownFaces
from .estimation_points import CornerPoints
from .nearest_surface import nearest_places
from .read_meshes import MeshSurface
from .triangle_geometry import dots, has_area, normal_matrices, safe_unit

#: Seed of the places: the same for every bake, so that bakes of a scene differ by their light alone.
_SEED = 0

#: cosine between the normals of a surface and of a place on it, that lies between points whose normals are taken over
_SMOOTH = 0.5

#: Points at one vertex whose normals differ by less than this angle, in radians, show one value, and up to the second
#: one they are not expected to differ much. So many at a vertex are looked at.
_ALIKE, _BENT, _MOST_AROUND = 0.03, 1.0, 12


@dataclass(frozen=True)
class PlacedFaces:
    """All faces that show colours, and where on them light is to be found.

    rows     for each object which value (C,) each face corner shows, -1 for none
    faces    its ``values`` are those rows
    owners   (T,) the object of each of the triangles, and ``corners`` (T,) one of its face corners there
    places   K of them; ``centres`` (K, 3) metres and ``normals`` (K, 3) unit there
    """

    rows: tuple[np.ndarray, ...]
    faces: ShownFaces
    owners: np.ndarray
    corners: np.ndarray
    places: FacePlaces
    centres: np.ndarray
    normals: np.ndarray


def placed_faces(points: list[CornerPoints], surfaces: list[MeshSurface], domain: str) -> PlacedFaces:
    """The faces of objects with these ``points`` on these ``surfaces``; a value for each point, or, with the
    ``domain`` POINT, for each vertex.
    """
    none = np.zeros((0, 3))
    rows, values, corners, normals, count = [], [none.astype(np.int64)], [none[:, None]], [none[:, None]], 0
    ends, named = [0], [none[:, 0].astype(np.int64)]
    beside, angles = [none[:, :2].astype(np.int64)], [none[:, 0]]
    for part in points:
        vertex = np.zeros(len(part.centres), np.int64)
        vertex[part.rows[part.rows >= 0]] = part.vertices[part.rows >= 0]
        value = vertex
        if domain == "CORNER":
            value, pairs, between = _along_edges(vertex, part.normals)
            beside.append(pairs + count)
            angles.append(between)
        shown = np.where(part.rows >= 0, value[part.rows], -1)
        rows.append(np.where(shown >= 0, shown + count, -1))
        triangles = part.faces[(part.rows[part.faces] >= 0).all(axis=1)]
        placed = part.centres[part.rows[triangles]]
        triangles = triangles[has_area(placed)]
        values.append(rows[-1][triangles])
        corners.append(part.centres[part.rows[triangles]])
        normals.append(part.normals[part.rows[triangles]])
        count += int(shown.max(initial=-1)) + 1
        ends.append(ends[-1] + len(triangles))
        named.append(triangles[:, 0])
    shapes = map(_joined, (corners, normals))
    faces = ShownFaces(np.concatenate(values), *shapes, count, np.concatenate(beside), np.concatenate(angles))
    places = faces.drawn(_SEED)
    centres, directions = places.of(faces.corners), safe_unit(places.of(faces.normals))[0]
    for part, surface, first, end in zip(points, surfaces, ends, ends[1:], strict=False):
        if part.nearest:
            mine = np.flatnonzero((places.triangle >= first) & (places.triangle < end))
            centres[mine], directions[mine] = _on_surface(part, surface, centres[mine], directions[mine])
    owners = np.repeat(np.arange(len(points)), np.diff(ends))
    return PlacedFaces(tuple(rows), faces, owners, np.concatenate(named), places, centres, directions)


def _along_edges(vertex: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The value (N,) that each point of a ``vertex`` (N,) with unit ``normals`` (N, 3) shows: one for all at a vertex
    that face alike. And pairs (P, 2) of values at the same vertex, with the angle (P,) between them, in radians.
    """
    order = np.argsort(vertex, kind="stable")
    firsts, seconds = [], []
    for step in range(1, _MOST_AROUND):
        same = np.flatnonzero(vertex[order[step:]] == vertex[order[:-step]])
        if len(same) == 0:
            break
        firsts.append(order[same])
        seconds.append(order[same + step])
    first, second = (np.concatenate([np.zeros(0, np.int64), *each]) for each in (firsts, seconds))
    across = normals[first] - normals[second]
    angle = 2.0 * np.arcsin(np.minimum(0.5 * np.sqrt(dots(across, across)), 1.0))
    alike = angle < _ALIKE
    value = np.arange(len(vertex))
    # Points that face alike take the lowest number among them, passed on from one to the next.
    for _ in range(_MOST_AROUND):
        lowest = np.minimum(value[first[alike]], value[second[alike]])
        before = value.copy()
        np.minimum.at(value, first[alike], lowest)
        np.minimum.at(value, second[alike], lowest)
        if np.array_equal(value, before):
            break
    _, value = np.unique(value, return_inverse=True)
    near = ~alike & (angle < _BENT)
    pairs = np.stack([value[first[near]], value[second[near]]], axis=1)
    apart = pairs[:, 0] != pairs[:, 1]
    return value, pairs[apart], angle[near][apart]


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    return np.concatenate([part.reshape(-1, 3, 3) for part in parts])


def _on_surface(part: CornerPoints, surface: MeshSurface, centres: np.ndarray, normals: np.ndarray):
    """Where places between the points of a mesh that modifiers changed lie on its surface, and how that faces there."""
    linear, origin = part.matrix[:3, :3], part.matrix[:3, 3]
    local = np.linalg.lstsq(linear, (centres - origin).T, rcond=None)[0].T
    triangles, places = nearest_places(surface, local, safe_unit(normals @ linear)[0])
    found = triangles >= 0
    flat = surface.vertices[surface.triangles[triangles]]
    across = np.cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]) @ normal_matrices(part.matrix[None])[0].T
    facing, _ = safe_unit(across)
    # Rounded as its points are, unless the surface turns away there.
    smooth = dots(normals, facing) > _SMOOTH
    centres = np.where(found[:, None], places @ linear.T + origin, centres)
    return centres, np.where((found & ~smooth)[:, None], facing, normals)
