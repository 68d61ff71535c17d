"""How light becomes the numbers of a colour attribute: its exposure, its limit, its type; and what that cuts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...core.errors import InvalidSettingError, NotBakedError
from ..animation.playback import played_frames
from ..report import Brightness
from .baked_layers import holds_light, light_of, parts_of, stored_colours
from .write_attributes import MeshColours, write_layers

#: what colours are stored as, by the name of Blender's type: 32 bits a channel, or 8 in sRGB encoding
STORAGES = {"float": "FLOAT_COLOR", "byte": "BYTE_COLOR"}

#: share of the lit colours that "fit" brings to 1 or below: the rest is what lamps all but touch
FITTED_SHARE = 0.99

#: rounding that does not count as brighter than 1
_ROUNDING = 1e-6

#: stops, beyond which an exposure is a slip
_MOST_STOPS = 32.0


@dataclass(frozen=True)
class Encoding:
    """How light is stored.

    exposure  in stops: colours are light times 2^exposure; None fits it to the scene's light
    clamp     cut colours at 1, as formats and engines do that know none brighter
    storage   one of STORAGES; bytes are always cut

    Raises InvalidSettingError on anything else.
    """

    exposure: float | None = 0.0
    clamp: bool = False
    storage: str = "float"

    def __post_init__(self):
        if self.exposure is not None and not abs(self.exposure) <= _MOST_STOPS:
            raise InvalidSettingError(
                f"The exposure must lie between {-_MOST_STOPS:g} and {_MOST_STOPS:g} stops, not {self.exposure:g}."
            )
        if self.storage not in STORAGES:
            raise InvalidSettingError(f"Unknown storage '{self.storage}': choose {' or '.join(STORAGES)}.")

    @property
    def type(self) -> str:
        """Blender's name of the attributes' type."""
        return STORAGES[self.storage]


def encoded(
    colours: Sequence[MeshColours],
    encoding: Encoding,
    quantity: str,
    usual: float | None = None,
    error: float | None = None,
) -> tuple[list[MeshColours], Brightness]:
    """The colours (the light itself) as ``encoding`` stores them, and how bright they came out.

    The first layer of each entry decides. ``usual`` is a scale to take in place of a fitted one, ``error`` that of the
    light, where it is known.
    """
    mains = [next(iter(entry.layers.values())) for entry in colours]
    scale = 2.0**encoding.exposure if encoding.exposure is not None else usual or fitted_scale(mains)
    limit = 1.0 if encoding.clamp or encoding.storage == "byte" else math.inf
    light = {"quantity": quantity, "scale": scale} | ({"limit": limit} if math.isfinite(limit) else {})
    light |= {"error": error} if error is not None and math.isfinite(error) else {}
    stored = [
        replace(
            entry,
            layers={name: np.minimum(rgb * scale, limit) for name, rgb in entry.layers.items()},
            light=light,
            type=encoding.type,
        )
        for entry in colours
    ]
    above = sum(int((rgb.max(axis=1, initial=0.0) * scale > 1.0 + _ROUNDING).sum()) for rgb in mains)
    return stored, Brightness(scale, above, sum(map(len, mains)))


def fitted_scale(colours: Iterable[np.ndarray]) -> float:
    """The factor that brings FITTED_SHARE of the lit ``colours``, each (M, 3), to 1 or below; 1 when all are black."""
    brightest = [rgb.max(axis=1, initial=0.0) for rgb in colours]
    lit = np.concatenate([values[values > 0] for values in brightest]) if brightest else np.zeros(0)
    return float(1.0 / np.quantile(lit, FITTED_SHARE, method="higher")) if len(lit) else 1.0


def usual_scale(scene: bpy.types.Scene, attribute: str, without: Iterable[bpy.types.Object]) -> float | None:
    """The scale that most meshes of the scene have in ``attribute``, ``without`` some objects; None without any."""
    left = {obj.data for obj in scene.objects if obj.type == "MESH"} - {obj.data for obj in without}
    scales = [light_of(mesh, attribute)["scale"] for mesh in left if holds_light(mesh, attribute)]
    return max(set(scales), key=scales.count) if scales else None


def fit_stored(objects: Iterable[bpy.types.Object], attribute: str) -> Brightness:
    """Multiply the light that is stored in the ``attribute`` of ``objects``, so that it fits, and say how bright it is.

    Its direct and indirect parts and its light groups go with it. Raises NotBakedError when no mesh has light there, or
    only as bytes.
    """
    entries = []
    for mesh, obj in {obj.data: obj for obj in objects if obj.type == "MESH"}.items():
        layer = mesh.attributes.get(attribute)
        plays = played_frames(mesh, attribute) is not None  # whose other frames would stay as they are
        if mesh.library is None and holds_light(mesh, attribute) and layer.data_type == "FLOAT_COLOR" and not plays:
            light = light_of(mesh, attribute)
            groups = light.get("groups", {})
            names = attribute, *parts_of(attribute), *groups
            layers = {
                name: stored_colours(mesh.attributes[name])[:, :3].astype(np.float64) / light["scale"]
                for name in names
                if holds_light(mesh, name)
            }
            entries.append((MeshColours(obj, layers, groups=groups), light, layer.domain))
    if not entries:
        raise NotBakedError(
            f"No mesh has still light as floats in '{attribute}', whose exposure could be changed: bake with another."
        )
    scale = fitted_scale([entry.layers[attribute] for entry, _, _ in entries])
    above = count = 0
    with ExitStack() as undo:
        for entry, light, domain in entries:
            [stored], brightness = encoded([entry], Encoding(None), light["quantity"], scale, light.get("error"))
            write_layers(stored, domain, None, undo)
            above, count = above + brightness.above, count + brightness.colours
        undo.pop_all()
    return Brightness(scale, above, count)
