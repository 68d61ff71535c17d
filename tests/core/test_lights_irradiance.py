"""Irradiance from emitted particles against the textbook: z-tests with 400 000 particles and fixed seeds.

The referee estimates what an unoccluded disc receives: the flux of the particles that cross it from its front, over its
area. That converges to the mean over the disc, so each formula is averaged over the disc by a fine, fixed quadrature.
"""

import numpy as np
import pytest
from detp.core.bounds import Bounds
from detp.core.crossing import crosses
from detp.core.lights.area import AreaLight
from detp.core.lights.emissive import EmissiveTriangles
from detp.core.lights.environment import EnvironmentWorld
from detp.core.lights.light import EMISSION_DIMENSIONS
from detp.core.lights.point import PointLight
from detp.core.lights.spot import SpotLight
from detp.core.lights.sun import SunLight
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


def from_point(position, normal=UP, intensity=lambda directions: 1.0):
    """I cos / r^2 at points (n, 3), for an intensity that depends on the direction of the light's travel."""

    def irradiance(points):
        along = points - position
        distance = np.linalg.norm(along, axis=1)
        cosine = -(along @ unit(normal)) / distance
        return intensity(along / distance[:, None]) * np.maximum(cosine, 0) / distance**2

    return irradiance


# --- sun: E = S cos ---


@pytest.mark.parametrize("angle", [0.0, 0.0092, 0.8])
@pytest.mark.parametrize("normal", [(0, 0, 1), (1, -0.5, 1)], ids=["facing up", "tilted"])
def test_sun(angle, normal):
    direction = unit((0.3, 0.2, -1))
    assert_irradiance(SunLight(direction, COLOUR, angle), -(unit(normal) @ direction) * COLOUR, normal=normal)


def test_sun_that_the_disc_faces_keeps_its_irradiance_whatever_its_angle():
    direction = unit((0.3, 0.2, -1))
    assert_irradiance(SunLight(direction, COLOUR, np.pi), COLOUR, normal=-direction)


def test_sun_cut_by_the_horizon():
    # half the disc of the sun stands above the plane; midpoint sum over that half
    half = 0.6
    fall, angle = np.meshgrid(
        (np.arange(500) + 0.5) / 500 * (1 - np.cos(half)), (np.arange(500) + 0.5) / 500 * 2 * np.pi
    )
    cosine = np.sqrt(fall * (2 - fall)) * np.cos(angle)
    share = np.maximum(cosine, 0).mean() * 2 / (1 + np.cos(half))
    assert_irradiance(SunLight((1, 0, 0), COLOUR, 2 * half), share * COLOUR)


# --- point: the disc's mean is 2 I (1 - h / sqrt(h^2 + d^2)) / d^2 ---


@pytest.mark.parametrize("height", [0.3, 1.0])
def test_point_above_the_middle(height, radius=0.5):
    mean = 2 * (1 - height / np.hypot(height, radius)) / radius**2 / (4 * np.pi)
    assert disc_mean(from_point((0, 0, height))) / (4 * np.pi) == pytest.approx(mean, rel=1e-3)
    assert_irradiance(PointLight((0, 0, height), COLOUR), mean * COLOUR, radius=radius)


def test_point_from_the_side_and_negative():
    place, normal = (0.8, 0.3, 0.9), (0.2, 0.5, 1)
    expected = -COLOUR / (4 * np.pi) * disc_mean(from_point(place, normal), normal=normal)
    assert_irradiance(PointLight(place, -COLOUR), expected, normal=normal)


def test_sphere_gives_pi_l_cos_over_h_squared():
    # H = D / R, L = power / (4 pi^2 R^2); the whole sphere stands above the plane of the disc
    sphere = 0.4
    light = PointLight((0.3, 0, 0.8), COLOUR, sphere)
    radiance = COLOUR / (4 * np.pi**2 * sphere**2)
    assert_irradiance(light, np.pi * radiance * sphere**2 * disc_mean(from_point((0.3, 0, 0.8))))


# --- spot: I S((cos a - c) / ((1 - c) blend)) cos / r^2 ---


