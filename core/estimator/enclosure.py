"""Points buried inside closed geometry: where they are, and which of them are to be filled from their neighbours."""

from __future__ import annotations

import numpy as np

from ..rays import RayCaster
from ..sampling import LATTICE, cosine_hemisphere

#: Rays from each point over its hemisphere; the first few alone acquit nearly every point that is not buried.
RAYS = 32
FIRST_RAYS = 4

#: More than this share of an enclosed point's rays meets the back side of a face, and none leaves the scene.
BACK_SHARE = 2 / 3

#: A point is unlit when it has less than this share of the median light.
UNLIT_SHARE = 1e-3


def enclosed(caster: RayCaster, origins: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Whether (N,) points at ``origins`` (N, 3), clear of surfaces, with unit ``normals`` (N, 3) look at the insides of
    closed geometry, by the triangles' winding.

    Geometry alone cannot tell a point in a wall from one in a room whose faces all look outward: for that, see
    :func:`hidden_points`.
    """
    uniforms = (np.arange(RAYS) + 0.5)[:, None] * LATTICE % 1.0
    backs, inside = _looks(caster, origins, normals, uniforms[:FIRST_RAYS])
    rows = np.flatnonzero(inside & (2 * backs >= FIRST_RAYS))
    more, inside = _looks(caster, origins[rows], normals[rows], uniforms[FIRST_RAYS:])
    result = np.zeros(len(origins), bool)
    result[rows] = inside & (backs[rows] + more > BACK_SHARE * RAYS)
    return result


def _looks(caster: RayCaster, origins, normals, uniforms) -> tuple[np.ndarray, np.ndarray]:
    """How many (N,) of the rays meet the back of a face, and whether (N,) all meet something."""
    shape = (len(origins), len(uniforms))
    about = np.repeat(normals, shape[1], axis=0)
    directions = cosine_hemisphere(about, np.tile(uniforms, (shape[0], 1)))
    triangle = caster.first_hits(np.repeat(origins, shape[1], axis=0), directions).triangle
    back = np.einsum("ij,ij->i", caster.normals[triangle], directions) > 0
    return (back & (triangle >= 0)).reshape(shape).sum(axis=1), (triangle >= 0).reshape(shape).all(axis=1)


def unlit(irradiance: np.ndarray) -> np.ndarray:
    """Whether (N,) each point has next to no ``irradiance`` (N, 3), measured by the median of those that have any."""
    light = np.abs(irradiance).sum(axis=1)
    lit = light > 0
    return light <= UNLIT_SHARE * np.median(light[lit]) if lit.any() else ~lit


def hidden_points(covered: np.ndarray, enclosed: np.ndarray, irradiance: np.ndarray) -> np.ndarray:
    """Which points (N,) have no light of their own: ``covered`` ones (N,), that see next to nothing of their disc, and
    ``enclosed`` ones (N,) that the bake left unlit, given its ``irradiance`` (N, 3).

    Rooms modelled with faces that look outward enclose their points too, but have light in them.
    """
    return covered | (enclosed & unlit(irradiance))
