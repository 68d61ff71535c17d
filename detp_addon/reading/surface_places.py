"""Where materials are evaluated: patches of equal area on triangles, or nowhere, to learn what they need."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...core.hashing import mixed
from ...core.sampling import LATTICE
from ...core.sampling import triangle as barycentric
from .read_images import Images
from .recalled import recalled
from .texture_pyramid import triangle_centres
from .views import MIRROR_RAYS, VIEWS, View

_ROWS = 4

#: barycentric centres (16, 3) of the patches of every triangle
PATCHES = triangle_centres(_ROWS)

#: three patches far apart, how far on the way from corner to corner, and whether (16,) a patch is turned about
_SPAN = [int(np.argmax(PATCHES[:, corner])) for corner in range(3)]
_WAY = float(PATCHES[_SPAN[0], 0] - PATCHES[_SPAN[1], 0])
_TURNED = np.rint(3 * _ROWS * PATCHES[:, 0]).astype(int) % 3 == 2


class WhereaboutsUnknown(Exception):  # noqa: N818
    """A value depends on the place on a surface, where there is none."""


#: numbers in what the mesh or its object gives, where they are not three
_WIDTHS = {
    "attribute": 4,
    "colour layer": 4,
    "factor": 1,
    "property": 4,
    "island": 1,
    "object index": 1,
    "object alpha": 1,
    "object random": 1,
}


@dataclass
class Probe:
    """No place at all: notes what the nodes ask for, and gives zeros.

    needs    kinds and names of what the mesh or its object must give
    asks     "rays", "side" and "angle", where the values depend on those, and "mirrors", where they depend on whether a
             mirror or glass looks
    strange  the names of nodes whose work is not known
    alphas   the image nodes, by pointer, whose alpha is asked for
    """

    real = False
    needs: set[tuple[str, str]] = field(default_factory=set)
    asks: set[str] = field(default_factory=set)
    strange: set[str] = field(default_factory=set)
    alphas: set[int] = field(default_factory=set)

    def given(self, kind: str, name: str = "") -> np.ndarray:
        """Zero, and a note."""
        self.needs.add((kind, name))
        return np.zeros((1, _WIDTHS.get(kind, 3)))

    def ray(self, output: str) -> float:
        """Zero, and a note when not all kinds of rays tell the same."""
        if len({view.rays.get(output, 0.0) for view in VIEWS}) > 1:
            self.asks.add("rays")
        if output in MIRROR_RAYS:
            self.asks.add("mirrors")
        return 0.0

    @property
    def back(self) -> bool:
        """The front, and a note."""
        self.asks.add("side")
        return False

    @property
    def cosine(self) -> float:
        """One, and a note."""
        self.asks.add("angle")
        return 1.0

    material_index, half = 0.0, 0.5

    def coarser_than(self, coordinates: np.ndarray, size: float) -> bool:
        """No."""
        return False

    def image(self, node, coordinates: np.ndarray, alpha: bool) -> np.ndarray:
        """Black; what matters is what the coordinates asked for. And a note of an alpha."""
        if alpha:
            self.alphas.add(node.as_pointer())
        return np.zeros((1, 1 if alpha else 3))

    def unknown(self, feature: str) -> None:
        """A note: the real evaluation names it."""
        self.strange.add(feature)

    about = unknown


class Nowhere:
    """No surface at all, for lights and worlds that are the same everywhere; raises WhereaboutsUnknown otherwise.

    ``own`` gives what the light's object has, by kind and name, None for what it has not.
    """

    real = True

    def __init__(self, rays: dict[str, float | None], own=lambda kind, name: None):
        self._rays, self._own = rays, own

    def given(self, kind: str, name: str = ""):
        """What the object itself has; raises otherwise."""
        value = self._own(kind, name)
        if value is None:
            raise WhereaboutsUnknown
        return value

    def unknown(self, feature: str):
        """Raise."""
        raise WhereaboutsUnknown

    def coarser_than(self, coordinates, size: float):
        """Raise."""
        raise WhereaboutsUnknown

    @property
    def back(self):
        """Raise."""
        raise WhereaboutsUnknown

    cosine = material_index = half = back

    def ray(self, output: str) -> float | None:
        """What a Light Path node tells there."""
        return self._rays.get(output, 0.0)

    def about(self, feature: str) -> None:
        """Nothing: what is mostly so will do."""

    def image(self, node, coordinates, alpha: bool):
        """Raise."""
        raise WhereaboutsUnknown


class Patches:
    """The PATCHES of T triangles, looked at in that ``view``, with what is given at their corners (T, 3, c).

    ``unknown`` is called with what is not known; ``material_index`` is the material's, and ``alphas`` are as
    :class:`Probe` found them. Images show their mean over each patch, or, with the number of a ``draw``, what they show
    at one place on it; draws come in even numbers.
    """

    real = True

    def __init__(
        self,
        corners: dict[tuple[str, str], np.ndarray],
        images: Images,
        unknown,
        view: View,
        material_index: float,
        alphas: frozenset[int] = frozenset(),
        draw: int | None = None,
    ):
        self._corners = corners
        self._images = images
        self.unknown = self.about = unknown
        self._rays, self.back, self.cosine = view.rays, view.back, view.cosine
        self.material_index = material_index
        self._alphas = alphas
        self._draw, self.half = draw, 0.5 if draw is None else float(draw % 2)

    def ray(self, output: str) -> float | None:
        """What a Light Path node tells there."""
        return self._rays.get(output, 0.0)

    def given(self, kind: str, name: str = "") -> np.ndarray:
        """What the mesh or its object gives there (16 T, c)."""
        corners = self._corners[(kind, name)]
        return np.einsum("pc,tck->tpk", PATCHES, corners).reshape(-1, corners.shape[2])

    def coarser_than(self, coordinates: np.ndarray, size: float) -> np.ndarray | bool:
        """Whether (16 T, 1) the patches are longer than ``size`` in ``coordinates`` (16 T or 1, 3)."""
        if len(coordinates) % len(PATCHES):
            return False
        ends = coordinates.reshape(-1, len(PATCHES), 3)[:, _SPAN]
        longest = np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2).max(axis=1) / (_WAY * _ROWS)
        return np.repeat(longest > size, len(PATCHES))[:, None]

    def image(self, node, coordinates: np.ndarray, alpha: bool) -> np.ndarray:
        """Colour (16 T, 3), or ``alpha`` (16 T, 1), on each patch."""
        texture = self._images.texture(node.image, node.as_pointer() in self._alphas, node.interpolation)
        if node.projection != "FLAT":
            self.unknown(f"image projection ({node.projection.lower()}), taken as the image's mean")
            coordinates = np.full_like(coordinates, np.nan)
        centres, edges = coordinates[:, :2], _patch_edges(coordinates)
        if self._draw is None:
            given = centres, edges, node.extension, node.interpolation
            rgba = recalled(lambda: texture.patches(*given), "patches", texture, *given)
        else:
            rgba = texture.looked_at(_drawn(centres, edges, self._draw), node.extension, node.interpolation)
        colour, share = rgba[:, :3].copy(), rgba[:, 3:].copy()
        if alpha:
            return share
        return np.divide(colour, share, out=colour, where=share > 0) if texture.associated else colour


def _drawn(centres: np.ndarray, edges: np.ndarray, draw: int) -> np.ndarray:
    """A place (m, 2) on each patch; anywhere where its ``centres`` (m, 2) are not known. Those of all numbers from 0 on
    are even, and depend on nothing but the patch."""
    bits = mixed(np.ascontiguousarray(np.rint(np.nan_to_num(centres) * 2.0**20) + 0.0))
    shift = np.stack([bits >> np.uint64(32), bits & np.uint64(2**32 - 1)], axis=1) / 2.0**32
    uniforms = (draw * LATTICE + shift) % 1.0
    aside = barycentric(uniforms)[:, 1:] - 1.0 / 3.0
    return np.where(np.isfinite(centres), centres + np.einsum("mk,mkd->md", aside, edges), uniforms)


def _patch_edges(coordinates: np.ndarray) -> np.ndarray:
    """The two edges (m, 2, 2) of each patch in texture space, from how its triangle's patches lie (m, 3)."""
    if len(coordinates) % len(PATCHES):
        return np.zeros((len(coordinates), 2, 2))
    ends = coordinates.reshape(-1, len(PATCHES), 3)[:, _SPAN, :2]
    edges = (ends[:, 1:] - ends[:, :1]) / (_WAY * _ROWS)
    return (edges[:, None] * np.where(_TURNED, -1.0, 1.0)[:, None, None]).reshape(-1, 2, 2)
