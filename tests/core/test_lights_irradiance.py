"""Irradiance from emitted particles where no shadow ray tells it: z-tests with 400 000 particles and fixed seeds.

The referee estimates what an unoccluded disc receives: the flux of the particles that cross it from its front, over its
area. That converges to the mean over the disc, so a formula is averaged over the disc by a fine, fixed quadrature. Of
all others shadow rays are held against the textbook, and particles against shadow rays (test_lights_shadow_rays.py).
"""

import numpy as np
import pytest
from detp.core.bounds import Bounds
from detp.core.crossing import crosses
from detp.core.lights.area import AreaLight
from detp.core.lights.environment import EnvironmentWorld
from detp.core.lights.light import EMISSION_DIMENSIONS
from detp.core.lights.world import UniformWorld

PARTICLES = 400_000
QUADRATURE = 100_000
REACH = 100.0
BOX = Bounds(np.array([-1.0, -1.0, -1.0]), np.array([1.0, 1.0, 1.0]))
UP = np.array([0.0, 0.0, 1.0])
COLOUR = np.array([2.0, 1.0, 0.5])


def unit(vector):
    return np.asarray(vector, float) / np.linalg.norm(vector)


def assert_irradiance(light, expected, centre=(0, 0, 0), normal=UP, radius=0.5, seed=1):
    """``expected`` (3,): mean irradiance over the disc, every channel within three standard errors."""
    centre, normal = np.asarray(centre, float), unit(normal)
    uniforms = np.random.default_rng(seed).random((PARTICLES, EMISSION_DIMENSIONS))
    particles = light.emit(uniforms, BOX)
    ends = particles.origins + REACH * particles.directions
    hit = crosses(particles.origins, ends, centre, normal, radius)
    each = np.where(hit[:, None], particles.flux, 0.0) * (PARTICLES / (np.pi * radius**2))
    mean, error = each.mean(axis=0), each.std(axis=0) / np.sqrt(PARTICLES)
    expected = np.broadcast_to(expected, 3)
    z = (mean - expected) / np.where(error > 0, error, 1e-12)
    print(f"E {mean} +- {error}, expected {expected}, z {z}, {int(hit.sum())} hits")
    assert (np.abs(z) < 3).all()
    assert (error < 0.03 * np.abs(expected) + 1e-12).all(), "too few hits to say anything"


def disc_mean(function, centre=(0, 0, 0), normal=UP, radius=0.5, count=QUADRATURE):
    """Mean of ``function`` (points (n, 3) -> (n,)) over a disc, by sunflower points of equal area."""
    first = unit(np.cross(unit(normal), (0.3, -0.5, 0.8)))
    second = np.cross(unit(normal), first)
    ring = radius * np.sqrt((np.arange(count) + 0.5) / count)
    angle = np.arange(count) * np.pi * (3 - np.sqrt(5))
    points = np.asarray(centre) + np.outer(ring * np.cos(angle), first) + np.outer(ring * np.sin(angle), second)
    return float(np.mean(function(points)))


def from_patch(points_on_light, normal, radiance_of_cosine, area):
    """Irradiance on an upward disc from a patch sampled at points, by the sum of L cos cos' / r^2."""

    def irradiance(points):
        total = np.zeros(len(points))
        for source in points_on_light:
            along = points - source
            squared = (along**2).sum(axis=1)
            here, there = -along[:, 2], along @ normal
            cosine = np.maximum(there, 0) / np.sqrt(squared)
            total += radiance_of_cosine(cosine) * np.maximum(here, 0) * np.maximum(there, 0) / squared**2
        return total * area / len(points_on_light)

    return irradiance


def ellipse_points(centre, u, v, count=300):
    ring = 0.5 * np.sqrt((np.arange(count) + 0.5) / count)
    angle = np.arange(count) * np.pi * (3 - np.sqrt(5))
    return np.asarray(centre) + np.outer(ring * np.cos(angle), u) + np.outer(ring * np.sin(angle), v)


@pytest.mark.parametrize("spread", [np.pi, 2.0, 0.9])
def test_sheared_ellipse_with_spread_against_a_numerical_integral(spread):
    centre, u, v = (0.1, 0.2, 0.8), np.array([0.6, 0.1, 0.1]), np.array([0.3, 0.4, -0.1])
    light = AreaLight(centre, u, v, COLOUR, "ellipse", spread)
    tangent = np.tan(spread / 2)

    def narrowed(cosine):
        if spread == np.pi:
            return np.ones_like(cosine)
        slope = np.sqrt(1 - np.minimum(cosine, 1) ** 2) / np.maximum(cosine, 1e-12)
        return np.maximum(tangent - slope, 0) / (tangent - spread / 2)

    expected = disc_mean(from_patch(ellipse_points(centre, u, v), light.normal, narrowed, light.area), count=4000)
    assert_irradiance(light, COLOUR / (np.pi * light.area) * expected)


@pytest.mark.parametrize("normal", [(0, 0, 1), (1, -2, -0.5)], ids=["up", "tilted"])
def test_uniform_world(normal):
    assert_irradiance(UniformWorld(COLOUR), np.pi * COLOUR, normal=normal)
    assert_irradiance(EnvironmentWorld(np.tile(COLOUR, (6, 9, 1))), np.pi * COLOUR, normal=normal)


def test_world_reaches_a_disc_near_the_boxs_side():
    assert_irradiance(UniformWorld(COLOUR), np.pi * COLOUR, centre=(0.5, 0, -0.99), normal=(0, 0.01, 1), radius=0.4)


@pytest.mark.parametrize(
    ("row", "column", "normal", "cycles"),
    [
        (1, 2, (1, 0, 0), 1.880),
        (1, 2, (0, 1, 0), 4.543),
        (1, 2, (0, 0, -1), 1.964),
        (2, 6, (-1, 0, 0), 1.882),
        (2, 6, (0, -1, 0), 4.542),
        (3, 0, (0, 0, 1), 1.963),
    ],
)
def test_environment_as_cycles_bakes_it(row, column, normal, cycles):
    # one of 4 x 8 cells at radiance 10: Blender 4.5.15, 1024 samples, direct DIFFUSE bake, no colour, x pi, to 0.1 %
    picture = np.zeros((4, 8, 3))
    picture[row, column] = 10
    assert_irradiance(EnvironmentWorld(picture), cycles, normal=normal, radius=0.3)
