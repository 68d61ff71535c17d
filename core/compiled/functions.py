"""All compiled functions. Importing this module imports Numba: only :func:`..compiled.kernels` does."""

from .bounces import bounce
from .grid_build import LANES, SIDES, count, distances, empty_boxes, fill, lay_out
from .grid_walk import crossings, order_by_end
from .hits import hit_points
from .shadow_lamps import aim_at_lamps, arrived, choose_lamps, lamp_strengths
from .sums import add_up, repeated_products, sector

__all__ = [
    "LANES",
    "SIDES",
    "add_up",
    "aim_at_lamps",
    "arrived",
    "bounce",
    "choose_lamps",
    "count",
    "crossings",
    "distances",
    "empty_boxes",
    "fill",
    "hit_points",
    "lamp_strengths",
    "lay_out",
    "order_by_end",
    "repeated_products",
    "sector",
]
