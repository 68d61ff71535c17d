"""All compiled functions. Importing this module imports Numba: only :func:`..compiled.kernels` does."""

from .grid_build import LANES, SIDES, count, distances, empty_boxes, fill, lay_out
from .grid_walk import crossings

__all__ = ["LANES", "SIDES", "count", "crossings", "distances", "empty_boxes", "fill", "lay_out"]
