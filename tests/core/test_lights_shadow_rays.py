"""What every light owes a point that asks it: the same light as its photons bring, by rays of the density it states."""

import numpy as np
import pytest
from detp.core.bounds import Bounds
from detp.core.crossing import crosses
from detp.core.errors import InvalidArrayError
from detp.core.lights.area import AreaLight
from detp.core.lights.emissive import EmissiveTriangles
from detp.core.lights.environment import EnvironmentWorld
from detp.core.lights.light import EMISSION_DIMENSIONS, SHADOW_DIMENSIONS
from detp.core.lights.point import PointLight
from detp.core.lights.spot import SpotLight
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from detp.core.sampling import disc, frames, sphere
from made_lights import (
    AT,
    COLOUR,
    CORNERS,
    GLOW,
    LEAST_P,
    LIGHTS,
    PICTURE,
    SHEARED,
    STRETCHED,
    UP,
    assert_uniform,
    turn,
)
from scipy.stats import chisquare

RAYS = 40_000
PARTICLES = 150_000
BOX = Bounds(np.array([-1.0, -1.0, -1.0]), np.array([1.0, 1.0, 1.0]))
SHARP = ("point", "spot", "spot hard", "sun", "beam")
each_light = pytest.mark.parametrize("name", LIGHTS)


def unit(vector):
    return np.asarray(vector, float) / np.linalg.norm(vector)


def numbers(count=RAYS, seed=1):
    return np.random.default_rng(seed).random((count, SHADOW_DIMENSIONS))


def rays_from(light, point, count=RAYS, seed=1):
    return light.shadow_rays(np.tile(np.asarray(point, float), (count, 1)), numbers(count, seed))


def irradiance(rays, normal=UP):
    """What each ray says about the irradiance (K, 3) on a surface with ``normal``."""
    return rays.radiance * (np.maximum(rays.directions @ unit(normal), 0) / rays.density)[:, None]


def assert_irradiance(light, expected, point=(0, 0, 0), normal=UP):
    each = irradiance(rays_from(light, point), normal)
    mean, error = each.mean(axis=0), each.std(axis=0) / np.sqrt(RAYS)
    expected = np.broadcast_to(expected, 3)
    z = (mean - expected) / (error + 1e-12 * np.abs(expected) + 1e-300)
    print(f"E {mean} +- {error}, expected {expected}, z {z}")
    # Sidak for some 40 cases of which the channels are one
    assert (np.abs(z) < 3.5).all()
    assert (error < 0.02 * np.abs(expected) + 1e-300).all(), "too noisy to say anything"


# --- the contract ---


@each_light
def test_rays_are_valid_and_each_depends_on_its_own_row_alone(name):
    generator = np.random.default_rng(2)
    points, uniforms = generator.uniform(-1, 1, (2000, 3)), numbers(2000)
    light = LIGHTS[name](1)
    rays, part = light.shadow_rays(points, uniforms), light.shadow_rays(points[100:200], uniforms[100:200])
    assert_valid(rays, 2000)
    for field in ("directions", "distances", "radiance", "density"):
        assert (getattr(rays, field)[100:200] == getattr(part, field)).all()
    assert_valid(light.shadow_rays(points[:0], uniforms[:0]), 0)
    assert (rays.radiance != 0).any()


def assert_valid(rays, count):
    assert rays.directions.shape == rays.radiance.shape == (count, 3)
    assert rays.distances.shape == rays.density.shape == (count,)
    assert np.linalg.norm(rays.directions, axis=1) == pytest.approx(1, abs=1e-12)
    assert np.isfinite(rays.radiance).all()
    assert np.isfinite(rays.density).all()
    assert (rays.density > 0).all()
    assert (rays.distances >= 0).all()
    assert np.isfinite(rays.radiance / rays.density[:, None]).all()


@each_light
def test_sharp_lights_and_only_those_give_one_ray_whatever_the_numbers(name):
    light = LIGHTS[name](1)
    rays = rays_from(light, (0.1, 0.05, 0), 100)
    assert light.sharp == (name in SHARP)
    assert light.sharp == (rays.directions == rays.directions[0]).all()
    if light.sharp:
        assert (rays.radiance == rays.radiance[0]).all()
        assert (rays.density == 1).all()


