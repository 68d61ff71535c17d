"""What every light owes the tracer: valid particles, exact flux, its own density, and its sign. 100 000 particles."""

import numpy as np
import pytest
from detp.core.bounds import Bounds
from detp.core.errors import InvalidArrayError, InvalidSettingError
from detp.core.lights.area import AreaLight
from detp.core.lights.emissive import EmissiveTriangles
from detp.core.lights.environment import EnvironmentWorld
from detp.core.lights.light import EMISSION_DIMENSIONS
from detp.core.lights.point import PointLight
from detp.core.lights.spot import SpotLight
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from made_lights import AT, COLOUR, LEAST_P, LIGHTS, PICTURE, STRETCHED, assert_uniform, turn
from scipy.stats import chisquare

PARTICLES = 100_000
BOX = Bounds(np.array([-1.0, -2.0, 0.5]), np.array([2.0, 1.0, 1.5]))
FLAT = Bounds(np.array([-1.0, -2.0, 0.5]), np.array([2.0, 1.0, 0.5]))
CORNERS = np.array(
    [
        [(0, 0, 0), (1, 0, 0), (0, 2, 0)],
        [(0, 0, 1), (0, 1, 1), (0, 1, 3)],
        [(1, 1, 1), (2, 2, 2), (3, 3, 3)],
        [(5, 5, 5), (5, 5, 5), (5, 5, 5)],
    ],
    float,
)
GLOW = np.array([(1, 0.5, 0.0), (0.2, 3, 1), (9, 9, 9), (9, 9, 9)])

MAKERS = LIGHTS | {
    "spot of half the sphere": lambda s: SpotLight(AT, (1, 2, -3), s * COLOUR, np.pi, 0.0, 0.2),
    "spot narrow": lambda s: SpotLight(AT, (0, 0, 1), s * COLOUR, np.radians(1), 1.0),
    "spot stretched far": lambda s: SpotLight(AT, np.diag((20.0, 1.0, 1.0)), s * COLOUR, 2.4, 0.15),
    "sun on the horizon": lambda s: SunLight((1, 0, -0.05), s * COLOUR, 0.3),
    "sun of half the sky": lambda s: SunLight((0.5, 0.7, -1), s * COLOUR, np.pi),
    "triangles without area": lambda s: EmissiveTriangles(CORNERS, s * GLOW),
    "world": lambda s: UniformWorld(s * COLOUR),
}
DISTANT = ("sun", "sun wide", "sun on the horizon", "sun of half the sky", "world", "picture")

each_light = pytest.mark.parametrize("name", MAKERS)


def uniforms(count=PARTICLES, seed=1):
    return np.random.default_rng(seed).random((count, EMISSION_DIMENSIONS))


@each_light
@pytest.mark.parametrize("bounds", [BOX, FLAT], ids=["box", "flat box"])
def test_particles_are_valid_and_add_up_to_the_flux(name, bounds):
    light = MAKERS[name](1)
    particles = light.emit(uniforms(), bounds)
    for part in (particles.origins, particles.directions, particles.flux):
        assert part.shape == (PARTICLES, 3)
        assert np.isfinite(part).all()
    assert np.linalg.norm(particles.directions, axis=1) == pytest.approx(1, abs=1e-12)
    flux = light.flux(bounds)
    assert flux.shape == (3,)
    assert (flux > 0).all()
    error = particles.flux.std(axis=0) * np.sqrt(PARTICLES)
    # 4.3: three sigma after Sidak for the 144 comparisons of this test; the second term: rounding of equal terms
    assert (np.abs(particles.flux.sum(axis=0) - flux) < 4.3 * error + 1e-9 * flux).all()


@each_light
def test_negative_and_black_lights(name):
    numbers = uniforms(1000)
    plus = MAKERS[name](1).emit(numbers, BOX)
    minus = MAKERS[name](-1).emit(numbers, BOX)
    assert minus.flux == pytest.approx(-plus.flux)
    assert minus.origins == pytest.approx(plus.origins)
    assert MAKERS[name](-1).flux(BOX) == pytest.approx(-MAKERS[name](1).flux(BOX))
    black = MAKERS[name](0)
    dark = black.emit(numbers, BOX)
    assert not black.flux(BOX).any()
    assert not dark.flux.any()
    assert np.isfinite(dark.origins).all()
    assert np.linalg.norm(dark.directions, axis=1) == pytest.approx(1)


