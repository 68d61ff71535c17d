"""All compiled functions. Importing this module imports Numba: only :func:`..compiled.kernels` does."""

from .bounces import bounce
from .directions import discs, hemispheres, set_crosswise, turned_around
from .emission import draw, launch, leave_sky, leave_triangles
from .grid_build import LANES, SIDES, count, distances, empty_boxes, fill, lay_out
from .grid_walk import crossings, order_by_end
from .hits import hit_points
from .sums import add_up, look, pick, repeated_products, sector

__all__ = [
    "LANES",
    "SIDES",
    "add_up",
    "bounce",
    "count",
    "crossings",
    "discs",
    "distances",
    "draw",
    "empty_boxes",
    "fill",
    "hemispheres",
    "hit_points",
    "launch",
    "lay_out",
    "leave_sky",
    "leave_triangles",
    "look",
    "order_by_end",
    "pick",
    "repeated_products",
    "sector",
    "set_crosswise",
    "turned_around",
]