def cone(axis, size, blend):
    def intensity(directions):
        c = np.cos(size / 2)
        t = np.clip((directions @ unit(axis) - c) / ((1 - c) * max(blend, 1e-12)), 0, 1)
        return t * t * (3 - 2 * t) / (4 * np.pi)

    return intensity


def test_spot_on_its_axis():
    # well inside the rim: nothing but I / h^2 averaged over a small disc
    mean = 2 * (1 - 1 / np.hypot(1, 0.1)) / 0.1**2 / (4 * np.pi)
    assert_irradiance(SpotLight((0, 0, 1), (0, 0, -1), COLOUR, 0.8, 0.1), mean * COLOUR, radius=0.1)


@pytest.mark.parametrize(("size", "blend"), [(1.2, 1.0), (1.0, 0.15), (0.8, 0.0), (np.pi, 0.5)])
def test_spot_with_its_rim(size, blend):
    place, axis = (0.2, 0, 1), (-0.2, 0.1, -1)
    expected = disc_mean(from_point(place, intensity=cone(axis, size, blend)))
    assert_irradiance(SpotLight(place, axis, COLOUR, size, blend), expected * COLOUR)


def test_spot_of_a_scaled_lamp_is_round_in_its_own_space():
    matrix = np.array([[2.0, 0.3, 0.2], [0.0, 1.0, 0.1], [0.1, 0.0, 1.5]])
    own = cone((0, 0, -1), 1.0, 0.5)

    def intensity(directions):
        local = directions @ np.linalg.inv(matrix).T
        return own(local / np.linalg.norm(local, axis=1)[:, None])

    expected = disc_mean(from_point((0.1, 0, 1), intensity=intensity))
    assert_irradiance(SpotLight((0.1, 0, 1), matrix, COLOUR, 1.0, 0.5), expected * COLOUR)


# --- area lights: E = pi L F ---


def test_coaxial_discs():
    # F = R^2 / (R^2 + h^2) at the middle; for the mean over the receiving disc of radius d
    # F = (X - sqrt(X^2 - 4 (R/d)^2)) / 2 with X = 1 + (R^2 + h^2) / d^2
    size, height, radius = 0.4, 0.7, 0.5
    radiance = COLOUR / (np.pi * np.pi * size**2)
    x = 1 + (size**2 + height**2) / radius**2
    factor = (x - np.sqrt(x * x - 4 * (size / radius) ** 2)) / 2
    light = AreaLight((0, 0, height), (2 * size, 0, 0), (0, 2 * size, 0), COLOUR, "ellipse")
    assert_irradiance(light, np.pi * radiance * factor, radius=radius)
    small = 0.05
    assert_irradiance(light, np.pi * radiance * size**2 / (size**2 + height**2), radius=small)


def test_parallel_rectangle():
    # corner formula, summed with signs over the four corners
    (x0, x1), (y0, y1), height = (-0.2, 0.5), (0.1, 0.4), 0.6

    def corner(a, b):
        p, q = np.sqrt(1 + a * a), np.sqrt(1 + b * b)
        return (a / p * np.arctan(b / p) + b / q * np.arctan(a / q)) / (2 * np.pi)

    def factor(points):
        a0, a1, b0, b1 = ((end - points[:, k]) / height for k, end in ((0, x0), (0, x1), (1, y0), (1, y1)))
        return corner(a1, b1) - corner(a0, b1) - corner(a1, b0) + corner(a0, b0)

    radiance = COLOUR / (np.pi * (x1 - x0) * (y1 - y0))
    centre = ((x0 + x1) / 2, (y0 + y1) / 2, height)
    light = AreaLight(centre, (x1 - x0, 0, 0), (0, y1 - y0, 0), COLOUR)
    assert_irradiance(light, np.pi * radiance * disc_mean(factor))


