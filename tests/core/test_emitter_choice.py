"""Choosing among many emitters: probabilities that are told both ways, the right mean, and little noise."""

import numpy as np
import pytest
from detp.core import parallel
from detp.core.direct import learnt_choice
from detp.core.direct.direct_light import DirectLight
from detp.core.direct.emitter_cuts import MOST_RANGES
from detp.core.direct.emitters import Emitters, halved
from detp.core.direct.learnt_choice import LearntChoice
from detp.core.direct.lit_scene import LitScene
from detp.core.direct.point_groups import PointGroups
from detp.core.direct.shadows import Shadows
from detp.core.direct.triangle_choice import TriangleChoice
from detp.core.lights.area import AreaLight
from detp.core.lights.emissive import EmissiveTriangles
from detp.core.lights.point import PointLight
from detp.core.lights.sun import SunLight
from detp.core.rays import RayCaster
from detp.core.scene import Scene
from detp.core.settings import BakeSettings
from scipy.stats import chisquare

UP = np.array((0.0, 0.0, 1.0))


def shining(count, seed=1):
    """Small triangles strewn in a box of side 4 above the floor, of strengths that differ a thousandfold."""
    generator = np.random.default_rng(seed)
    corners = generator.uniform((-2, -2, 0.5), (2, 2, 2.0), (count, 1, 3)) + 0.05 * generator.normal(size=(count, 3, 3))
    return corners, generator.exponential(size=(count, 3)) ** 3


def over_floor(count, seed=2, half=2.0):
    """Points on the floor, and their normals."""
    points = np.c_[np.random.default_rng(seed).uniform(-half, half, (count, 2)), np.full(count, 1e-4)]
    return points, np.tile(UP, (count, 1))


def floor_and(corners, emission, lights=()):
    """A scene of a large black floor and triangles (T, 3, 3) that shine."""
    floor = 50.0 * np.array([[(-1, -1, 0), (1, -1, 0), (1, 1, 0)], [(-1, -1, 0), (1, 1, 0), (-1, 1, 0)]], float)
    corners = np.concatenate([floor, corners.reshape(-1, 3, 3)])
    nothing = np.zeros((len(corners), 3))
    glow = np.concatenate([nothing[:2], np.reshape(emission, (-1, 3))])
    rows = np.arange(3 * len(corners)).reshape(-1, 3)
    return Scene(corners.reshape(-1, 3), rows, nothing, glow, nothing, tuple(lights))


def learnt_of(emitters, count=300):
    """What two or more groups know, after they were told something at random; and a choice by it."""
    points, normals = over_floor(count)
    groups = PointGroups.of(points, normals)
    points, normals = points[groups.order], normals[groups.order]
    learnt = LearntChoice(emitters, groups, points, normals)
    whole = slice(0, len(groups.start) - 1), slice(0, count)
    generator = np.random.default_rng(3)
    before = learnt.choice(*whole, points, normals, groups.group)
    spot = generator.integers(0, count, 5000)
    column = generator.integers(0, before.share.shape[1], len(spot))
    learnt.add(*whole, before, np.ones(count), spot, column, generator.exponential(size=len(spot)) * (column % 3))
    learnt.learn()
    return points, learnt, learnt.choice(*whole, points, normals, groups.group)


@pytest.mark.parametrize("count", [1, 2, 7, 32, 33, 1000])
def test_ranges_hold_every_emitter_once_and_probabilities_add_up_to_one(count):
    emitters = Emitters.of_triangles(EmissiveTriangles(*shining(count)))
    assert sorted(emitters.order) == list(range(count))
    points, learnt, choice = learnt_of(emitters)
    assert learnt.ranges[0].shape[1] == min(count, MOST_RANGES)
    for begin, end in zip(*learnt.ranges, strict=True):
        assert begin[0] == 0 and end[-1] == count and np.array_equal(begin[1:], end[:-1])
    spots = np.arange(0, len(points), 37)
    spot, emitter = np.repeat(spots, count), np.tile(np.arange(count), len(spots))
    probability = choice.probability(spot, emitter).reshape(len(spots), count)
    assert probability.sum(axis=1) == pytest.approx(1) and (probability > 0).all()