@each_light
def test_negative_and_black_lights(name):
    plus, minus, black = (rays_from(LIGHTS[name](s), (0.1, 0.05, 0), 1000) for s in (1, -1, 0))
    assert (minus.radiance == -plus.radiance).all()
    assert (minus.directions == plus.directions).all()
    assert (minus.density == plus.density).all()
    assert not black.radiance.any()
    assert_valid(black, 1000)


def test_lights_are_told_apart_by_identity():
    lights = [PointLight(AT, COLOUR), PointLight(AT, COLOUR, 1.0)]
    assert lights.index(lights[1]) == 1
    assert lights[0] not in lights[1:]
    assert len(set(lights)) == 2


# --- shadow rays bring what photons bring ---


@each_light
def test_shadow_rays_agree_with_photons(name):
    """Mean over three discs in the open, by shadow rays from places on them and by the flux that crosses them."""
    light = LIGHTS[name](1)
    generator = np.random.default_rng(3)
    particles = light.emit(generator.random((PARTICLES, EMISSION_DIMENSIONS)), BOX)
    starts = particles.origins
    if particles.start is not None:
        starts = starts + particles.start[:, None] * particles.directions
    ends = starts + 100 * particles.directions
    radius, lit = 0.4, 0
    for centre, normal in (((0.1, 0.1, 0), (0.1, 0.2, 1)), ((-0.4, 0.2, 0.1), (1, 0, 0.4)), ((0.2, -0.3, -0.2), UP)):
        centre, normal = np.array(centre, float), unit(normal)
        hit = crosses(starts, ends, centre, normal, radius)
        photons = np.where(hit[:, None], particles.flux, 0) * (PARTICLES / (np.pi * radius**2))
        first, second = frames(normal)
        place = radius * disc(generator.random((RAYS, 2)))
        points = centre + place[:, :1] * first + place[:, 1:] * second
        rays = irradiance(light.shadow_rays(points, generator.random((RAYS, 2))), normal)
        difference = photons.mean(axis=0) - rays.mean(axis=0)
        error = np.sqrt(photons.var(axis=0) / PARTICLES + rays.var(axis=0) / RAYS)
        print(f"photons {photons.mean(axis=0)} rays {rays.mean(axis=0)} +- {error}, {int(hit.sum())} photons")
        # Sidak for 17 lights x 3 discs x 3 channels at 0.5 %
        assert (np.abs(difference) <= 4.2 * error).all()
        lit += bool((error < 0.03 * np.abs(rays.mean(axis=0))).all())
    assert lit >= 1


# --- the textbook ---


@pytest.mark.parametrize("radius", [0.0, 0.3], ids=["point", "sphere"])
@pytest.mark.parametrize("sign", [1, -1])
def test_point_and_sphere_above_the_horizon(radius, sign):
    # a uniformly radiant sphere that stands above the plane acts as its centre
    distance = np.linalg.norm(AT)
    expected = sign * COLOUR / (4 * np.pi) * (AT @ unit((1, 0.5, 2))) / distance**3
    assert_irradiance(PointLight(AT, sign * COLOUR, radius), expected, normal=(1, 0.5, 2))


def test_sphere_that_touches_and_holds_the_point():
    # inside, every direction ends on the sphere: E = pi L, whatever the normal
    light, radiance = PointLight(AT, COLOUR, 0.5), COLOUR / (4 * np.pi**2 * 0.25)
    assert_irradiance(light, np.pi * radiance, AT + (0.1, 0.2, -0.1), (1, 2, 3))
    assert_irradiance(light, np.pi * radiance / 1.0001**2, AT - (0, 0, 0.50005))


@pytest.mark.parametrize("height", [1e-9, 0.1, 3.0])
def test_soft_falloff_straight_below(height):
    light = PointLight((0, 0, height), COLOUR, 0.4, True)
    assert_irradiance(light, COLOUR / (4 * np.pi * (height**2 + 0.16)))


