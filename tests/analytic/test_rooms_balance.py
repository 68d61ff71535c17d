"""Whole bakes against closed-form answers: furnace, energy balance, plates, bounce limit, colour, passage."""

import numpy as np
import pytest
from detp.core import parallel
from detp.core.bake import baked
from detp.core.lights.emissive import EmissiveTriangles
from detp.core.lights.point import PointLight
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from detp.core.points import Points
from detp.core.settings import BakeSettings
from rooms import box_quads, face_points, scene_of, z_scores
from scipy import stats

PHOTONS, BAKES = 120_000, 5

#: What discs miss because they lie a hundredth of their radius off the surface, a share of the light.
LIFTED = 0.004

#: All ways to find direct and indirect light must give the same answers.
WAYS = {
    "photons": {"direct": "photons", "indirect": "photons"},
    "rays and photons": {"direct": "shadow-rays", "indirect": "photons"},
    "gathered": {"direct": "shadow-rays", "indirect": "gather"},
    "gathered over photons": {"direct": "photons", "indirect": "gather"},
}
all_ways = pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)


def baked_with(scene, points, normals, radius, photons=PHOTONS, **settings):
    """With rays that gather until half of the points have an error of 3 %: what counts is the mean of all."""
    error = 0.03 if settings.get("indirect") == "gather" else None
    return baked(scene, Points(points, normals), BakeSettings("final", photons, radius, error=error, **settings))


def assert_unbiased(scene, points, normals, radius, expected, **settings):
    """The mean over all points agrees with the expectation: a t-test over bakes, and no outliers among their points.

    Points of one bake share photons and records, so that only bakes are independent; channels are tried apart.
    Returns the last one.
    """
    off, worst = [], 0.0
    for seed in range(BAKES):
        result = baked_with(scene, points, normals, radius, PHOTONS // BAKES, seed=seed, **settings)
        worst = max(worst, float(np.abs(z_scores(result, expected)).max()))
        off.append((result.irradiance / expected - 1).mean(axis=0))
    # Of hundreds of points with dozens of crossings each, whose errors are skewed.
    assert worst < 6, f"a point is {worst:.1f} standard errors off"
    if worst > 1e-3:  # else exact but for rounding
        mean, error = np.mean(off, axis=0), np.std(off, axis=0, ddof=1) / np.sqrt(BAKES)
        doubt = np.maximum(np.abs(mean) - LIFTED, 0.0) / np.maximum(error, 1e-6)
        assert (stats.t.sf(doubt, BAKES - 1) > 0.001).all(), f"{100 * mean} % off"
    return result


@all_ways
def test_a_black_furnace_shows_what_its_walls_emit(way):
    quads = box_quads((2, 2, 2))
    points, normals = face_points(quads)
    assert_unbiased(scene_of(quads, 0.0, 1 / np.pi), points, normals, 0.1, 1.0, **way)


@all_ways
def test_furnace_with_a_bounce_limit_is_a_geometric_sum(way):
    albedo, bounces = 0.7, 3
    quads = box_quads((2, 2, 2))
    scene = scene_of(quads, albedo, 1 / np.pi)
    points, normals = face_points(quads)
    expected = (1 - albedo ** (bounces + 1)) / (1 - albedo)
    result = assert_unbiased(scene, points, normals, 0.1, expected, bounces=bounces, **way)
    expected_cut = 24 * albedo ** (bounces + 1)
    assert result.cut_flux == pytest.approx(expected_cut, rel=4 / np.sqrt(result.photons * albedo**4))
    assert result.emitted_flux == pytest.approx(2 * 24)


@all_ways
def test_energy_balance_of_a_closed_room_with_a_lamp(way):
    size, albedo, flux = (4, 3, 2), 0.6, np.array((10.0, 20.0, 5.0))
    quads = box_quads(size)
    scene = scene_of(quads, albedo, lights=(PointLight((0.3, 0.4, 0.6), flux),))
    area = 2 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0])
    points, normals = stratified(quads, 16)
    # No disc touches a wall: each lies within its own cell.
    result = baked_with(scene, points, normals, 0.02, **way)
    weights = np.repeat([np.linalg.norm(np.cross(q[1] - q[0], q[3] - q[0])) for q in quads], 16**2)
    mean = np.average(result.irradiance, axis=0, weights=weights)
    # The discs see most of the walls, so the mean's own noise is about 1/sqrt(particles), 0.2 %.
    assert mean == pytest.approx(flux / (area * (1 - albedo)), rel=0.01)
    assert result.emitted_flux == pytest.approx(flux)
    assert (result.cut_flux < 1e-6 * flux).all()