@each_light
def test_each_row_depends_on_its_own_uniforms_alone(name):
    numbers = uniforms(1000)
    light = MAKERS[name](1)
    whole, part = light.emit(numbers, BOX), light.emit(numbers[100:200], BOX)
    assert (whole.origins[100:200] == part.origins).all()
    assert (whole.directions[100:200] == part.directions).all()
    assert whole.flux[100:200] * 10 == pytest.approx(part.flux)


@each_light
def test_extreme_uniforms_are_harmless(name):
    edge = np.nextafter(1, 0)
    numbers = np.stack(np.meshgrid(*[[0.0, 0.5, edge]] * EMISSION_DIMENSIONS), axis=-1).reshape(-1, EMISSION_DIMENSIONS)
    for bounds in (BOX, FLAT, Bounds(BOX.lower, BOX.lower)):
        particles = MAKERS[name](1).emit(numbers, bounds)
        assert np.isfinite(particles.origins).all()
        assert np.isfinite(particles.flux).all()
        assert np.linalg.norm(particles.directions, axis=1) == pytest.approx(1)


@pytest.mark.parametrize("name", DISTANT)
@pytest.mark.parametrize("bounds", [BOX, FLAT], ids=["box", "flat box"])
def test_distant_lights_start_on_the_box_and_enter_it(name, bounds):
    particles = MAKERS[name](1).emit(uniforms(), bounds)
    assert ((particles.origins >= bounds.lower) & (particles.origins <= bounds.upper)).all()
    into = ((particles.origins == bounds.lower) & (particles.directions >= 0)) | (
        (particles.origins == bounds.upper) & (particles.directions <= 0)
    )
    assert into.any(axis=1).all()


def test_point_light_shines_all_around():
    x, y, z = MAKERS["point"](1).emit(uniforms(), BOX).directions.T
    assert_uniform(0.5 + 0.5 * z, turn(x, y))


def test_a_sphere_starts_its_particles_across_their_direction():
    light = MAKERS["point sphere"](1)
    particles = light.emit(uniforms(), BOX)
    offset = particles.origins - light.position
    assert np.einsum("ij,ij->i", offset, particles.directions) == pytest.approx(0, abs=1e-12)
    assert_uniform((offset**2).sum(axis=1) / light.radius**2, 0.5 + 0.5 * particles.directions[:, 2])


@pytest.mark.parametrize("size", [np.radians(1), 0.8, np.pi])
@pytest.mark.parametrize("blend", [0.0, 0.15, 1.0])
def test_spot_follows_its_intensity(size, blend):
    light = SpotLight(AT, (0, 0, -1), COLOUR, size, blend)
    x, y, _ = light.emit(uniforms(), BOX).directions.T
    # the density's integral by a fine midpoint sum over the fall 1 - cos a
    fall = 1 - np.sqrt(1 - x * x - y * y) if size > 0.1 else 0.5 * (x * x + y * y)
    whole = 2 * np.sin(size / 4) ** 2
    steps = (np.arange(100_000) + 0.5) / 100_000
    t = np.clip((1 - steps) / max(blend, 1e-12), 0, 1)
    within = np.concatenate([[0], np.cumsum(t * t * (3 - 2 * t))])
    assert_uniform(np.interp(fall / whole, np.linspace(0, 1, 100_001), within / within[-1]), turn(x, y))
    assert light.flux(BOX) == pytest.approx(COLOUR / 2 * whole * within[-1] / 100_000, rel=1e-6)


def test_a_spot_of_no_size_gives_nothing():
    light = SpotLight(AT, (0, 0, -1), COLOUR, 0.0, 0.5)
    assert not light.flux(BOX).any()
    assert not light.emit(uniforms(10), BOX).flux.any()


def test_a_spots_matrix_counts_by_its_shape_alone():
    light, larger = (SpotLight(AT, scale * STRETCHED, COLOUR, 1.5, 0.4) for scale in (1, 100))
    assert larger.flux(BOX) == pytest.approx(light.flux(BOX))
    turned = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0.0]])
    plain = SpotLight(AT, (0, 1, 0), COLOUR, 1.5, 0.4)
    assert SpotLight(AT, 3 * turned, COLOUR, 1.5, 0.4).flux(BOX) == pytest.approx(plain.flux(BOX))
    assert SpotLight(AT, 3 * turned, COLOUR, 0.1, 0.4).emit(uniforms(99), BOX).directions[:, 1].min() > 0.99


@pytest.mark.parametrize("half", [0.005, 0.5, np.pi / 2])
def test_sun_fills_its_cone_evenly(half):
    light = SunLight((0, 0, -1), COLOUR, 2 * half)
    particles = light.emit(uniforms(), BOX)
    x, y, z = particles.directions.T
    assert_uniform(0.5 * (x * x + y * y + (z + 1) ** 2) / (2 * np.sin(half / 2) ** 2), turn(x, y))