@pytest.mark.parametrize(
    ("size", "blend"), [(1.2, 1.0), (1.0, 0.15), (0.8, 0.0), (np.pi, 0.5), (1e-5, 0.5), (0.0, 0.5)]
)
def test_spot_falls_off_by_its_formula(size, blend):
    angles = np.linspace(0, 1.1, 12) * size / 2
    points = 2 * np.stack([np.sin(angles), np.zeros(12), -np.cos(angles)], axis=1)
    rays = SpotLight((0, 0, 0), (0, 0, -1), COLOUR, size, blend).shadow_rays(points, numbers(12))
    # cos a - c = 2 sin((half - a) / 2) sin((half + a) / 2), exact in narrow cones
    above = 2 * np.sin((size / 2 - angles) / 2) * np.sin((size / 2 + angles) / 2)
    fall = 2 * np.sin(size / 4) ** 2
    t = np.clip(above / (fall * blend), 0, 1) if fall * blend > 0 else (above > 0) * 1.0
    expected = np.outer(t * t * (3 - 2 * t), COLOUR / (16 * np.pi))
    # the eleventh lies on the rim, where rounding may decide
    assert np.delete(rays.radiance, 10, axis=0) == pytest.approx(np.delete(expected, 10, axis=0), rel=1e-5)


def test_spot_of_a_scaled_lamp_is_round_in_its_own_space():
    own = np.random.default_rng(5).normal(size=(1000, 3))
    matrix = 7 * STRETCHED * (1, 1, -1)
    light = SpotLight((0, 0, 0), matrix, COLOUR, 1.5, 0.5)
    straight = SpotLight((0, 0, 0), np.eye(3), COLOUR, 1.5, 0.5)
    points = own @ matrix.T
    rays, round_rays = (lamp.shadow_rays(p, numbers(1000)) for lamp, p in ((light, points), (straight, own)))
    squares = [(p**2).sum(axis=1, keepdims=True) for p in (points, own)]
    assert rays.radiance * squares[0] == pytest.approx(round_rays.radiance * squares[1], abs=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-5, 0.0092, 0.8])
def test_sun_above_the_horizon(angle):
    direction = unit((0.3, 0.2, -1))
    assert_irradiance(
        SunLight(direction, COLOUR, angle), -(unit((1, -0.5, 1)) @ direction) * COLOUR, normal=(1, -0.5, 1)
    )


def test_sun_of_half_the_sky_and_cut_by_the_horizon():
    direction = unit((0.3, 0.2, -1))
    assert_irradiance(SunLight(direction, COLOUR, np.pi), COLOUR, normal=-direction)
    # the hemisphere around the horizon: half of pi L
    assert_irradiance(SunLight((1, 0, 0), COLOUR, np.pi), COLOUR / 2)


def corner_factor(a, b):
    p, q = np.sqrt(1 + a * a), np.sqrt(1 + b * b)
    return (a / p * np.arctan(b / p) + b / q * np.arctan(a / q)) / (2 * np.pi)


@pytest.mark.parametrize(
    ("x", "y", "height"),
    [
        ((-0.2, 0.5), (0.1, 0.4), 0.6),
        ((-0.2, 0.5), (-0.3, 0.4), 1e-3),
        ((-0.2, 0.5), (-0.3, 0.4), 1e-9),
        ((0.0, 0.5), (0.0, 0.4), 0.2),
        ((2.0, 2.5), (-0.1, 0.4), 0.7),
        ((-0.2, 0.5), (0.1, 0.4), 30.0),
        ((-30.0, 20.0), (-0.001, 0.002), 0.5),
    ],
)
def test_parallel_rectangle(x, y, height):
    (a0, a1), (b0, b1) = np.divide(x, height), np.divide(y, height)
    factor = corner_factor(a1, b1) - corner_factor(a0, b1) - corner_factor(a1, b0) + corner_factor(a0, b0)
    area = (x[1] - x[0]) * (y[1] - y[0])
    light = AreaLight((sum(x) / 2, sum(y) / 2, height), (x[1] - x[0], 0, 0), (0, y[1] - y[0], 0), COLOUR)
    assert_irradiance(light, COLOUR / area * factor)


def test_perpendicular_rectangle():
    # a wall of height a at distance c that starts at the floor, from 0 to b
    a, b, c = 0.8, 0.5, 0.6
    w = np.hypot(a, c)
    factor = (np.arctan(b / c) - c / w * np.arctan(b / w)) / (2 * np.pi)
    light = AreaLight((c, b / 2, a / 2), (0, b, 0), (0, 0, a), COLOUR)
    assert_irradiance(light, COLOUR / (a * b) * factor)


