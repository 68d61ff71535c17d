"""The faces that show a mesh's colours, and places on them at which to look for light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core.fit.shown_faces import FacePlaces, ShownFaces
from ...core.group_sums import group_sums
from ...core.triangles import angles_between, dots, normals_and_areas
from .estimation_points import CornerPoints
from .joined_rows import numbered, starts_of
from .nearest_surface import nearest_places
from .read_meshes import MeshSurface
from .surface_normals import face_directions
from .triangle_geometry import (
    determinants,
    directions_around,
    facing_in_hollows,
    has_area,
    normal_matrices,
    safe_unit,
    sides_meant,
    weights_within,
)  # fmt: skip

#: Seed of the places: the same for every bake, so that bakes of a scene differ by their light alone.
SEED = 0

#: cosine between the normals of a surface and of a place on it, that lies between points whose normals are taken over
_SMOOTH = 0.5

#: Points at one place whose normals differ by less than this angle, in radians, show one value, and up to the second
#: one they are not expected to differ much. So many at a place are looked at.
_ALIKE, _BENT, _MOST_AROUND = 0.03, 1.0, 12


@dataclass(frozen=True)
class PlacedFaces:
    """All faces that show colours, and where on them light is to be found.

    rows     for each object which value (C,) each face corner shows, -1 for none
    faces    its ``values`` are those rows
    owners   (T,) the object of each of the triangles, and ``corners`` (T,) one of its face corners there
    places   K of them; ``centres`` (K, 3) metres and ``normals`` (K, 3) unit there
    facing   (K, 3) unit normals of the faces there
    """

    rows: tuple[np.ndarray, ...]
    faces: ShownFaces
    owners: np.ndarray
    corners: np.ndarray
    places: FacePlaces
    centres: np.ndarray
    normals: np.ndarray
    facing: np.ndarray


def drawn_anew(faces: ShownFaces, _owners: np.ndarray) -> FacePlaces:
    """Places on all of the ``faces``."""
    return faces.drawn(SEED)


def placed_faces(
    points: list[CornerPoints],
    surfaces: list[MeshSurface],
    domain: str,
    drawn: Callable[[ShownFaces, np.ndarray], FacePlaces] = drawn_anew,
) -> PlacedFaces:
    """The faces of objects with these ``points`` on these ``surfaces``; a value for each point, or, with the
    ``domain`` POINT, for each vertex. Of faces and their owners (T,), ``drawn`` finds the places.
    """
    if not points:
        none = np.zeros((0, 3))
        nowhere = FacePlaces(np.zeros(0, int), none, np.zeros(0), np.zeros(0))
        faces = ShownFaces(none.astype(int), none[:, None], none[:, None], 0)
        return PlacedFaces((), faces, np.zeros(0, int), np.zeros(0, int), nowhere, none, none, none)
    first = _Starts.of(points)
    rows = _joined([part.rows for part in points], first.points)
    vertices = _joined([part.vertices for part in points], first.vertices)
    centres = np.concatenate([part.centres for part in points])
    normals = np.concatenate([part.normals for part in points])
    vertex = np.zeros(len(centres), np.int64)
    vertex[rows[rows >= 0]] = vertices[rows >= 0]
    at, of_vertex, of_point = np.unique(vertex, return_index=True, return_inverse=True)
    of_point = of_point.ravel()
    owner = np.repeat(np.arange(len(points)), [len(part.centres) for part in points])
    place = _places_of(centres[of_vertex])
    if domain == "CORNER":
        value, beside, angles = _along_edges(place[of_point], owner, normals)
    else:
        mean = safe_unit(group_sums(normals, of_point, len(at)))[0]
        value, beside, angles = _along_edges(place, owner[of_vertex], mean)
        value = value[of_point]
    count = int(value.max(initial=-1)) + 1
    shown = np.where(rows >= 0, np.append(value, -1)[rows], -1)

    triangles = _joined([part.faces for part in points], first.corners).reshape(-1, 3)
    owners = np.repeat(np.arange(len(points)), [len(part.faces) for part in points])
    kept = np.flatnonzero((rows[triangles] >= 0).all(axis=1))
    kept = kept[has_area(centres[rows[triangles[kept]]])]
    triangles, owners = triangles[kept], owners[kept]
    at = rows[triangles]
    faces = ShownFaces(shown[triangles], centres[at], normals[at], count, beside, angles)
    places = drawn(faces, owners)
    centres, directions = places.of(faces.corners), safe_unit(places.of(faces.normals))[0]
    turned = determinants(np.stack([part.matrix for part in points])) < 0
    flat = normals_and_areas(faces.corners)[0] * np.where(turned, -1.0, 1.0)[owners, None]
    shared = faces.values if domain == "CORNER" else at
    around = directions_around(faces.corners, flat, shared, int(shared.max(initial=-1)) + 1)
    on = places.triangle
    facing = facing_in_hollows(faces.corners[on], flat[on], around[shared[on]], places.weights, directions)
    owner = owners[on]
    order = np.argsort(owner, kind="stable")
    ends = np.searchsorted(owner[order], np.arange(len(points) + 1))
    for number, (part, surface) in enumerate(zip(points, surfaces, strict=True)):
        if part.nearest:
            mine = order[ends[number] : ends[number + 1]]
            at = centres[mine], directions[mine], facing[mine]
            centres[mine], directions[mine], facing[mine] = _on_surface(part, surface, *at)
    corners = triangles[:, 0] - first.corners[owners]
    values = tuple(np.split(shown, first.corners[1:-1]))
    return PlacedFaces(values, faces, owners, corners, places, centres, directions, sides_meant(facing, directions))


@dataclass(frozen=True)
class _Starts:
    """Where (K + 1,) the points, vertices and corners of each of K objects begin among those of all."""

    points: np.ndarray
    vertices: np.ndarray
    corners: np.ndarray

    @classmethod
    def of(cls, points: list[CornerPoints]) -> _Starts:
        counts = [[len(part.centres), part.vertices.max(initial=-1) + 1, len(part.rows)] for part in points]
        return cls(*map(starts_of, zip(*counts, strict=True)))


def _joined(parts: list[np.ndarray], starts: np.ndarray) -> np.ndarray:
    """All ``parts``, K arrays of numbers that count from its own of the ``starts`` on; -1 stays what it is."""
    whole = np.concatenate(parts)
    return np.where(whole >= 0, numbered(parts, starts), -1)


def _places_of(centres: np.ndarray) -> np.ndarray:
    """A number (V,) for each vertex at ``centres`` (V, 3) that those share which lie exactly at one place."""
    order = np.lexsort(centres.T)
    place = np.zeros(len(order), np.int64)
    place[order[1:]] = np.cumsum((np.diff(centres[order], axis=0) != 0.0).any(axis=1))
    return place


def _along_edges(
    place: np.ndarray, owner: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The value (N,) that each point at a ``place`` (N,) of an object with unit ``normals`` (N, 3) shows: one for all
    at a place of an object that face alike, since importers split meshes along seams. And pairs (P, 2) of other values
    at the same place, since they split meshes by material, too; with the angle (P,) between them, in radians.
    """
    order = np.argsort(place, kind="stable")
    firsts, seconds = [], []
    for step in range(1, _MOST_AROUND):
        same = np.flatnonzero(place[order[step:]] == place[order[:-step]])
        if len(same) == 0:
            break
        firsts.append(order[same])
        seconds.append(order[same + step])
    first, second = (np.concatenate([np.zeros(0, np.int64), *each]) for each in (firsts, seconds))
    angle = angles_between(normals[first], normals[second])
    alike = (angle < _ALIKE) & (owner[first] == owner[second])
    value = np.arange(len(place))
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


