"""The colour space that a file works in, as Blender's colour management tells it: Rec. 709 as a rule, or ACEScg."""

from __future__ import annotations

import numpy as np
from mathutils import Color

#: names of linear colour spaces -> Color's way from there to the working space, where this Blender has it
_WAYS = {
    "Linear Rec.709": "rec709_linear",
    "Linear Rec.2020": "rec2020_linear",
    "Linear CIE-XYZ D65": "xyz_d65",
    "ACEScg": "acescg",
    "ACES2065-1": "aces",
}


def from_rec709(colours: np.ndarray) -> np.ndarray:
    """Linear ``colours`` (..., 3) of Rec. 709 in the working space."""
    return in_working_space(colours, "Linear Rec.709")


def way_from(space: str) -> str | None:
    """The name of Color's way from a linear colour ``space`` to the working space, None when this Blender has none."""
    way = f"from_{_WAYS.get(space, '')}_to_scene_linear"
    return way if hasattr(Color, way) else None


def in_working_space(colours: np.ndarray, space: str) -> np.ndarray:
    """Linear ``colours`` (..., 3) of a colour ``space`` in the working space; they stay when nothing is known of it."""
    way = way_from(space)
    if way is None:
        return colours
    rows = np.array([getattr(Color(axis), way)() for axis in np.eye(3)])
    # Rounding in the library's matrices is no reason to touch what is in the working space already.
    return colours if np.allclose(rows, np.eye(3), atol=1e-4) else colours @ rows.astype(colours.dtype)


def luminance(colours: np.ndarray) -> np.ndarray:
    """Luminance (..., 1) of ``colours`` (..., 3) of the working space, by which Cycles turns a colour into a number."""
    weights = np.array([Color(axis).from_scene_linear_to_xyz_d65()[1] for axis in np.eye(3)])
    return colours @ weights[:, None]