def test_emitters_are_chosen_as_often_as_their_probability_says():
    emitters = Emitters.of_triangles(EmissiveTriangles(*shining(200)))
    _, _, choice = learnt_of(emitters)
    generator = np.random.default_rng(4)
    for spot in (0, 150, 299):
        uniforms, spots = generator.random(100_000), np.full(100_000, spot)
        chosen, rest, column, told = choice.chosen(spots, uniforms)
        expected = choice.probability(np.full(200, spot), np.arange(200)) * len(uniforms)
        assert told * len(uniforms) == pytest.approx(expected[chosen])
        assert (choice.begin[choice.group[spots], column] <= emitters.place[chosen]).all()
        often = expected > 5
        found = np.bincount(chosen, minlength=200)
        found, expected = (np.append(v[often], v[~often].sum()) for v in (found, expected))
        assert chisquare(found[expected > 0], expected[expected > 0]).pvalue > 1e-3
        # What is left of the numbers is uniform again.
        assert chisquare(np.histogram(rest, 20, (0, 1))[0]).pvalue > 1e-3 and rest.max() < 1


def test_rays_met_by_chance_have_the_density_of_being_aimed_at():
    corners, glow = shining(300)
    light = EmissiveTriangles(corners, glow, np.arange(300) * 2 + 5)
    points, learnt, choice = learnt_of(Emitters.of_triangles(light))
    aim = TriangleChoice(light, choice, learnt, slice(0, 1), slice(0, 1), np.ones(len(points)))
    generator = np.random.default_rng(5)
    spot = generator.integers(0, len(points), 20_000)
    rays, _ = aim.shadow_rays(spot, points[spot], generator.random((len(spot), 2)))
    places = points[spot] + rays.directions * rays.distances[:, None]
    # Which triangle it was is told by its radiance.
    number = np.array([np.abs(glow - each).sum(axis=1).argmin() for each in rays.radiance])
    lit = rays.shines
    triangle = light.rows[number]
    radiance, density = light.met(points[spot], rays.directions, triangle, places)
    assert radiance[lit] == pytest.approx(rays.radiance[lit])
    assert (density * aim.factor(spot, triangle))[lit] == pytest.approx(rays.density[lit], rel=1e-6)


def test_halves_of_halves_are_the_ranges_that_are_cut():
    places = np.random.default_rng(6).random((1000, 2)) * (1, 100)
    order = halved(places)
    first, second = places[order[:500], 1], places[order[500:], 1]
    assert first.max() <= second.min()
    assert places[order[:250], 1].max() <= places[order[250:500], 1].min()


def test_ranges_are_as_bright_as_their_emitters_from_afar():
    lamps = [AreaLight((x, 0.1 * x, 0), (0.1, 0, 0), (0, 0.1, 0), np.full(3, 1.0 + x)) for x in (0.0, 1.0, 2.0)]
    lamps += [PointLight((0, y, 0.5), np.full(3, 3.0), 0.1) for y in (1.0, 2.0)]
    emitters = Emitters.of_lamps([*lamps, SunLight((0, 0, -1), np.full(3, 2.0), 0.1)])
    place, normal = np.array((20.0, 30.0, -100.0)), np.array((0.0, 0.6, 0.8))
    rays = [lamp.shadow_rays(place[None], np.full((1, 2), 0.5)) for lamp in lamps]
    light = [np.abs(r.radiance).sum() / r.density[0] for r in rays]
    cosine = [r.directions[0] @ normal for r in rays]
    found = emitters.ranges(np.array([0]), np.array([5]))
    facing, anywhere = found.brightness(place, normal)
    assert anywhere[0] == pytest.approx(sum(light), rel=0.02) and found.brightness(place)[0] == anywhere
    assert facing[0] == pytest.approx(np.dot(light, cosine), rel=0.05)
    sun = emitters.ranges(np.array([5]), np.array([6]))
    assert sun.brightness(place, UP)[0] == pytest.approx(6.0) and sun.brightness(place, -UP)[0][0] == 0