def _on_surface(part: CornerPoints, surface: MeshSurface, centres, normals, facing):
    """Where places between the points of a mesh that modifiers changed lie on its surface, by which normals those are
    shaded, and how the surface faces there; without one near, as they were."""
    linear, origin = part.matrix[:3, :3], part.matrix[:3, 3]
    local = np.linalg.lstsq(linear, (centres - origin).T, rcond=None)[0].T
    triangles, places = nearest_places(surface, local, safe_unit(normals @ linear)[0])
    found = triangles >= 0
    flat, turn = face_directions(surface), normal_matrices(part.matrix[None])[0].T
    vertices = surface.triangles[triangles]
    around = directions_around(surface.vertices[surface.triangles], flat, surface.triangles, len(surface.vertices))
    corners, flat, around = surface.vertices[vertices], flat[triangles], around[vertices] @ turn
    weights = weights_within(corners, flat, places)
    # In an object that is flattened to a plane some faces have no direction left.
    across, directed = safe_unit(flat @ turn)
    facing = np.where((found & directed)[:, None], across, facing)
    if surface.normals is not None:
        shading = np.einsum("kc,kcd->kd", weights, surface.normals[surface.corners[triangles]]) @ turn
        shading, directed = safe_unit(shading)
        normals = np.where((found & directed)[:, None], shading, normals)
    # Rounded as the surface is, unless it turns away there.
    smooth = dots(normals, facing) > _SMOOTH
    normals = np.where((found & ~smooth)[:, None], facing, normals)
    hollow = facing_in_hollows(corners @ linear.T, facing, around, weights, normals)
    facing = np.where((found & directed)[:, None], hollow, facing)
    centres = np.where(found[:, None], places @ linear.T + origin, centres)
    return centres, normals, facing
