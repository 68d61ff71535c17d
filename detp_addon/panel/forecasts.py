"""The forecast beside the Bake button: from the meshes' sizes, and from what the scene's last bake took."""

from __future__ import annotations

import bpy

from ...core.errors import DetpError
from ...core.forecast import Forecast, forecast
from ..chosen_objects import likely_points
from ..report import BakeReport
from .properties import bake_request, scene_options

#: measured over predicted seconds of the last bake of a scene, by the scene's name
_factors: dict[str, float] = {}


def forecast_of(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> Forecast | None:
    """What baking the scene with its present settings is likely to take; None when there is nothing to bake."""
    points = _points(scene, view_layer)
    if points == 0:
        return None
    try:
        request = bake_request(scene_options(scene.detp))
    except DetpError:
        return None
    return forecast(points, request.settings, _factors.get(scene.name, 1.0))


def remember(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, report: BakeReport) -> None:
    """Correct the forecasts of this scene by what a finished bake took."""
    request = bake_request(scene_options(scene.detp))
    plain = forecast(_points(scene, view_layer), request.settings)
    if request.settings.seconds is None and plain.seconds > 0:
        _factors[scene.name] = report.seconds["total"] / plain.seconds


def _points(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> int:
    """About how many points the settings ask for."""
    return likely_points(scene, view_layer, scene.detp.targets.lower())