@pytest.mark.parametrize("half", [1e-7, 0.0046, 0.4, 1.2, np.pi / 2])
@pytest.mark.parametrize("height", [0.0, 1e-8, 0.1, 0.5, 1.0])
def test_suns_flux_is_its_mean_shadow_also_when_the_horizon_cuts_it(half, height):
    light = SunLight((np.cos(height), 0, -np.sin(height)), COLOUR, 2 * half)
    # midpoint sum over the cone of the shadow of a flat box, |cos|
    n = 1000
    fall, angle = np.meshgrid(
        (np.arange(n) + 0.5) / n * 2 * np.sin(half / 2) ** 2, (np.arange(n) + 0.5) / n * 2 * np.pi
    )
    z = np.sin(height) * (1 - fall) + np.cos(height) * np.sqrt(fall * (2 - fall)) * np.cos(angle)
    mean = np.abs(z).mean() * 2 / (1 + np.cos(half))
    # at 1e-7 the difference of large terms leaves an absolute error of some 1e-9
    assert light.flux(FLAT) == pytest.approx(COLOUR * 9 * mean, rel=1e-3, abs=1e-7)


def cosines(particles, normal):
    return particles.directions @ np.asarray(normal, float)


def test_lambert_area_light():
    particles = AreaLight(AT, (1, 0, 0), (0, 2, 0), COLOUR).emit(uniforms(), BOX)
    x, y, _ = particles.directions.T
    assert_uniform(cosines(particles, (0, 0, -1)) ** 2, turn(x, y))
    assert (particles.directions[:, 2] <= 0).all()
    place = particles.origins - AT
    assert_uniform(place[:, 0] + 0.5, place[:, 1] / 2 + 0.5)
    assert (place[:, 2] == 0).all()


def test_area_light_in_a_sheared_frame():
    light = AreaLight(AT, (1, 0.2, 0), (0.7, 2, -1), COLOUR, "ellipse")
    cross = np.cross((1, 0.2, 0), (0.7, 2, -1))
    assert light.area == pytest.approx(np.pi / 4 * np.linalg.norm(cross))
    assert light.normal == pytest.approx(-cross / np.linalg.norm(cross))
    particles = light.emit(uniforms(), BOX)
    edges = np.stack([light.edge_u, light.edge_v], axis=1)
    place, residual, *_ = np.linalg.lstsq(edges, (particles.origins - AT).T, rcond=None)
    assert residual.sum() < 1e-20
    assert_uniform(4 * (place**2).sum(axis=0), turn(*place))
    assert_uniform(cosines(particles, light.normal) ** 2)


@pytest.mark.parametrize("degrees", [1, 45, 90, 150, 179.9])
def test_area_spread_follows_its_formula(degrees):
    half = np.radians(degrees) / 2
    particles = AreaLight(AT, (1, 0, 0), (0, 2, 0), COLOUR, spread=2 * half).emit(uniforms(), BOX)
    x, y, _ = particles.directions.T
    angle = np.arcsin(np.hypot(x, y))
    assert angle.max() <= half * (1 + 1e-9)
    # the density's integral by a midpoint sum, evenly spaced in sin t
    sine = np.linspace(0, np.sin(half), 100_001)
    middle = 0.5 * (sine[1:] + sine[:-1])
    within = np.concatenate([[0], np.cumsum((np.tan(half) - np.tan(np.arcsin(middle))) * middle)])
    assert_uniform(np.interp(np.sin(angle), sine, within / within[-1]), turn(x, y))


def test_nearly_parallel_and_nearly_lambert_spreads_meet_their_limits():
    beam = AreaLight(AT, (1, 0, 0), (0, 2, 0), COLOUR, spread=1e-9).emit(uniforms(9), BOX)
    assert (beam.directions == (0, 0, -1)).all()
    numbers = uniforms()
    for spread in (np.float32(np.pi), np.pi - 1e-5):
        wide = AreaLight(AT, (1, 0, 0), (0, 2, 0), COLOUR, spread=spread).emit(numbers, BOX)
        assert_uniform(cosines(wide, (0, 0, -1)) ** 2)