def test_perpendicular_rectangle():
    # a wall of height a at x = 0.6, from y0 to y1, that shines towards -x; for the part from 0 to b at distance c
    # F = (atan(b/c) - c/w atan(b/w)) / 2 pi with w^2 = a^2 + c^2
    a, (y0, y1), wall = 0.8, (-0.3, 0.5), 0.6

    def factor(points):
        c = wall - points[:, 0]
        w = np.hypot(a, c)
        parts = [np.arctan(b / c) - c / w * np.arctan(b / w) for b in (y1 - points[:, 1], y0 - points[:, 1])]
        return (parts[0] - parts[1]) / (2 * np.pi)

    radiance = COLOUR / (np.pi * a * (y1 - y0))
    light = AreaLight((wall, (y0 + y1) / 2, a / 2), (0, y1 - y0, 0), (0, 0, a), COLOUR)
    assert light.normal == pytest.approx([-1, 0, 0])
    assert_irradiance(light, np.pi * radiance * disc_mean(factor))


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


@pytest.mark.parametrize(("degrees", "cycles"), [(120, 7.26363), (90, 12.67039), (45, 42.49672)])
def test_spread_as_cycles_bakes_it(degrees, cycles):
    # 10 W, 0.4 m x 0.2 m, 1 m above the receiver: Blender 4.5.15, 4096 samples, direct DIFFUSE bake, no colour, x pi
    light = AreaLight((0, 0, 1), (0.4, 0, 0), (0, 0.2, 0), (10, 10, 10), spread=np.radians(degrees))
    assert_irradiance(light, cycles, radius=0.04)


def test_the_back_of_an_area_light_is_dark():
    light = AreaLight((0, 0, -0.5), (1, 0, 0), (0, 1, 0), COLOUR)
    assert_irradiance(light, 0.0)
    assert_irradiance(light, 0.0, normal=-UP)


# --- emissive triangles: Lambert's polygon formula, from both sides ---


def lambert(corners, radiance, normal):
    def irradiance(points):
        towards = corners[None] - points[:, None]
        towards /= np.linalg.norm(towards, axis=2, keepdims=True)
        total = 0.0
        for i in range(3):
            a, b = towards[:, i], towards[:, (i + 1) % 3]
            cross = np.cross(a, b)
            length = np.linalg.norm(cross, axis=1)
            total = total + np.arctan2(length, (a * b).sum(axis=1)) * (cross @ normal) / length
        return radiance / 2 * np.abs(total)

    return irradiance


@pytest.mark.parametrize("side", [1, -1], ids=["front", "back"])
def test_emissive_triangles(side):
    corners = np.array(
        [[(0.5, -0.2, 0.3), (0.1, 0.6, 0.8), (-0.4, -0.3, 0.6)], [(-0.6, 0, 1), (0, 0.6, 0.9), (0, 0, 0.7)]]
    )
    corners[..., 2] *= side
    radiance = np.array([COLOUR, -0.3 * COLOUR])
    normal = side * UP
    expected = [disc_mean(lambert(t, r, normal)) for t, r in zip(corners, (1.0, -0.3), strict=True)]
    assert_irradiance(EmissiveTriangles(corners, radiance), sum(expected) * COLOUR, normal=normal)


# --- worlds: E = pi L ---


@pytest.mark.parametrize("normal", [(0, 0, 1), (1, -2, -0.5)], ids=["up", "tilted"])
def test_uniform_world(normal):
    assert_irradiance(UniformWorld(COLOUR), np.pi * COLOUR, normal=normal)
    assert_irradiance(EnvironmentWorld(np.tile(COLOUR, (6, 9, 1))), np.pi * COLOUR, normal=normal)


def test_world_reaches_a_disc_near_the_boxs_side():
    assert_irradiance(UniformWorld(COLOUR), np.pi * COLOUR, centre=(0.5, 0, -0.99), normal=(0, 0.01, 1), radius=0.4)


@pytest.mark.parametrize("tilt", [0.0, 1.0, 2.5])
def test_sky_without_ground(tilt):
    # the upper half of the picture shines: E = pi L (1 + cos tilt) / 2
    picture = np.zeros((8, 4, 3))
    picture[4:] = COLOUR
    normal = (np.sin(tilt), 0, np.cos(tilt))
    assert_irradiance(EnvironmentWorld(picture), np.pi * COLOUR * (1 + np.cos(tilt)) / 2, normal=normal)


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