def lit(scene, points, normals, rounds=64, **settings):
    light = DirectLight(LitScene(scene, RayCaster(scene.corners)), points, normals, BakeSettings(**settings))
    for _ in light.rounds(0, rounds):
        pass
    return light


def sum_of_points(places, powers, points):
    away = places - points[:, None]
    return 3 * (powers / (4 * np.pi) * away[..., 2] / (away**2).sum(axis=2) ** 1.5).sum(axis=1)


def test_ten_thousand_lamps_bring_the_sum_of_their_light():
    generator = np.random.default_rng(7)
    places = generator.uniform((-20, -20, 0.5), (20, 20, 3), (10_000, 3))
    powers = generator.exponential(size=10_000) ** 2
    lamps = [PointLight(place, np.full(3, power), 1e-3) for place, power in zip(places, powers, strict=True)]
    points, normals = over_floor(1000, half=20.0)
    expected = sum_of_points(places, powers, points)
    light = lit(floor_and(np.zeros((0, 3, 3)), (), lamps), points, normals)
    found = light.irradiance
    relative = found.value.sum(axis=1) / expected - 1
    assert abs(relative.mean()) < 4 * relative.std() / np.sqrt(len(relative))
    # With 256 rays a point. By power within each group's ranges 0.2 would be left.
    assert relative.std() < 0.05
    error = found.standard_error.sum(axis=1) / expected
    assert 0.7 < np.sqrt(np.mean(error**2)) / relative.std() < 1.5


def walled(seed=8):
    """Forty lamps in rooms of their own, of which each point sees one or two; and what those bring, exactly."""
    generator = np.random.default_rng(seed)
    x = np.arange(40.0)
    places = np.c_[x + 0.5, generator.uniform(0.3, 0.7, 40), np.full(40, 1.0)]
    walls = [[[(k, -9, 0), (k, 9, 0), (k, 9, 9)], [(k, -9, 0), (k, 9, 9), (k, -9, 9)]] for k in range(41) if k % 2 == 0]
    lamps = [PointLight(place, np.full(3, 1.0), 1e-3) for place in places]
    points = np.c_[generator.uniform((0, 0), (40, 1), (2000, 2)), np.full(2000, 1e-3)]
    near = np.floor(points[:, 0] / 2) == np.floor(x / 2)[:, None]
    away = places[:, None] - points
    expected = (near * 3 / (4 * np.pi) * away[..., 2] / (away**2).sum(axis=2) ** 1.5).sum(axis=0)
    scene = floor_and(np.array(walls, float), np.zeros((2 * len(walls), 3)), lamps)
    return scene, points, np.tile(UP, (2000, 1)), expected


def test_points_learn_which_lamps_they_see():
    scene, points, normals, expected = walled()
    error = {}
    for rounds in (4, 64):
        found = lit(scene, points, normals, rounds).irradiance
        relative = found.value.sum(axis=1) / expected - 1
        error[rounds] = np.sqrt(np.mean(relative**2))
        assert abs(relative.mean()) < 4 * relative.std() / np.sqrt(len(relative))
    # Independent rays that learn nothing gain a factor of four.
    assert error[64] < error[4] / 8


def test_without_room_for_each_point_groups_still_learn(monkeypatch):
    scene, points, normals, expected = walled()
    errors = []
    for room in (1 << 24, 0):
        monkeypatch.setattr(learnt_choice, "MOST_OWN", room)
        relative = lit(scene, points, normals).irradiance.value.sum(axis=1) / expected - 1
        assert abs(relative.mean()) < 4 * relative.std() / np.sqrt(len(relative))
        errors.append(relative.std())
    assert errors[0] < errors[1] < 0.1


