"""From irradiance at the estimation points to one colour per mesh element; NumPy only, no Blender."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.group_sums import group_means
from ...core.triangles import angles_between

#: what can be baked, and what it means
QUANTITIES = {
    "lighting": "E/pi: the light on a white surface, as Cycles' diffuse bake without colour",
    "irradiance": "E in W/m2",
    "shaded": "albedo E/pi + emission: the colour the surface shows",
    "ambient-occlusion": "share of the hemisphere that is open, weighed by the cosine; no lights are needed",
}


#: Colours are carried at most so many edges far; what lies deeper inside other geometry nobody sees.
MOST_RINGS = 200

#: the least weight of a corner, as an angle in radians, and of an edge, as a share of the mesh's size
_LEAST = 1e-6


@dataclass(frozen=True)
class Faces:
    """The faces of a mesh, and whether colours belong to their corners or to the vertices.

    corner_face    (C,) the face of each corner; the corners of a face follow each other around it
    corner_vertex  (C,) the vertex of each corner
    positions      (V, 3) of the vertices
    by_vertex      whether the M elements that have colours are the V vertices; otherwise they are the C corners
    """

    corner_face: np.ndarray
    corner_vertex: np.ndarray
    positions: np.ndarray
    by_vertex: bool


def spread(values: np.ndarray, rows: np.ndarray, faces: Faces) -> np.ndarray:
    """The colours (M, 3) of a mesh's elements, from the rows (C,) of ``values`` (N, 3) at its corners, -1 for "none".

    A vertex takes the mean of its corners that have a row, by their angles: what the faces around it show, and not
    what a plane between them would. Elements without any are filled from their neighbours in rings over the mesh.
    """
    known = rows >= 0
    result = np.zeros((len(rows), 3))
    result[known] = values[rows[known]]
    if faces.by_vertex:
        weights = np.where(known, _angles(faces), 0.0)
        result, known = group_means(result, faces.corner_vertex, len(faces.positions), weights)
    return result if known.all() or not known.any() else _filled(result, known, faces)


def quantity_values(quantity: str, irradiance: np.ndarray, albedo: np.ndarray, emission: np.ndarray) -> np.ndarray:
    """The baked quantity (M, 3), one of QUANTITIES, from E in W/m^2, albedo and emitted radiance in W/(m^2 sr)."""
    if quantity == "irradiance":
        return irradiance
    if quantity in ("lighting", "ambient-occlusion"):
        return irradiance / np.pi
    return albedo * irradiance / np.pi + emission


def _filled(values: np.ndarray, known: np.ndarray, faces: Faces) -> np.ndarray:
    """The ``values`` (M, 3) of the elements, with those that are not ``known`` (M,) taken from their neighbours.

    Ring by ring along the edges of each face, near neighbours weighing more; when no face can be filled any more, from
    the other faces at a vertex. What no ring reaches takes the mean of all that was known.
    """
    values, reached = values.copy(), known.copy()
    following, _ = _neighbours(faces)
    ends = np.stack([np.arange(len(following)), following])
    lengths = np.linalg.norm(np.subtract(*faces.positions[faces.corner_vertex[ends]]), axis=1)
    weights = np.tile(1.0 / np.maximum(lengths, _LEAST * max(lengths.max(), 1e-300)), 2)
    if faces.by_vertex:
        ends = faces.corner_vertex[ends]
    targets, sources = np.concatenate([ends, ends[::-1]], axis=1)
    for _ in range(MOST_RINGS):
        open_ends = ~reached[targets]
        targets, sources, weights = targets[open_ends], sources[open_ends], weights[open_ends]
        live = reached[sources]
        if live.any():
            means, found = group_means(values[sources[live]], targets[live], len(values), weights[live])
        elif not faces.by_vertex:
            means, found = group_means(values, faces.corner_vertex, len(faces.positions), reached.astype(float))
            means, found = means[faces.corner_vertex], found[faces.corner_vertex] & ~reached
        else:
            break
        if not found.any():
            break
        values[found] = means[found]
        reached |= found
    values[~reached] = values[known].mean(axis=0)
    return values


def _neighbours(faces: Faces) -> tuple[np.ndarray, np.ndarray]:
    """The next and the last corner (C,) around the face of each corner."""
    count = len(faces.corner_face)
    first = np.flatnonzero(np.diff(faces.corner_face, prepend=-1))
    last = np.append(first[1:], count) - 1
    following, before = np.arange(1, count + 1), np.arange(-1, count - 1)
    following[last[: len(first)]], before[first] = first, last[: len(first)]
    return following, before


def _angles(faces: Faces) -> np.ndarray:
    """The angle (C,) in radians of the face at each corner."""
    following, before = _neighbours(faces)
    places = faces.positions[faces.corner_vertex]
    ahead, back = places[following] - places, places[before] - places
    return np.maximum(angles_between(ahead, back), _LEAST)
