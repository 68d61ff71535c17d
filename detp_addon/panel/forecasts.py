"""The forecast beside the Bake button: from the meshes' sizes, and from what the scene's last bake took."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ...core.forecast import Forecast, forecast
from ..chosen_objects import likely_points
from ..mixing.light_groups import likely_groups
from ..request import BakeRequest

#: measured over predicted seconds of the last whole bake of a scene, by its file and name
_factors: dict[tuple[str, str], float] = {}


def forecast_of(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, request: BakeRequest) -> Forecast | None:
    """What baking the scene as ``request`` says is likely to take; None when there is nothing to bake."""
    points = _points(scene, view_layer, request)
    return _forecast(scene, view_layer, request, _factors.get(_key(scene), 1.0)) if points else None


def remember(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, request: BakeRequest, seconds: float) -> None:
    """Correct the forecasts of this scene by the ``seconds`` that ``request`` took; it must have come to its end."""
    plain = _forecast(scene, view_layer, request)
    if request.settings.seconds is None and plain.seconds > 0:
        _factors[_key(scene)] = seconds / plain.seconds


def forget_unsaved() -> None:
    """Drop what is known of files without a name: the next such file is another one."""
    for key in [key for key in _factors if not key[0]]:
        del _factors[key]


def _key(scene: bpy.types.Scene) -> tuple[str, str]:
    return bpy.data.filepath, scene.name


def _forecast(scene, view_layer, request: BakeRequest, factor: float = 1.0) -> Forecast:
    """Of all light groups, if they are baked apart: each is a bake of its own."""
    likely = forecast(_points(scene, view_layer, request), request.settings, factor)
    if not request.by_light or request.settings.seconds is not None:
        return likely
    return replace(likely, seconds=likely.seconds * likely_groups(scene, view_layer))


def _points(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, request: BakeRequest) -> int:
    """About how many points ``request`` asks for."""
    return likely_points(scene, view_layer, request.targets)