@pytest.mark.parametrize("height", [1e-6, 0.05, 0.7, 20])
def test_coaxial_disc(height, size=0.4):
    light = AreaLight((0, 0, height), (2 * size, 0, 0), (0, 2 * size, 0), COLOUR, "ellipse")
    assert_irradiance(light, COLOUR / (np.pi * size**2) * size**2 / (size**2 + height**2))


@pytest.mark.parametrize("shape", ["rectangle", "ellipse"])
@pytest.mark.parametrize("edge", [(0, 3.0, 0), (1.0, 3.0, 0)], ids=["upright", "sheared"])
@pytest.mark.parametrize("spread", [0.0, 2e-3, 0.3, 1.5])
def test_below_a_light_wider_than_its_spread(shape, edge, spread):
    # the whole cone of each place shines: E = power / A as in a parallel beam
    light = AreaLight((0.1, 0, 0.4), (2.5, 0, 0), edge, COLOUR, shape, spread)
    assert_irradiance(light, COLOUR / light.area)


@pytest.mark.parametrize(("degrees", "cycles"), [(120, 7.26363), (90, 12.67039), (45, 42.49672)])
def test_spread_as_cycles_bakes_it(degrees, cycles):
    # 10 W, 0.4 m x 0.2 m, 1 m above the receiver: Blender 4.5.15, 4096 samples, direct DIFFUSE bake, no colour, x pi
    light = AreaLight((0, 0, 1), (0.4, 0, 0), (0, 0.2, 0), (10, 10, 10), spread=np.radians(degrees))
    each = irradiance(rays_from(light, (0, 0, 0)))[:, 0]
    # Cycles' own figure is known to some 0.05 %
    assert abs(each.mean() - cycles) < 3 * each.std() / np.sqrt(RAYS) + 5e-4 * cycles


def test_a_beam_ends_at_its_rim():
    light = AreaLight((0, 0, 1), (1, 0, 0), (0, 2, 0), COLOUR, "ellipse", 0.0)
    points = np.array([(0.49, 0, 0), (0.51, 0, 0), (0, 0.99, -5), (0, 1.01, 0), (0.4, 0.9, 0), (0, 0, 2)])
    rays = light.shadow_rays(points, numbers(6))
    assert (rays.radiance.any(axis=1) == [True, False, True, False, False, False]).all()
    assert rays.distances[[0, 2]] == pytest.approx([1, 6])
    assert (rays.directions == UP).all()


def lambert(corners, normal):
    """Form factor of a triangle above the horizon of the origin, by Lambert's polygon formula."""
    towards = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    cross = np.cross(towards, np.roll(towards, -1, axis=0))
    length = np.linalg.norm(cross, axis=1)
    angles = np.arctan2(length, (towards * np.roll(towards, -1, axis=0)).sum(axis=1))
    return abs((angles / length) @ cross @ normal) / (2 * np.pi)


@pytest.mark.parametrize("order", [1, -1], ids=["front", "back"])
def test_emissive_triangles(order):
    factors = [lambert(triangle, UP) for triangle in CORNERS]
    assert_irradiance(EmissiveTriangles(CORNERS[:, ::order], GLOW), np.pi * (factors @ GLOW))


def test_worlds():
    assert_irradiance(EnvironmentWorld(np.tile(COLOUR, (6, 9, 1))), np.pi * COLOUR, normal=(1, -2, -0.5))
    # the upper half of the picture shines: E = pi L (1 + cos tilt) / 2
    picture = np.zeros((8, 4, 3))
    picture[4:] = COLOUR
    light = EnvironmentWorld(picture)
    for tilt in (0.0, 1.0, 2.5):
        assert_irradiance(light, np.pi * COLOUR * (1 + np.cos(tilt)) / 2, normal=(np.sin(tilt), 0, np.cos(tilt)))


@pytest.mark.parametrize("name", [name for name in LIGHTS if name not in ("sun", "sun wide", "picture", "beam")])
def test_lights_far_away_are_points(name):
    # z-test of E r^2 / cos at 1e7 m against the same at 1e5 m
    light, way = LIGHTS[name](1), unit((-0.1, 0.15, -1))
    found = []
    for distance in (1e5, 1e7):
        each = irradiance(rays_from(light, AT + distance * way), -way) * distance**2
        found.append((each.mean(axis=0), each.var(axis=0) / RAYS))
    error = np.sqrt(found[0][1] + found[1][1])
    assert (found[0][0] != 0).all()
    assert (np.abs(found[1][0] - found[0][0]) <= 4 * error + 1e-5 * np.abs(found[0][0])).all()


