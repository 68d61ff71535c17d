"""From irradiance at the estimation points to one colour per mesh element; NumPy only, no Blender."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: what can be baked, and what it means
QUANTITIES = {
    "lighting": "E/pi: the light on a white surface, as Cycles' diffuse bake without colour",
    "irradiance": "E in W/m2",
    "shaded": "albedo E/pi + emission: the colour the surface shows",
    "ambient-occlusion": "share of the hemisphere that is open, weighed by the cosine; no lights are needed",
}


@dataclass(frozen=True)
class Faces:
    """Which element each face corner takes its colour from.

    corner_face     (C,) the face of each corner
    corner_element  (C,) the element (corner or vertex) of each corner
    """

    corner_face: np.ndarray
    corner_element: np.ndarray


def spread(values: np.ndarray, rows: np.ndarray, faces: Faces) -> np.ndarray:
    """The rows of ``values`` (N, 3) that belong to each element: (M, 3) for ``rows`` (M,), -1 for "none".

    An element without a row takes the mean of the valid elements of its faces, else the mean of all valid
    elements, else zero.
    """
    valid = rows >= 0
    result = np.zeros((len(rows), 3))
    result[valid] = values[rows[valid]]
    if valid.all() or not valid.any():
        return result
    corner_valid = valid[faces.corner_element]
    face_mean, face_known = _means(result[faces.corner_element], faces.corner_face, corner_valid)
    around, known = _means(face_mean[faces.corner_face], faces.corner_element, face_known[faces.corner_face], len(rows))
    result[~valid] = result[valid].mean(axis=0)
    fill = ~valid & known
    result[fill] = around[fill]
    return result


def quantity_values(quantity: str, irradiance: np.ndarray, albedo: np.ndarray, emission: np.ndarray) -> np.ndarray:
    """The baked quantity (M, 3), one of QUANTITIES, from E in W/m^2, albedo and emitted radiance in W/(m^2 sr)."""
    if quantity == "irradiance":
        return irradiance
    if quantity in ("lighting", "ambient-occlusion"):
        return irradiance / np.pi
    return albedo * irradiance / np.pi + emission


def _means(values: np.ndarray, groups: np.ndarray, counted: np.ndarray, size: int = 0):
    """Mean (G, 3) of the ``counted`` rows of each group, and which groups have one."""
    size = max(size, int(groups.max()) + 1)
    members = np.bincount(groups[counted], minlength=size)
    sums = np.stack([np.bincount(groups[counted], values[counted, channel], size) for channel in range(3)], axis=1)
    return sums / np.maximum(members, 1)[:, None], members > 0
