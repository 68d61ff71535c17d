"""The forecast beside the Bake button: from the meshes' sizes, and from what the scene's last bake took."""

from __future__ import annotations

import bpy

from ...core.forecast import Forecast
from ..likely import likely_bake, likely_values
from ..request import BakeRequest

#: measured over predicted seconds of the last whole bake of a scene, by its file and name
_factors: dict[tuple[str, str], float] = {}


def forecast_of(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, request: BakeRequest) -> Forecast | None:
    """What baking the scene as ``request`` says is likely to take; None when there is nothing to bake."""
    values = likely_values(scene, view_layer, request)
    return likely_bake(scene, view_layer, request, values, _factors.get(_key(scene), 1.0)) if values else None


def remember(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, request: BakeRequest, seconds: float) -> None:
    """Correct the forecasts of this scene by the ``seconds`` that ``request`` took; it must have come to its end."""
    plain = likely_bake(scene, view_layer, request, likely_values(scene, view_layer, request))
    if request.settings.seconds is None and plain.seconds > 0:
        _factors[_key(scene)] = seconds / plain.seconds


def forget_unsaved() -> None:
    """Drop what is known of files without a name: the next such file is another one."""
    for key in [key for key in _factors if not key[0]]:
        del _factors[key]


def _key(scene: bpy.types.Scene) -> tuple[str, str]:
    return bpy.data.filepath, scene.name