# --- directions have the density they state ---


def about(axis, directions):
    """1 - cos of the angle from ``axis``, exact for small ones, and the share of a turn."""
    axis = unit(axis)
    first, second = frames(axis)
    fall = 0.5 * ((directions - axis) ** 2).sum(axis=1)
    return fall, turn(directions @ first, directions @ second)


@pytest.mark.parametrize(
    ("light", "point", "axis", "fall"),
    [
        (SunLight((0.3, 0.2, -1), COLOUR, 2.0), (0, 0, 0), (-0.3, -0.2, 1), 1 - np.cos(1.0)),
        (SunLight((0.3, 0.2, -1), COLOUR, 1e-3), (0, 0, 0), (-0.3, -0.2, 1), 2 * np.sin(2.5e-4) ** 2),
        (PointLight(AT, COLOUR, 0.2), (0, 0, 0), AT, 1 - np.sqrt(1 - 0.04 / (AT @ AT))),
        (PointLight(AT, COLOUR, 0.2), AT + (0.1, 0, 0), (-1, 0, 0), 2.0),
        (PointLight(AT, COLOUR, 0.2, True), (0, 0, 0), AT, 1 - np.sqrt(AT @ AT / (AT @ AT + 0.04))),
        (PointLight(AT, COLOUR, 0.2, True), AT + (0.1, 0, 0), (-1, 0, 0), 1 - np.sqrt(0.2)),
    ],
    ids=["sun", "small sun", "sphere", "inside the sphere", "soft", "soft nearby"],
)
def test_cones_are_filled_evenly(light, point, axis, fall):
    rays = rays_from(light, point)
    fallen, turned = about(axis, rays.directions)
    assert_uniform(fallen / fall, turned)
    assert rays.density == pytest.approx(1 / (2 * np.pi * fall))


def test_rays_end_on_the_sphere_or_the_disc():
    for soft in (False, True):
        rays = rays_from(PointLight(AT, COLOUR, 0.2, soft), (0, 0, 0), 1000)
        place = rays.directions * rays.distances[:, None] - AT
        if soft:
            assert place @ unit(AT) == pytest.approx(0, abs=1e-12)
            assert (np.linalg.norm(place, axis=1) <= 0.2 + 1e-12).all()
        else:
            assert np.linalg.norm(place, axis=1) == pytest.approx(0.2)
            assert (place @ unit(AT) < 0).all()
    inside = rays_from(PointLight(AT, COLOUR, 0.2), AT + (0.1, 0, 0), 1000)
    assert np.linalg.norm(inside.directions * inside.distances[:, None] + (0.1, 0, 0), axis=1) == pytest.approx(0.2)


def solid_angle_from_corner(x, y, height):
    return np.arctan(x * y / (height * np.sqrt(x * x + y * y + height * height)))


@pytest.mark.parametrize(
    ("centre", "edges", "spread"),
    [
        ((0.3, -0.2, 0.5), (1.0, 2.0), np.pi),
        ((0.1, 0.2, 0.01), (1.0, 2.0), np.pi),
        ((1.3, 0.2, 0.1), (1.0, 2.0), np.pi),
        ((0.3, -0.2, 30.0), (1.0, 2.0), np.pi),
        ((0.1, 0.5, 0.5), (1.0, 2.0), 1.0),
    ],
    ids=["near", "close", "beside", "far", "clipped to its spread"],
)
def test_rectangles_are_filled_evenly_by_solid_angle(centre, edges, spread):
    light = AreaLight(centre, (edges[0], 0, 0), (0, edges[1], 0), COLOUR, spread=spread)
    rays = rays_from(light, (0, 0, 0))
    place = rays.directions[:, :2] * rays.distances[:, None]
    assert rays.directions[:, 2] * rays.distances == pytest.approx(centre[2])
    reach = centre[2] * np.tan(spread / 2) if spread < np.pi else np.inf
    low = np.maximum(np.subtract(centre[:2], np.divide(edges, 2)), -reach)
    high = np.minimum(np.add(centre[:2], np.divide(edges, 2)), reach)
    x, y = (np.linspace(low[k], high[k], 13) for k in (0, 1))
    counts, *_ = np.histogram2d(*place.T, bins=(x, y))
    corners = solid_angle_from_corner(*np.meshgrid(x, y, indexing="ij"), centre[2])
    cells = np.diff(np.diff(corners, axis=0), axis=1).ravel()
    # a far rectangle is filled by area, and each direction says by which density
    lit = rays.radiance.any(axis=1)
    assert rays.density[lit] == pytest.approx(1 / cells.sum(), rel=1e-2 if centre[2] > 10 else 1e-9)
    likely = cells > 5 / RAYS * cells.sum()
    expected = np.append(cells[likely], cells[~likely].sum()) * RAYS / cells.sum()
    found = np.append(counts.ravel()[likely], RAYS - counts.ravel()[likely].sum())
    kept = expected > 0
    assert chisquare(found[kept], expected[kept] * found.sum() / expected[kept].sum()).pvalue > LEAST_P


