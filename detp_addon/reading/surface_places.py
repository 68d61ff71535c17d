"""Where materials are evaluated: patches of equal area on triangles, or nowhere, to learn what they need."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .read_images import Images
from .texture_pyramid import triangle_centres

_ROWS = 4

#: barycentric centres (16, 3) of the patches of every triangle
PATCHES = triangle_centres(_ROWS)

#: three patches far apart, how far on the way from corner to corner, and whether (16,) a patch is turned about
_SPAN = [int(np.argmax(PATCHES[:, corner])) for corner in range(3)]
_WAY = float(PATCHES[_SPAN[0], 0] - PATCHES[_SPAN[1], 0])
_TURNED = np.rint(3 * _ROWS * PATCHES[:, 0]).astype(int) % 3 == 2


class WhereaboutsUnknown(Exception):  # noqa: N818
    """A value depends on the place on a surface, where there is none."""


#: what Light Path tells of the rays by which diffuse light travels between surfaces; other outputs are 0
DIFFUSE_RAYS = {
    "Is Diffuse Ray": 1.0,
    "Is Reflection Ray": 1.0,
    "Ray Length": 1.0,
    "Ray Depth": 1.0,
    "Diffuse Depth": 1.0,
}
#: of those that end in the world, which has no distance and counts as one reflection more
WORLD_RAYS = {**DIFFUSE_RAYS, "Ray Length": 0.0, "Ray Depth": 2.0}
#: and of those to a lamp, which are of no kind; their length is none that holds everywhere
LAMP_RAYS = {"Ray Depth": 1.0, "Ray Length": None}


@dataclass
class Probe:
    """No place at all: notes which ``attributes`` the nodes ask for, and gives zeros."""

    rays = DIFFUSE_RAYS
    real = False
    attributes: set[tuple[str, str]] = field(default_factory=set)

    def uv(self, name: str) -> np.ndarray:
        """Zero, and a note."""
        self.attributes.add(("uv", name))
        return np.zeros((1, 3))

    def attribute(self, name: str) -> np.ndarray:
        """Zero, and a note."""
        self.attributes.add(("attribute", name))
        return np.zeros((1, 4))

    def position(self, space: str) -> np.ndarray:
        """Zero, and a note."""
        self.attributes.add(("position", space))
        return np.zeros((1, 3))

    def image(self, node, coordinates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Black; what matters is what the coordinates asked for."""
        return np.zeros((1, 3)), np.zeros((1, 1))

    def unknown(self, feature: str) -> None:
        """Nothing: the real evaluation names it."""


class Nowhere:
    """No surface at all, for lights and worlds that are the same everywhere; raises WhereaboutsUnknown otherwise."""

    real = True

    def __init__(self, rays: dict[str, float | None]):
        self.rays = rays

    def uv(self, name: str):
        """Raise."""
        raise WhereaboutsUnknown

    attribute = position = unknown = uv

    def image(self, node, coordinates):
        """Raise."""
        raise WhereaboutsUnknown


class Patches:
    """The PATCHES of T triangles, whose attributes are given at their corners (T, 3, c)."""

    rays = DIFFUSE_RAYS
    real = True

    def __init__(self, corners: dict[tuple[str, str], np.ndarray], images: Images, unknown):
        self._corners = corners
        self._images = images
        self.unknown = unknown

    def uv(self, name: str) -> np.ndarray:
        """Texture coordinates (16 T, 3)."""
        return self._spread(("uv", name))

    def attribute(self, name: str) -> np.ndarray:
        """RGBA (16 T, 4)."""
        return self._spread(("attribute", name))

    def position(self, space: str) -> np.ndarray:
        """Coordinates (16 T, 3)."""
        return self._spread(("position", space))

    def image(self, node, coordinates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Colour (16 T, 3) and alpha (16 T, 1), each averaged over its patch."""
        texture = self._images.texture(node.image, with_alpha=node.outputs["Alpha"].is_linked)
        if node.projection != "FLAT":
            self.unknown(f"image projection ({node.projection.lower()}), taken as the image's mean")
            coordinates = np.full_like(coordinates, np.nan)
        rgba = texture.patches(coordinates[:, :2], _patch_edges(coordinates), node.extension)
        colour, alpha = rgba[:, :3], rgba[:, 3:]
        if texture.associated:
            colour = np.divide(colour, alpha, out=colour.copy(), where=alpha > 0)
        return colour, alpha

    def _spread(self, key: tuple[str, str]) -> np.ndarray:
        corners = self._corners[key]
        return np.einsum("pc,tck->tpk", PATCHES, corners).reshape(-1, corners.shape[2])


def _patch_edges(coordinates: np.ndarray) -> np.ndarray:
    """The two edges (m, 2, 2) of each patch in texture space, from how its triangle's patches lie (m, 3)."""
    if len(coordinates) % len(PATCHES):
        return np.zeros((len(coordinates), 2, 2))
    ends = coordinates.reshape(-1, len(PATCHES), 3)[:, _SPAN, :2]
    edges = (ends[:, 1:] - ends[:, :1]) / (_WAY * _ROWS)
    return (edges[:, None] * np.where(_TURNED, -1.0, 1.0)[:, None, None]).reshape(-1, 2, 2)
