"""Simple bounds of tangent discs that several searches share."""

from __future__ import annotations

import numpy as np

from ..discs import TangentDiscs
from .local_frame import EXTENT, LocalFrame


def extents(discs: TangentDiscs) -> np.ndarray:
    """How far each disc reaches from its centre along the axes, (N, 3) in metres."""
    return discs.radii[:, None] * np.sqrt(np.maximum(1.0 - discs.normals**2, 0.0))


def sides(discs: TangentDiscs) -> np.ndarray:
    """Which of the six axis directions each normal is closest to, (N,) int64 in 0..5."""
    axis = np.abs(discs.normals).argmax(axis=1)
    return 2 * axis + (np.take_along_axis(discs.normals, axis[:, None], axis=1)[:, 0] < 0)


def frame_around(discs: TangentDiscs) -> LocalFrame:
    """The frame that holds all ``discs``, N >= 1, in the finest unit."""
    extent = extents(discs)
    lower, upper = (discs.centres - extent).min(axis=0), (discs.centres + extent).max(axis=0)
    unit = float((upper - lower).max()) / (EXTENT - 2.0)
    return LocalFrame(lower - unit, unit, (upper - lower) / unit + 2.0)