@pytest.mark.parametrize("shape", ["rectangle", "ellipse"])
def test_other_areas_are_filled_evenly_by_area(shape):
    light = AreaLight(AT, *SHEARED, COLOUR, shape)
    rays = rays_from(light, (0, 0, 0))
    edges = np.stack(SHEARED, axis=1)
    place, residual, *_ = np.linalg.lstsq(edges, (rays.directions * rays.distances[:, None] - AT).T, rcond=None)
    assert residual.sum() < 1e-20
    if shape == "ellipse":
        assert_uniform(4 * (place**2).sum(axis=0), np.arctan2(*place) / (2 * np.pi) + 0.5)
    else:
        assert_uniform(*(place + 0.5))
    cosine = -(rays.directions @ light.normal)
    assert rays.density == pytest.approx(rays.distances**2 / (cosine * light.area))


def test_emissive_triangles_are_chosen_by_power_and_filled_evenly():
    light = LIGHTS["emissive"](1)
    rays = rays_from(light, (0, 0, 0))
    place = rays.directions * rays.distances[:, None]
    areas = 0.5 * np.linalg.norm(np.cross(CORNERS[:, 1] - CORNERS[:, 0], CORNERS[:, 2] - CORNERS[:, 0]), axis=1)
    shares = areas * (1.0, 0.3)
    first = rays.radiance[:, 0] > 0
    assert chisquare([first.sum(), (~first).sum()], RAYS * shares / shares.sum()).pvalue > LEAST_P
    for corners, rows, area, share in zip(CORNERS, (first, ~first), areas, shares / shares.sum(), strict=True):
        weights = np.linalg.solve(corners.T, place[rows].T)
        assert weights.sum(axis=0) == pytest.approx(1)
        assert_uniform((1 - weights[0]) ** 2, weights[2] / (1 - weights[0]))
        normal = unit(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
        cosine = np.abs(rays.directions[rows] @ normal)
        assert rays.density[rows] == pytest.approx(share / area * rays.distances[rows] ** 2 / cosine)


def pixels(directions, height, width):
    """Row and column, and the place within each (0..1, by solid angle), as Cycles looks directions up."""
    x, y, z = directions.T
    u = (0.5 - np.arctan2(y, x) / (2 * np.pi)) * width
    v = (np.arcsin(z) / np.pi + 0.5) * height
    row = np.minimum(v.astype(int), height - 1)
    borders = np.sin(np.pi * (np.arange(height + 1) / height - 0.5))
    return row, np.minimum(u.astype(int), width - 1), (z - borders[row]) / np.diff(borders)[row], u % 1


def test_pixels_are_chosen_by_power_and_filled_evenly():
    light = LIGHTS["picture"](1)
    rays = rays_from(light, (0, 0, 0))
    row, column, up, across = pixels(rays.directions, 5, 8)
    assert (rays.radiance == PICTURE[row, column]).all()
    assert np.isinf(rays.distances).all()
    solid_angle = np.diff(np.sin(np.pi * (np.arange(6) / 5 - 0.5))) * np.pi / 4
    power = PICTURE.max(axis=2) * solid_angle[:, None]
    counts = np.bincount(row * 8 + column, minlength=40)
    assert chisquare(counts, RAYS * power.ravel() / power.sum()).pvalue > LEAST_P
    assert_uniform(up, across)
    assert rays.density == pytest.approx(PICTURE.max(axis=2)[row, column] / power.sum())


def test_evenly_spread_numbers_stay_spread_over_the_sky():
    # one number chooses the row, the other the column: a grid of numbers is a grid of directions
    steps = (np.arange(32) + 0.5) / 32
    u, v = np.meshgrid(steps, steps, indexing="ij")
    light = EnvironmentWorld(np.ones((16, 8, 3)))
    rays = light.shadow_rays(np.zeros((1024, 3)), np.stack([u.ravel(), v.ravel()], axis=1))
    z, turn = rays.directions[:, 2], np.arctan2(rays.directions[:, 1], rays.directions[:, 0])
    counts, *_ = np.histogram2d(z, turn, bins=32, range=[(-1, 1), (-np.pi, np.pi)])
    assert (counts == 1).all()


# --- what rays meet by chance ---


def test_emissive_triangles_met_have_the_density_of_being_aimed_at():
    light = EmissiveTriangles(CORNERS, GLOW, [3, 17])
    rays = rays_from(light, (0, 0, 0), 1000)
    first = rays.radiance[:, 0] > 0
    triangle = np.where(first, 3, 17)
    places = rays.directions * rays.distances[:, None]
    radiance, density = light.met(np.zeros((1000, 3)), rays.directions, triangle, places)
    assert (radiance == rays.radiance).all()
    assert density == pytest.approx(rays.density)
    for other in (-1, 0, 4, 18, 10**12):
        radiance, density = light.met(np.zeros((1000, 3)), rays.directions, np.full(1000, other), places)
        assert not radiance.any()
        assert not density.any()


def test_skies_met_have_the_density_of_being_aimed_at():
    light = LIGHTS["picture"](1)
    rays = rays_from(light, (0, 0, 0), 10_000)
    nothing, origin = np.full(10_000, -1), np.zeros((10_000, 3))
    radiance, density = light.met(origin, rays.directions, nothing, origin)
    assert (radiance == rays.radiance).all()
    assert density == pytest.approx(rays.density)
    radiance, density = light.met(origin, rays.directions, nothing + 1, origin)
    assert not radiance.any()
    assert not density.any()


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (64, 128)])
def test_the_density_of_a_sky_is_one_in_all(size):
    light = EnvironmentWorld(np.random.default_rng(6).random((*size, 3)))
    directions = sphere(numbers())
    _, density = light.met(np.zeros((RAYS, 3)), directions, np.full(RAYS, -1), directions)
    error = 4 * np.pi * density.std() / np.sqrt(RAYS)
    assert abs(4 * np.pi * density.mean() - 1) < 4 * error + 1e-9


