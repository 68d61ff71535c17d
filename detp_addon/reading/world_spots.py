"""Where a world has small bright spots that a picture of it would miss: the suns of skies, and of images of the sky."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .read_colour_nodes import COLOUR_RULES
from .read_images import pixels_of
from .read_input_nodes import INPUT_RULES, mapped
from .read_values import Values
from .surface_places import Nowhere, WhereaboutsUnknown
from .views import WORLD_RAYS

#: texels of larger images are not looked at one by one
MOST_TEXELS = 1 << 26

#: a texel this many times brighter than the mean, and with this share of all light, may be a sun; so many are looked at
_BRIGHT, _SHARE, _MOST_SPOTS = 20.0, 1e-4, 8

#: half the angle, in radians, of what is looked at around a bright texel
_AROUND_TEXEL = math.radians(0.8)

#: directions by which it is found out how a node turns them, and how exactly that must be a linear map
_PROBES, _LINEAR = 24, 1e-4


@dataclass(frozen=True)
class Spot:
    """A place in the sky that may hold a sun.

    towards  (3,) unit
    half     radians, half the angle of what is to be looked at
    disc     the sun's angular diameter, radians; None where only the picture tells
    """

    towards: np.ndarray
    half: float
    disc: float | None = None


class _Directions(Nowhere):
    """Places all around, seen along ``directions`` (m, 3)."""

    def __init__(self, directions: np.ndarray):
        super().__init__(WORLD_RAYS)
        self._directions = directions

    def given(self, kind: str, name: str = "") -> np.ndarray:
        """The directions where coordinates are asked for; raises otherwise."""
        if kind == "position" and name in ("Generated", "Object", "World"):
            return self._directions
        raise WhereaboutsUnknown


def spots(tree, left_out) -> list[Spot]:
    """The spots of a world's node ``tree``, whether or not its output shows them; one where several nodes have theirs.

    ``left_out`` is called with a sentence when an image is too large, or turned in a way that nobody can undo.
    """
    found = []
    for node, groups in _nodes(tree, ()):
        if node.mute:
            continue
        if _has_disc(node):
            half = 0.5 * node.sun_size
            local = [Spot(_sun_direction(node), 1.3 * half + 1e-4, node.sun_size)]
        elif node.bl_idname == "ShaderNodeTexEnvironment" and node.image is not None:
            local = _bright_texels(node, left_out)
        else:
            continue
        turned = _undone(node, groups) if local else None
        if local and turned is None:
            left_out(f"small bright spots of the world's {node.bl_label}, whose coordinates are changed")
            continue
        for spot in local:
            towards = turned(spot.towards)
            found.append(Spot(towards / np.linalg.norm(towards), spot.half, spot.disc))
    # A close-up shows whatever is there: two skies, or an image and its copy for the camera, must not count twice.
    alone: list[Spot] = []
    for spot in sorted(found, key=lambda spot: -(spot.disc or 0.0)):
        if all(spot.towards @ other.towards < math.cos(max(spot.half, other.half)) for other in alone):
            alone.append(spot)
    return alone


def hide_suns(tree) -> None:
    """Take the suns' discs out of all skies in a tree of nodes, and in its groups."""
    for node, _ in list(_nodes(tree, ())):
        if _has_disc(node):
            node.sun_disc = False


def _has_disc(node) -> bool:
    kinds = ("NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING")
    return node.bl_idname == "ShaderNodeTexSky" and node.sky_type in kinds and node.sun_disc


def _nodes(tree, groups):
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeGroup":
            if node.node_tree is not None and not node.mute:
                yield from _nodes(node.node_tree, (*groups, node))
        else:
            yield node, groups


def _sun_direction(node) -> np.ndarray:
    """Towards the sun of a sky texture, in the texture's own coordinates; a rotation of 0 is along +Y."""
    level = math.cos(node.sun_elevation)
    return np.array(
        (math.sin(node.sun_rotation) * level, math.cos(node.sun_rotation) * level, math.sin(node.sun_elevation))
    )


def _undone(node, groups):
    """A function that turns a direction of the node's texture into one of the world, None when there is none."""
    generator = np.random.default_rng(0)
    directions = generator.normal(size=(_PROBES, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    try:
        values = Values(_Directions(directions), _RULES)
        linked = values.linked(node, "Vector", groups)
        vectors = mapped(node, values.input(node, "Vector", groups) if linked else directions)
    except WhereaboutsUnknown:
        return None
    if len(vectors) != _PROBES:
        return None
    known = np.column_stack([directions, np.ones(_PROBES)])
    found = np.linalg.lstsq(known, vectors, rcond=None)[0]
    size = np.abs(vectors).max()
    if np.abs(known @ found - vectors).max() > _LINEAR * size or np.linalg.matrix_rank(found[:3], tol=1e-6 * size) < 3:
        return None
    if np.abs(found[3]).max() > _LINEAR * size:
        return None  # moved: no direction of the texture has one place in the sky
    return lambda direction: direction @ np.linalg.inv(found[:3])


_RULES = {**INPUT_RULES, **COLOUR_RULES}


def _bright_texels(node, left_out) -> list[Spot]:
    """Around the brightest texels of an environment texture, in its own coordinates."""
    image = node.image
    if node.projection != "EQUIRECTANGULAR" or image.source not in ("FILE", "GENERATED"):
        return []
    if image.size[0] * image.size[1] > MOST_TEXELS:
        left_out(f"small bright spots of the image {image.name}, which is too large to look at every texel")
        return []
    held = image.has_data
    pixels = pixels_of(image)
    if not held:
        image.buffers_free()
    if pixels is None:
        return []
    height, width = pixels.shape[:2]
    strength = pixels[..., :3].max(axis=2)
    level = np.cos(np.pi * ((np.arange(height) + 0.5) / height - 0.5)).astype(np.float32)
    total = float((strength @ np.ones(width, np.float32)) @ level)
    mean = total / float(level.sum() * width)
    bright = np.flatnonzero((strength > _BRIGHT * mean) & (strength * level[:, None] > _SHARE * total))
    found: list[Spot] = []
    rows, columns = np.divmod(bright, width)
    latitude, azimuth = np.pi * ((rows + 0.5) / height - 0.5), 2 * np.pi * (0.5 - (columns + 0.5) / width)
    towards = np.stack([np.cos(latitude) * np.cos(azimuth), np.cos(latitude) * np.sin(azimuth), np.sin(latitude)], 1)
    left = strength.reshape(-1)[bright].astype(np.float64)
    while len(found) < _MOST_SPOTS and left.any():
        place = towards[int(left.argmax())]
        found.append(Spot(place, _AROUND_TEXEL))
        left[towards @ place > math.cos(2 * _AROUND_TEXEL)] = 0.0
    return found
