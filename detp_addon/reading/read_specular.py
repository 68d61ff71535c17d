"""Reads the mirror-like and refracting triangles of placed meshes into the core's table of them."""

from __future__ import annotations

import numpy as np

from ...core.photons.specular import Specular
from .read_meshes import MeshSurface
from .response import Response
from .triangle_geometry import cross, dots, normal_matrix, safe_unit


def specular_part(
    surface: MeshSurface, response: Response, matrix: np.ndarray, placed: np.ndarray, keeps, order: list, first: int
) -> Specular | None:
    """The specular ones among the triangles of a mesh that a placement ``keeps`` (T,), None without any.

    ``matrix`` (4, 4) took the vertices to where they are ``placed`` (V, 3), corners are in ``order``, and the kept
    triangles are the scene's from row ``first`` on.
    """
    if surface.normals is None:
        return None
    turns = (response.mirror + response.gloss + response.clear).any(axis=1)
    rows = np.flatnonzero(turns & keeps)
    if len(rows) == 0:
        return None
    corners = placed[surface.triangles[rows][:, order]]
    flat, valid = safe_unit(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    # Far away from the origin rounding may put all corners into one place, which any normal serves.
    flat = np.repeat(np.where(valid[:, None], flat, (0.0, 0.0, 1.0)), 3, axis=0)
    normals = surface.normals[surface.corners[rows][:, order]].reshape(-1, 3) @ normal_matrix(matrix).T
    normals, valid = safe_unit(normals)
    normals = np.where((valid & (dots(normals, flat) > 0.0))[:, None], normals, flat)
    return Specular(
        first + (np.cumsum(keeps) - 1)[rows],
        normals.reshape(-1, 3, 3),
        response.mirror[rows],
        response.gloss[rows],
        response.clear[rows],
        response.ior[rows, 0],
        response.roughness[rows, 0] ** 2,
    )


def joined_specular(parts: list[Specular | None]) -> Specular | None:
    """All of ``parts`` as one table, None when there are none."""
    found = [part for part in parts if part is not None]
    if not found:
        return None
    return Specular(
        *(np.concatenate(columns) for columns in zip(*(vars(part).values() for part in found), strict=True))
    )