def test_a_uniform_world_is_met_and_not_aimed_at():
    light = UniformWorld(COLOUR)
    triangle = np.array([-1, 0, -1, 7])
    radiance, density = light.met(np.zeros((4, 3)), np.tile(UP, (4, 1)), triangle, np.zeros((4, 3)))
    assert not light.aimed
    assert (radiance == np.where(triangle[:, None] < 0, COLOUR, 0)).all()
    assert not density.any()
    assert LIGHTS["picture"](1).aimed
    assert LIGHTS["emissive"](1).aimed


@pytest.mark.parametrize("rows", [[1], [2, 1], [1, 1], [-1, 1], [0.5, "x"]])
def test_rows_of_emissive_triangles_are_checked(rows):
    with pytest.raises(InvalidArrayError):
        EmissiveTriangles(CORNERS, GLOW, rows)


# --- extremes ---


def extreme_points():
    """On, in the plane of, behind, inside, and beside the lights, down to 1e-9 m and up to 1e9 m away."""
    offsets = [
        (0, 0, 0),
        (0.2, 0, 0),
        (0, 0, -0.2),
        (0.25, 0.15, 0.05),
        (0.25, 0, 0),
        (0, 0, 0.5),
        (3, 0, 0),
        (0, 3, 1),
    ]
    directions = [(1, 0, 0), (0, 0, 1), (0, 0, -1), (0, -1, 3), (0.2, 0.3, -0.5)]
    offsets += [tuple(size * unit(d)) for d in directions for size in (1e-300, 1e-20, 1e-9, 1e-4, 1e4, 1e9)]
    on = [AT + offset for offset in offsets] + [*CORNERS.reshape(-1, 3), *CORNERS.mean(axis=1)]
    return np.array([*on, *(CORNERS.mean(axis=1) + (0, 0, 1e-9)), (0, 0, 0), (1e9, 1e9, 1e9)])