def test_emissive_triangles_are_chosen_by_power_and_filled_evenly():
    light = EmissiveTriangles(CORNERS, GLOW)
    areas = np.array([1.0, 1.0, 0, 0])
    assert light.flux(BOX) == pytest.approx(2 * np.pi * areas @ GLOW)
    particles = light.emit(uniforms(), BOX)
    first = particles.origins[:, 2] == 0
    second = particles.origins[:, 0] == 0
    assert (first ^ second).all()
    assert chisquare([first.sum(), second.sum()], PARTICLES * np.array([0.25, 0.75])).pvalue > LEAST_P
    total = particles.flux[first].sum(axis=0), particles.flux[second].sum(axis=0)
    assert total[0] / total[0][0] == pytest.approx(GLOW[0])
    assert total[1] / total[1][1] == pytest.approx(GLOW[1] / 3)
    x, y, _ = particles.origins[first].T
    assert_uniform((1 - x) ** 2, (y / 2) / (1 - x))
    for triangle, normal in ((first, (0, 0, 1)), (second, (1, 0, 0))):
        up = particles.directions[triangle] @ np.array(normal, float)
        assert_uniform(up**2)
        front = int((up > 0).sum())
        assert chisquare([front, len(up) - front]).pvalue > LEAST_P


def test_triangles_of_both_signs_share_the_particles_by_size():
    light = EmissiveTriangles(CORNERS[:2], [(1, 1, 1), (-1, -1, -1)])
    assert light.flux(BOX) == pytest.approx(0, abs=1e-12)
    flux = light.emit(uniforms(), BOX).flux
    assert np.abs(flux) == pytest.approx(4 * np.pi / PARTICLES)


def test_triangles_without_area_give_valid_particles_and_no_flux():
    light = EmissiveTriangles(CORNERS[2:], GLOW[2:])
    particles = light.emit(uniforms(10), BOX)
    assert not light.flux(BOX).any()
    assert not particles.flux.any()
    assert np.linalg.norm(particles.directions, axis=1) == pytest.approx(1)


def test_uniform_world_enters_everywhere_alike():
    particles = MAKERS["world"](1).emit(uniforms(), BOX)
    faces = [(k, end) for k in range(3) for end in (BOX.lower, BOX.upper)]
    counts = []
    for k, end in faces:
        here = particles.origins[:, k] == end[k]
        counts.append(int(here.sum()))
        place = (particles.origins[here] - BOX.lower) / BOX.size
        assert_uniform(place[:, (k + 1) % 3], particles.directions[here, k] ** 2)
    areas = np.repeat(BOX.face_areas, 2)
    assert chisquare(counts, PARTICLES * areas / areas.sum()).pvalue > LEAST_P


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (7, 5), (64, 128)], ids=str)
@pytest.mark.parametrize("bounds", [BOX, FLAT], ids=["box", "flat box"])
def test_constant_picture_is_the_uniform_world(size, bounds):
    world, picture = UniformWorld(COLOUR), EnvironmentWorld(np.tile(COLOUR, (*size, 1)))
    assert picture.flux(bounds) == pytest.approx(world.flux(bounds), rel=1e-12)
    one, other = (light.emit(uniforms(seed=s), bounds) for s, light in enumerate((world, picture)))
    for k in range(3):
        edges = np.linspace(-1, 1, 11)
        sums = [
            np.stack([np.histogram(p.directions[:, k], edges, weights=p.flux[:, 0] ** n)[0] for n in (1, 2)])
            for p in (one, other)
        ]
        difference = sums[0][0] - sums[1][0]
        # Bonferroni over the 10 bins x 3 axes x 8 cases
        assert (np.abs(difference) <= 4.3 * np.sqrt(sums[0][1] + sums[1][1])).all()


def test_picture_lies_as_cycles_lays_it():
    """Flux by pixel, each particle looked up as Cycles' direction_to_equirectangular does: z-test of 40 pixels.

    Expected: L x the integral over the pixel of the box's shadow, by a midpoint sum. 4 sigma: Sidak for 120 tests.
    """
    light = EnvironmentWorld(PICTURE)
    height, width, _ = PICTURE.shape
    particles = light.emit(uniforms(), BOX)
    x, y, z = -particles.directions.T
    u = -np.arctan2(y, x) / (2 * np.pi) + 0.5
    v = np.arctan2(z, np.hypot(x, y)) / np.pi + 0.5
    pixel = (v * height).astype(int) * width + (u * width).astype(int)
    n = 200
    fine_v, fine_u = np.meshgrid(
        (np.arange(height * n) + 0.5) / (height * n), (np.arange(width * n) + 0.5) / (width * n), indexing="ij"
    )
    latitude, azimuth = np.pi * (fine_v - 0.5), 2 * np.pi * (0.5 - fine_u)
    looking = np.stack([np.cos(latitude) * np.cos(azimuth), np.cos(latitude) * np.sin(azimuth), np.sin(latitude)], -1)
    shadow = np.abs(looking) @ BOX.face_areas * np.cos(latitude) * (np.pi / (height * n)) * (2 * np.pi / (width * n))
    shadow = shadow.reshape(height, n, width, n).sum(axis=(1, 3)).ravel()
    for channel in range(3):
        got = np.bincount(pixel, particles.flux[:, channel], height * width)
        error = np.sqrt(np.bincount(pixel, particles.flux[:, channel] ** 2, height * width))
        assert (np.abs(got - PICTURE[..., channel].ravel() * shadow) <= 4.0 * error + 1e-6).all()


