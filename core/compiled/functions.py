"""All compiled functions. Importing this module imports Numba: only :func:`..compiled.kernels` does."""

from .bounces import bounce
from .directions import discs, hemispheres, set_crosswise, turned_around
from .emission import draw, launch, leave_sky, leave_triangles
from .grid_build import LANES, SIDES, count, distances, empty_boxes, fill, lay_out
from .grid_walk import crossings, order_by_end
from .hits import hit_points
from .passages import cut_beyond, let_through, passed
from .shadow_lamps import aim_at_lamps, arrived, choose_lamps, lamp_strengths
from .shadow_looks import count_sightings, look_by_chance, weigh_aimed, weigh_met
from .sums import add_up, look, pick, repeated_products, sector
from .surrounding_rays import aim_at_picture, aim_at_triangles, picture_met, triangles_met

__all__ = [
    "LANES",
    "SIDES",
    "add_up",
    "aim_at_lamps",
    "aim_at_picture",
    "aim_at_triangles",
    "arrived",
    "bounce",
    "choose_lamps",
    "count",
    "count_sightings",
    "crossings",
    "cut_beyond",
    "discs",
    "distances",
    "draw",
    "empty_boxes",
    "fill",
    "hemispheres",
    "hit_points",
    "lamp_strengths",
    "launch",
    "lay_out",
    "leave_sky",
    "leave_triangles",
    "let_through",
    "look",
    "look_by_chance",
    "order_by_end",
    "passed",
    "pick",
    "picture_met",
    "repeated_products",
    "sector",
    "set_crosswise",
    "triangles_met",
    "turned_around",
    "weigh_aimed",
    "weigh_met",
]
