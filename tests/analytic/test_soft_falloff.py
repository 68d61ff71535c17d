"""Soft falloff: Blender's lamps that face every receiver, up to the surface of the lamp and through no wall."""

import numpy as np
import pytest
from detp.core.bake import baked
from detp.core.lights.point import PointLight
from detp.core.points import Points
from detp.core.settings import BakeSettings
from rooms import scene_of, z_scores

FLOOR = np.array([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)], float)


def mean_over_disc(intensity, height, lamp, radius):
    """The mean over a disc straight below of I h / (s^3) * s^2 / (s^2 + lamp^2), s the distance, by a fine sum."""
    rho = (np.arange(4000) + 0.5) / 4000 * radius
    s = np.hypot(rho, height)
    return intensity * np.average(height / s / (s**2 + lamp**2), weights=rho)


@pytest.mark.parametrize("height", [0.5, 1.0, 3.0])
def test_irradiance_falls_off_as_the_square_of_distance_and_radius(height):
    lamp, radius = 0.4, 0.3
    light = PointLight((0, 0, height), (100.0, 100.0, 100.0), lamp, soft=True)
    points, normals = np.zeros((1, 3)), np.array([(0, 0, 1.0)])
    settings = BakeSettings(photons=500_000, radius=radius, estimator="plain")
    result = baked(scene_of([FLOOR], lights=(light,)), Points(points, normals), settings)
    expected = mean_over_disc(100 / (4 * np.pi), height, lamp, radius)
    assert np.abs(z_scores(result, expected)).max() < 3


def test_no_light_starts_behind_a_wall():
    wall = np.array([(-4, -4, 0.5), (4, -4, 0.5), (4, 4, 0.5), (-4, 4, 0.5)], float)
    light = PointLight((0, 0, 1.0), (100.0, 100.0, 100.0), 0.4, soft=True)
    points, normals = np.zeros((1, 3)), np.array([(0, 0, 1.0)])
    settings = BakeSettings(photons=500_000, radius=0.5, direct="photons")
    result = baked(scene_of([FLOOR, wall], lights=(light,)), Points(points, normals), settings)
    assert (result.irradiance == 0).all()