@each_light
def test_extreme_places_and_numbers_are_harmless(name):
    points = extreme_points()
    last = np.nextafter(1.0, 0.0)
    uniforms = np.array([(a, b) for a in (0, 1e-300, 0.5, last) for b in (0, 0.25, last)] + [*numbers(20)])
    points, uniforms = np.repeat(points, len(uniforms), axis=0), np.tile(uniforms, (len(points), 1))
    for sign in (1, 0, -1):
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            light = LIGHTS[name](sign)
            rays = light.shadow_rays(points, uniforms)
            if hasattr(light, "met"):
                places = points + np.where(np.isinf(rays.distances), 0, rays.distances)[:, None] * rays.directions
                for triangle in (-1, 0, 1, 2):
                    radiance, density = light.met(points, rays.directions, np.full(len(points), triangle), places)
                    assert np.isfinite(radiance).all()
                    assert np.isfinite(density).all()
        assert_valid(rays, len(points))


@pytest.mark.parametrize(
    "make",
    [
        lambda: PointLight(AT, COLOUR, 1e-30),
        lambda: PointLight(AT, COLOUR, 1e-11),
        lambda: PointLight(AT, COLOUR, 1e9, True),
        lambda: SunLight((0, 0, -1), COLOUR, 1e-30),
        lambda: SunLight((0, 0, -1), COLOUR, 1.01e-6),
        lambda: SpotLight(AT, np.diag((1e-6, 1, 1e6)), COLOUR, 3.0, 0.1, 0.1),
        lambda: SpotLight(AT, (0, 0, -1), COLOUR, 1e-8, 1e-8),
        lambda: AreaLight(AT, (1e-7, 0, 0), (0, 1e3, 0), COLOUR),
        lambda: AreaLight(AT, (1e-9, 0, 0), (0, 1e-9, 0), COLOUR, spread=1e-2),
        lambda: AreaLight(AT, (1, 0, 0), (1, 1e-6, 0), COLOUR, "ellipse", np.pi - 1e-5),
        lambda: EmissiveTriangles(np.concatenate([CORNERS, np.zeros((1, 3, 3)), CORNERS[:1] * 1e-20]), np.ones((4, 3))),
        lambda: EmissiveTriangles(np.zeros((1, 3, 3)), np.ones((1, 3))),
        lambda: EnvironmentWorld(np.pad(np.full((1, 1, 3), 1e-9), ((3, 2), (4, 1), (0, 0)))),
    ],
)
def test_extreme_lights_are_harmless(make):
    points, uniforms = np.repeat(extreme_points(), 50, axis=0), np.tile(numbers(50), (len(extreme_points()), 1))
    with np.errstate(divide="raise", over="raise", invalid="raise"):
        rays = make().shadow_rays(points, uniforms)
    assert_valid(rays, len(points))


def test_points_behind_and_in_the_plane_of_an_area_light_are_dark():
    points = np.array([(0, 0, 1), (0, 0, 2), (5, 0, 1), (0.5, 1, 1), (0, 0, 1 + 1e-9), (0.1, 0.1, 1 - 1e-15)], float)
    for shape in ("rectangle", "ellipse"):
        for spread in (0.0, 1.0, np.pi):
            light = AreaLight((0, 0, 1), (1, 0, 0), (0, 2, 0), COLOUR, shape, spread)
            rays = light.shadow_rays(points, numbers(len(points)))
            assert not rays.radiance.any()
            assert (rays.density == 1).all()


def test_triangles_seen_edge_on_give_nothing():
    light = EmissiveTriangles([[(0, 0, 0), (1, 0, 0), (0, 1, 0)]], [COLOUR])
    points = np.array([(2, 0.3, 0), (-1, -1, 1e-12), (0.2, 0.2, 0)])
    rays = light.shadow_rays(points, numbers(3))
    assert not rays.radiance.any()
    assert (rays.density == 1).all()