def stratified(quads, count):
    u, v = np.meshgrid(*[(np.arange(count) + 0.5) / count] * 2)
    u, v = u.reshape(1, -1, 1), v.reshape(1, -1, 1)
    points = (
        quads[:, None, 0] + u * (quads[:, None, 1] - quads[:, None, 0]) + v * (quads[:, None, 3] - quads[:, None, 0])
    )
    normals = np.cross(quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0])
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    return points.reshape(-1, 3), np.repeat(normals, count**2, axis=0)


def test_two_parallel_plates():
    rho1, rho2, exitance = 0.5, 0.8, 3.0
    wide = 100.0
    lower = np.array([(0, 0, 0), (wide, 0, 0), (wide, wide, 0), (0, wide, 0)], float)
    upper = lower[::-1] + np.array((0, 0, 1.0))
    scene = scene_of([lower, upper], [rho1, rho2])
    plate = EmissiveTriangles(scene.corners[:2], np.full((2, 3), exitance / np.pi))
    scene = scene_of([lower, upper], [rho1, rho2], lights=(plate,))
    generator = np.random.default_rng(5)
    points = np.repeat(generator.uniform(40, 60, (400, 2)), 2, axis=0)
    points = np.c_[points, np.tile([0.0, 1.0], 400)]
    normals = np.tile([(0, 0, 1.0), (0, 0, -1.0)], (400, 1))
    # By photons: shadow rays are so exact that they see the plates' ends.
    on_upper = exitance / (1 - rho1 * rho2)
    expected = np.tile([rho2 * on_upper, on_upper], 400)[:, None]
    off = []
    for seed in range(8):
        settings = BakeSettings("final", PHOTONS // 4, 0.5, direct="photons", indirect="photons", seed=seed)
        off.append((baked(scene, Points(points, normals), settings).irradiance / expected - 1).mean())
    # Points share particles: only bakes are independent.
    assert np.std(off) < 0.05
    assert stats.ttest_1samp(off, 0).pvalue > 0.001


@all_ways
def test_sun_on_a_tilted_plane_including_its_edges(way):
    quad = np.array([(0, 0, 0), (1, 0, 0.5), (1, 1, 0.5), (0, 1, 0)], float)
    normal = np.array((-0.5, 0, 1)) / np.hypot(0.5, 1)
    direction = np.array((0.3, 0.2, -1.0)) / np.linalg.norm((0.3, 0.2, -1.0))
    scene = scene_of([quad], lights=(SunLight(direction, (2.0, 1.0, 0.5), 0.0),))
    points = np.concatenate([quad, quad[:1] * 0 + (0.5, 0.5, 0.25)])
    result = baked_with(scene, points, np.tile(normal, (5, 1)), 0.1, **way)
    expected = -direction @ normal * np.array((2.0, 1.0, 0.5))
    assert np.abs(z_scores(result, expected)).max() < 4


@all_ways
def test_open_plane_under_a_uniform_world(way):
    quad = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    scene = scene_of([quad], lights=(UniformWorld((0.5, 1.0, 2.0)),))
    points, _ = face_points([quad])
    both_sides = np.concatenate([points, points])
    normals = np.repeat([(0, 0, 1.0), (0, 0, -1.0)], len(points), axis=0)
    assert_unbiased(scene, both_sides, normals, 0.08, np.pi * np.array((0.5, 1.0, 2.0)), **way)


def test_uniform_sky_beside_a_long_wall():
    height, distance, length = 1.0, 0.7, 40.0
    ground = np.array([(-2, -2, 0), (4, -2, 0), (4, 2, 0), (-2, 2, 0)], float)
    wall = np.array([(0, -length, 0), (0, length, 0), (0, length, height), (0, -length, height)], float)
    scene = scene_of([ground, wall], lights=(UniformWorld((1.0, 1.0, 1.0)),))
    radius = 0.2
    points = np.array([(distance, y, 0) for y in np.linspace(-1, 1, 9)])
    settings = BakeSettings(photons=4_000_000, radius=radius, direct="photons")
    result = baked(scene, Points(points, np.tile((0, 0, 1.0), (9, 1))), settings)
    # The disc's mean of the formula, by a fine sum over its chords.
    x = distance + radius * np.linspace(-1, 1, 2001)
    chord = np.sqrt(np.maximum(radius**2 - (x - distance) ** 2, 0))
    expected = np.average(np.pi / 2 * (1 + x / np.hypot(x, height)), weights=chord)
    assert np.abs(z_scores(result, expected)).max() < 4


@all_ways
def test_a_coloured_furnace_is_the_sum_over_all_bounces_in_each_channel(way):
    quads = box_quads((1, 1, 1))
    albedo, emission = np.array((0.8, 0.5, 0.0)), np.array((1.0, 0.5, 0.25))
    points, normals = face_points(quads)
    assert_unbiased(scene_of(quads, albedo, emission), points, normals, 0.06, np.pi * emission / (1 - albedo), **way)


@all_ways
def test_a_clear_pane_changes_nothing_and_a_tinted_one_tints(way):
    floor = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    pane = np.array([(-9, -9, 0.2), (9, -9, 0.2), (9, 9, 0.2), (-9, 9, 0.2)], float)
    tint = np.array((1.0, 0.5, 0.0))
    rows = np.array([(0, 0, 0), tint])
    scene = scene_of([floor, pane], transmittance=rows, lights=(SunLight((0, 0, -1.0), (1.0, 1.0, 1.0), 0.0),))
    points, normals = face_points([floor])
    # The sun aims at the whole pane, so few photons reach the floor's discs: take them large.
    result = baked_with(scene, points[12:13], normals[12:13], 0.4, **way)
    assert np.abs(z_scores(result, tint)).max() < 4
    assert result.irradiance[0, 2] == 0


def test_light_of_negative_power_takes_light_away():
    floor = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    lamps = (PointLight((0, 0, 1.0), (40.0, 40.0, 40.0)), PointLight((0, 0, 1.0), (-15.0, -15.0, -15.0)))
    radius = 0.2
    result = baked_with(
        scene_of([floor], lights=lamps), np.zeros((1, 3)), np.array([(0, 0, 1.0)]), radius, direct="photons"
    )
    intensity = 25 / (4 * np.pi)
    expected = 2 * intensity * (1 - 1 / np.hypot(1, radius)) / radius**2
    assert np.abs(z_scores(result, expected)).max() < 4


def test_a_seed_gives_the_same_light_again_and_another_seed_another():
    quads = box_quads((1, 1, 1))
    scene = scene_of(quads, 0.5, 1.0)
    points, normals = face_points(quads, 2)
    first, again, other = (
        baked(scene, Points(points, normals), BakeSettings(photons=5000, radius=0.1, seed=seed)).irradiance
        for seed in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


@pytest.mark.parametrize("gatherer", ["disc-index", "sphere-cache"])
def test_the_number_of_threads_changes_nothing(monkeypatch, gatherer):
    quads = box_quads((1, 1, 1))
    scene = scene_of(quads, (0.5, 0.6, 0.7), 1.0)
    points, normals = face_points(quads, 3)
    settings = BakeSettings(photons=70_000, radius=0.1, gatherer=gatherer)
    totals = []
    for workers in (1, 5):
        monkeypatch.setattr(parallel, "worker_count", lambda workers=workers: workers)
        totals.append(baked(scene, Points(points, normals), settings).irradiance)
    assert np.array_equal(*totals)
