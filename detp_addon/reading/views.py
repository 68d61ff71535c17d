"""The ways in which surfaces are looked at: by which kind of ray, on which side, at which angle."""

from __future__ import annotations

import math
from dataclasses import dataclass

#: what Light Path tells of the rays by which diffuse light travels between surfaces; other outputs are 0, and None is
#: what differs from ray to ray
DIFFUSE_RAYS = {
    "Is Diffuse Ray": 1.0,
    "Is Reflection Ray": 1.0,
    "Ray Length": None,
    "Ray Depth": 1.0,
    "Diffuse Depth": 1.0,
}
#: of those that end in the world, which is at no distance short of infinity and counts as one reflection more
WORLD_RAYS = {**DIFFUSE_RAYS, "Ray Length": math.inf, "Ray Depth": 2.0}
#: of those to a lamp or a shining surface, which are of no kind; their length is none that holds everywhere
LAMP_RAYS = {"Ray Depth": 1.0, "Ray Length": None}
#: and of those that ask whether anything stands between
SHADOW_RAYS = {**LAMP_RAYS, "Is Shadow Ray": 1.0}

#: outputs of Light Path that only rays from mirrors and glass set
MIRROR_RAYS = frozenset(
    {"Is Glossy Ray", "Is Singular Ray", "Is Transmission Ray", "Glossy Depth", "Transmission Depth"}
)

#: cosines of the angles at which even light meets a surface: the middles of parts that bring as much each
COSINES = tuple(math.sqrt((step + 0.5) / 4) for step in range(4))


@dataclass(frozen=True)
class View:
    """How a surface is looked at.

    rays    what a Light Path node tells: output -> number
    back    whether from behind
    cosine  of the angle to the normal
    """

    rays: dict[str, float | None]
    back: bool
    cosine: float = 1.0


#: as diffuse light between surfaces sees fronts and backs; as shadow rays do; as those do that look at what shines
VIEWS = tuple(View(rays, back) for rays in (DIFFUSE_RAYS, SHADOW_RAYS, LAMP_RAYS) for back in (False, True))


def same_view(number: int, asks: frozenset[str]) -> int:
    """The first of VIEWS that shows the same as that ``number`` does, when nodes ask for "rays" or "side"."""
    kind, side = divmod(number, 2)
    return 2 * kind * ("rays" in asks) + side * ("side" in asks)