@pytest.mark.parametrize(
    ("size", "row", "column", "looking"),
    [
        ((1001, 1000), 0, 0, (0, 0, -1)),
        ((1001, 1000), 1000, 0, (0, 0, 1)),
        ((1001, 1001), 500, 500, (1, 0, 0)),
        ((1001, 1001), 500, 250, (0, 1, 0)),
        ((1001, 1001), 500, 750, (0, -1, 0)),
        ((1001, 1001), 500, 0, (-1, 0, 0)),
    ],
)
def test_where_single_pixels_look(size, row, column, looking):
    picture = np.zeros((*size, 3))
    picture[row, column] = 1
    particles = EnvironmentWorld(picture).emit(uniforms(100), BOX)
    assert particles.directions == pytest.approx(np.tile(np.negative(looking), (100, 1)), abs=0.01)


WRONG = {
    InvalidArrayError: [
        lambda: PointLight((0, 0), COLOUR),
        lambda: PointLight((0, 0, np.nan), COLOUR),
        lambda: PointLight(AT, (1, 2, np.inf)),
        lambda: SpotLight(AT, (0, 0, 0), COLOUR, 1, 0),
        lambda: SpotLight(AT, np.diag((1, 0, 1)), COLOUR, 1, 0),
        lambda: SunLight((0, 0, 0), COLOUR),
        lambda: SunLight((0, 0, -1), 3.0),
        lambda: AreaLight(AT, (1, 0, 0), (2, 0, 0), COLOUR),
        lambda: AreaLight(AT, (1, 0, 0), (0, 0, 0), COLOUR),
        lambda: EmissiveTriangles(np.zeros((2, 3)), np.zeros((2, 3))),
        lambda: EmissiveTriangles(np.zeros((0, 3, 3)), np.zeros((0, 3))),
        lambda: EmissiveTriangles(CORNERS, GLOW[:2]),
        lambda: EmissiveTriangles(CORNERS, GLOW * np.nan),
        lambda: UniformWorld((1, 2)),
        lambda: EnvironmentWorld(np.zeros((4, 3))),
        lambda: EnvironmentWorld(np.zeros((0, 4, 3))),
        lambda: EnvironmentWorld(np.full((2, 4, 3), np.nan)),
    ],
    InvalidSettingError: [
        lambda: PointLight(AT, COLOUR, -1),
        lambda: PointLight(AT, COLOUR, np.inf),
        lambda: PointLight(AT, COLOUR, "wide"),
        lambda: SpotLight(AT, (0, 0, 1), COLOUR, 4.0, 0),
        lambda: SpotLight(AT, (0, 0, 1), COLOUR, 1.0, 1.5),
        lambda: SpotLight(AT, (0, 0, 1), COLOUR, np.nan, 0.5),
        lambda: SunLight((0, 0, 1), COLOUR, -0.1),
        lambda: AreaLight(AT, (1, 0, 0), (0, 1, 0), COLOUR, "disk"),
        lambda: AreaLight(AT, (1, 0, 0), (0, 1, 0), COLOUR, spread=3.3),
    ],
}


@pytest.mark.parametrize(("error", "make"), [(error, make) for error, makers in WRONG.items() for make in makers])
def test_what_is_wrong_is_named(error, make):
    with pytest.raises(error):
        make()


def test_the_float32_pi_of_blender_is_a_valid_angle():
    pi = float(np.float32(np.pi))
    assert pi > np.pi
    assert SunLight((0, 0, 1), COLOUR, pi).angle == np.pi
    assert SpotLight(AT, (0, 0, 1), COLOUR, pi, 0.1).size == np.pi
    assert AreaLight(AT, (1, 0, 0), (0, 1, 0), COLOUR, spread=pi).spread == np.pi
