"""Reads lamps: Blender's settings turned into the radiant flux and shape that Cycles gives them."""

from __future__ import annotations

import math

import numpy as np

from ...core.errors import InvalidArrayError, InvalidSettingError
from ...core.lights.area import AreaLight
from ...core.lights.light import Light
from ...core.lights.point import PointLight
from ...core.lights.spot import SpotLight
from ...core.lights.sun import SunLight
from .findings import Findings
from .read_materials import even_emission
from .read_node_graph import node_tree
from .views import LAMP_RAYS

_SHAPES = {"SQUARE": "rectangle", "RECTANGLE": "rectangle", "DISK": "ellipse", "ELLIPSE": "ellipse"}

#: cosine between a lamp's axes beyond which Cycles' light of it differs by more than a hundredth or two
SHEARED = 0.05


def read_light(obj, matrix: np.ndarray, metres: float, findings: Findings, own) -> Light | None:
    """The light of an evaluated lamp object that ``matrix`` (4, 4) places in the world, None when it gives none.

    ``matrix`` is in metres, of which one of Blender's units has ``metres``; light falls off with Blender's units.
    Its flux is energy 2^exposure colour, times the temperature's colour and the node tree's emission where those
    are used (shared with Cycles and checked against it). ``own`` is Standing.own of the object.
    """
    lamp = obj.data
    if not np.isfinite(matrix).all():
        findings.warn("lights whose place is not a number are left out: {}", "light", obj.name)
        return None
    if lamp.type == "AREA" and getattr(lamp, "cycles", None) and lamp.cycles.is_portal:
        findings.left_out("{}, which only guide Cycles' sampling", "light portal", obj.name)
        return None
    strength = _strength(obj, findings, own)
    if not np.isfinite(strength).all():
        findings.warn("lights whose strength is not a number are left out: {}", "light", obj.name)
        return None
    if not strength.any():
        return None
    try:
        light = _READERS[lamp.type](obj, matrix, metres, strength, findings)
    except (InvalidArrayError, InvalidSettingError):
        findings.warn("lights whose size or angle is not a possible number are left out: {}", "light", obj.name)
        return None
    if light is not None:
        _note(obj, findings)
    return light


def _strength(obj, findings: Findings, own) -> np.ndarray:
    """Energy with colour (3,), in the unit of the lamp's type."""
    lamp = obj.data
    with np.errstate(all="ignore"):
        strength = lamp.energy * np.exp2(getattr(lamp, "exposure", 0.0)) * np.array(lamp.color, np.float64)
        if getattr(lamp, "use_temperature", False):
            strength = strength * np.array(lamp.temperature_color, np.float64)
        tree = node_tree(lamp)
        return strength * _node_emission(tree, obj.name, findings, own) if tree else strength


def _node_emission(tree, name: str, findings: Findings, own) -> np.ndarray:
    emission = even_emission(tree, LAMP_RAYS, own)
    if emission is None:
        findings.warn("nodes that vary the light (patterns, IES profiles) are not read, of {}", "light", name)
        return np.ones(3)
    return emission


def _note(obj, findings: Findings) -> None:
    lamp = obj.data
    if not getattr(lamp, "use_shadow", True):
        findings.left_out("light without shadows of {}, which do cast them here", "light", obj.name)
    linking = getattr(obj, "light_linking", None)
    if linking and (linking.receiver_collection or linking.blocker_collection):
        findings.left_out("light linking of {}, which light everything here", "light", obj.name)


def _point_power(lamp, metres: float, strength: np.ndarray) -> np.ndarray:
    """Radiant flux (3,) of a point or spot all around; without ``normalize`` the strength is pi times the radiance."""
    strength = strength * metres**2
    if getattr(lamp, "normalize", True):
        return strength
    radius = lamp.shadow_soft_size
    return strength * (4.0 * math.pi * radius**2 if radius > 0 else 4.0)


def _point(obj, matrix: np.ndarray, metres: float, strength: np.ndarray, findings: Findings) -> PointLight:
    lamp = obj.data
    soft = getattr(lamp, "use_soft_falloff", False)
    return PointLight(matrix[:3, 3], _point_power(lamp, metres, strength), lamp.shadow_soft_size * metres, soft)


def _spot(obj, matrix: np.ndarray, metres: float, strength: np.ndarray, findings: Findings) -> SpotLight | None:
    lamp = obj.data
    if lamp.use_square:
        findings.left_out("square shape of {}, which shine as round ones", "spot light", obj.name)
    if np.linalg.matrix_rank(matrix[:3, :3]) < 3:
        findings.warn("lights scaled to nothing are left out: {}", "light", obj.name)
        return None
    power, radius = _point_power(lamp, metres, strength), lamp.shadow_soft_size * metres
    size, soft = min(lamp.spot_size, math.pi), getattr(lamp, "use_soft_falloff", False)
    _note_shear("spot light", obj, matrix, findings)
    return SpotLight(matrix[:3, 3], matrix[:3, :3], power, size, lamp.spot_blend, radius, soft)


def _sun(obj, matrix: np.ndarray, metres: float, strength: np.ndarray, findings: Findings) -> SunLight | None:
    if not matrix[:3, 2].any():
        findings.warn("lights scaled to nothing are left out: {}", "light", obj.name)
        return None
    angle = min(obj.data.angle, math.pi)
    if not getattr(obj.data, "normalize", True) and angle > 0:
        strength = strength * (math.pi * math.sin(0.5 * angle) ** 2)
    return SunLight(-matrix[:3, 2], strength, angle)


def _area(obj, matrix: np.ndarray, metres: float, strength: np.ndarray, findings: Findings) -> AreaLight | None:
    lamp = obj.data
    tall = lamp.size_y if lamp.shape in ("RECTANGLE", "ELLIPSE") else lamp.size
    edge_u, edge_v = matrix[:3, 0] * lamp.size, matrix[:3, 1] * tall
    if np.linalg.norm(np.cross(edge_u, edge_v)) == 0.0:
        findings.warn("area lights without an area are left out: {}", "light", obj.name)
        return None
    _note_shear("area light", obj, matrix, findings)
    # A mirrored lamp still shines along its own -Z, which the order of the edges tells.
    edge_u = -edge_u if np.linalg.det(matrix[:3, :3]) < 0 else edge_u
    shape, spread, power = _SHAPES[lamp.shape], min(lamp.spread, math.pi), strength * metres**2
    light = AreaLight(matrix[:3, 3], edge_u, edge_v, power, shape, spread)
    if getattr(lamp, "normalize", True):
        return light
    return AreaLight(light.centre, edge_u, edge_v, strength * light.area, shape, spread)


def _note_shear(thing: str, obj, matrix: np.ndarray, findings: Findings) -> None:
    axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    if np.abs(axes.T @ axes - np.eye(3)).max() > SHEARED:
        findings.left_out("the shear of {} under scaled parents, even here and not in Cycles", thing, obj.name)


_READERS = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}