def test_many_triangles_bring_the_sum_of_their_light():
    corners, glow = shining(3000)
    points, normals = over_floor(300)
    scene = floor_and(corners, glow)
    # Each triangle by its middle, with the shadows that the others throw, many times over.
    generator, shadows = np.random.default_rng(9), Shadows(scene, RayCaster(scene.corners))
    light = EmissiveTriangles(corners, glow)
    expected = np.zeros(len(points))
    for row, point in enumerate(points):
        number = np.repeat(np.arange(3000), 4)
        rays = light.rays_to(number, np.tile(point, (12_000, 1)), generator.random((12_000, 2)))
        share = shadows.transmitted(np.tile(point, (12_000, 1)), rays.directions, rays.distances)[:, 0]
        cosine = np.maximum(rays.directions[:, 2], 0)
        expected[row] = (rays.radiance.sum(axis=1) * cosine * share * light.chances[number] / rays.density).sum() / 4
    found = np.array([lit(scene, points, normals, seed=s).irradiance.value.sum(axis=1) for s in range(6)])
    relative = (found / expected - 1).mean(axis=1)
    assert abs(relative.mean()) < 4 * relative.std(ddof=1) / np.sqrt(6) + 0.002
    # Rays that choose triangles by their power are off by 0.057.
    assert np.median(np.abs(found / expected - 1)) < 0.042


@pytest.mark.parametrize("kind", ["lamps", "triangles"])
def test_threads_change_nothing(kind, monkeypatch):
    if kind == "lamps":
        scene, points, normals, _ = walled()
    else:
        scene, (points, normals) = floor_and(*shining(500)), over_floor(600)
    monkeypatch.setattr("detp.core.direct.direct_light.POINTS_PER_CHUNK", 200)
    several = lit(scene, points, normals, 16).irradiance.value
    monkeypatch.setattr(parallel, "worker_count", lambda: 1)
    assert np.array_equal(lit(scene, points, normals, 16).irradiance.value, several)


def test_light_at_places_near_the_points_is_that_of_all_lamps():
    corners, glow = shining(60)
    generator = np.random.default_rng(10)
    lamps = [PointLight((x, 1.0, 1.5), np.full(3, 5.0), 0.1) for x in (-1.0, 1.0)]
    lamps += [PointLight((0, -1.0, 1.5), np.full(3, 9.0)), SunLight((0.3, 0, -1), np.full(3, 0.5))]
    lamps += [SunLight((x, 0.2, -1), np.full(3, 0.2), 0.1) for x in (-0.4, 0.1, 0.4)]
    # The triangles only cast shadows.
    scene = floor_and(corners, 0 * glow, lamps)
    points, normals = over_floor(400)
    light = lit(scene, points, normals, 16)
    # Places beside the points that face another way: their light is known from a bake of their own.
    ways = np.array([(0.0, 0, 1), (0.6, 0, 0.8), (-0.8, 0, 0.6), (0, 1, 0)])
    places = np.array([(-0.5, 0.3, 0.2), (0.2, 0.1, 0.1), (1.0, -0.7, 0.3), (0.0, 0.0, 0.4)])
    own = lit(scene, np.repeat(places, 50, axis=0), np.repeat(ways, 50, axis=0), 64).irradiance.value
    expected = own.sum(axis=1).reshape(4, 50).mean(axis=1)
    nearby, shadows = light.nearby_lamps, Shadows(scene, RayCaster(scene.corners))
    groups = light._groups
    for place, way, right in zip(places, ways, expected, strict=True):
        nearest = np.linalg.norm(light._points - place, axis=1).argmin()
        count = 100_000
        rays = nearby.rays(
            np.tile(place, (count, 1)),
            np.tile(way, (count, 1)),
            np.full(count, groups.group[nearest]),
            generator.random((count, 3)),
        )
        assert (rays.light >= 0).all() and np.linalg.norm(rays.directions, axis=1) == pytest.approx(1)
        share = shadows.transmitted(np.tile(place, (count, 1)), rays.directions, rays.distances)
        found = (rays.light * share).sum(axis=1)
        assert abs(found.mean() - right) < 4 * found.std() / np.sqrt(count) + 0.01 * right
