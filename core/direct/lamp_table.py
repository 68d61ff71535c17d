"""Lamps as rows of numbers, for the compiled kernels: what core/compiled/shadow_lamps.py aims shadow rays by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights.aim import SMALLEST_RADIUS
from ..lights.area import IN_PLANE, LEAST_SOLID_ANGLE, PERPENDICULAR, AreaLight
from ..lights.light import Light
from ..lights.point import PointLight
from ..lights.spot import SpotLight
from ..lights.sun import SunLight

#: The kinds of rows. All begin with their kind and a colour (3), and go on with a place or direction (3).
POINT, BALL, SOFT, PARALLEL, CONE, AREA = range(6)

#: Numbers in a row.
WIDTH = 40


def lamp_table(lamps: Sequence[Light]) -> np.ndarray | None:
    """A row (L, WIDTH) for each of ``lamps``; None when there is a kind of lamp that has no row."""
    table = np.zeros((len(lamps), WIDTH))
    for row, lamp in zip(table, lamps, strict=True):
        numbers = _ROWS[type(lamp)](lamp) if type(lamp) in _ROWS else None
        if numbers is None:
            return None
        flat = np.concatenate([np.ravel(part).astype(np.float64) for part in numbers])
        row[: len(flat)] = flat
    return table


def _point(lamp: PointLight) -> list:
    """kind, power, position, radius"""
    kind = POINT if lamp.radius < SMALLEST_RADIUS else SOFT if lamp.soft else BALL
    return [kind, lamp.power, lamp.position, lamp.radius]


def _spot(lamp: SpotLight) -> list:
    """As a point, 1, the matrix into its own space, what the cone falls to, and the rim's part of that."""
    return [*_point(lamp), 1.0, np.linalg.inv(lamp.axis), lamp.fall, lamp.fall * lamp.blend]


def _sun(lamp: SunLight) -> list:
    """kind, irradiance or radiance, the direction towards it, 1 - cos of its half angle"""
    if lamp.sharp:
        return [PARALLEL, lamp.irradiance, -lamp.direction]
    half = 0.5 * lamp.angle
    return [CONE, lamp.irradiance / (np.pi * np.sin(half) ** 2), -lamp.direction, 2.0 * np.sin(0.5 * half) ** 2]


def _area(lamp: AreaLight) -> list:
    """kind, power over area, centre, normal, edges, shares of the edges by place, area; how it shines; how to choose"""
    lengths = np.linalg.norm([lamp.edge_u, lamp.edge_v], axis=1)
    ellipse = lamp.shape == "ellipse"
    across = np.cross(lamp.edge_u, lamp.edge_v)
    shares = np.stack([np.cross(lamp.edge_v, across), np.cross(across, lamp.edge_u)]) / (across @ across)
    upright = abs(lamp.edge_u @ lamp.edge_v) <= PERPENDICULAR * lengths.prod()
    return [
        *(AREA, lamp.power / lamp.area, lamp.centre, lamp.normal, lamp.edge_u, lamp.edge_v, shares, lamp.area),
        *(IN_PLANE * np.sqrt(lamp.area), lamp.tangent, lamp.tangent - 0.5 * lamp.spread, lamp.sharp, ellipse, upright),
        *(lengths, np.linalg.norm(shares, axis=1), LEAST_SOLID_ANGLE[lamp.shape]),
    ]


_ROWS = {PointLight: _point, SpotLight: _spot, SunLight: _sun, AreaLight: _area}
