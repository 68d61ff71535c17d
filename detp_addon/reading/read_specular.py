"""Reads the mirror-like and refracting triangles of placed meshes into the core's table of them."""

from __future__ import annotations

import numpy as np

from ...core.photons.specular import Specular
from ...core.triangles import cross, dots
from .joined_rows import starts_of
from .placed_triangles import PlacedTriangles, Placement
from .read_meshes import MeshSurface
from .response import Response
from .triangle_geometry import normal_matrices, safe_unit


def specular_table(
    surfaces: list[MeshSurface], response: Response, placements: list[Placement], placed: PlacedTriangles
) -> Specular | None:
    """The specular ones among the ``placed`` triangles of ``surfaces``, None without any.

    ``response`` is what all triangles of the surfaces do to light, one surface after the other.
    """
    starts = starts_of([len(surface.triangles) for surface in surfaces])
    turns = (response.mirror + response.gloss + response.clear).any(axis=1)
    turns &= np.repeat([surface.normals is not None for surface in surfaces], np.diff(starts)).astype(bool)
    met = np.array([placement.diffuse for placement in placements], bool)
    found = np.flatnonzero(turns[placed.rows] & met[placed.placement])
    if len(found) == 0:
        return None
    corners = placed.vertices[placed.triangles[found]]
    flat, valid = safe_unit(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    # Far away from the origin rounding may put all corners into one place, which any normal serves.
    flat = np.repeat(np.where(valid[:, None], flat, (0.0, 0.0, 1.0)), 3, axis=0)
    rows = placed.rows[found]
    numbers, begins = np.unique(placed.placement[found], return_index=True)
    turned = normal_matrices(np.stack([placements[number].matrix for number in numbers]))
    normals = []
    for number, some, matrix in zip(numbers, np.split(rows, begins[1:]), turned, strict=True):
        row = placements[number].surface
        corners = surfaces[row].corners[some - starts[row]]
        corners = corners[:, ::-1] if placed.mirrored[number] else corners
        normals.append(surfaces[row].normals[corners].reshape(-1, 3) @ matrix.T)
    normals, valid = safe_unit(np.concatenate(normals))
    normals = np.where((valid & (dots(normals, flat) > 0.0))[:, None], normals, flat)
    some = response.rows(rows)
    return Specular(
        found, normals.reshape(-1, 3, 3), some.mirror, some.gloss, some.clear, some.ior[:, 0], some.roughness[:, 0] ** 2
    )
