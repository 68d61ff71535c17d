"""Direct light whose directions are learnt: unbiased, without noise where light is even, the same on all threads."""

import numpy as np
import pytest
from detp.core import parallel
from detp.core.direct.direct_light import LEARN_AFTER, DirectLight
from detp.core.direct.direction_guide import SIDE, DirectionChoice, DirectionSums, cells
from detp.core.direct.lit_scene import LitScene
from detp.core.direct.point_groups import LARGEST_GROUP, PointGroups
from detp.core.direct.round_sums import batches, in_whole_samples
from detp.core.direct.spots import Spots
from detp.core.lights.environment import EnvironmentWorld
from detp.core.lights.world import UniformWorld
from detp.core.rays import RayCaster
from detp.core.scene import Scene
from detp.core.settings import BakeSettings

UP, ACROSS = np.array((0.0, 0.0, 1.0)), 14


def rectangle(x, y, z):
    return np.array([(x[0], y[0], z), (x[1], y[0], z), (x[1], y[1], z), (x[0], y[1], z)], float)


def room(light):
    """A room of height 1 with a square hole of side 0.6 in its ceiling, above it one light; and points on the floor."""
    low, high = 0.2, 0.8
    corners = [(-3, -3), (3, -3), (3, 3), (-3, 3)]
    walls = [[(*a, 0), (*b, 0), (*b, 1), (*a, 1)] for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    quads = [
        rectangle((-3, 3), (-3, 3), 0),
        rectangle((-3, low), (-3, 3), 1),
        rectangle((high, 3), (-3, 3), 1),
        rectangle((low, high), (-3, low), 1),
        rectangle((low, high), (high, 3), 1),
        *np.array(walls, float),
        rectangle((-1, 3), (-1, 3), 3),
    ]
    count = len(quads)
    emission = np.zeros((2 * count, 3))
    lights = ()
    if light == "emissive":
        emission[-2:] = 2.0
    else:
        quads, emission = quads[:-1], emission[:-2]
        picture = np.random.default_rng(5).exponential(size=(8, 16, 3)) ** 2
        lights = (EnvironmentWorld(picture) if light == "picture" else UniformWorld(np.ones(3)),)
    triangles = (np.arange(len(quads))[:, None, None] * 4 + np.array([(0, 1, 2), (0, 2, 3)])).reshape(-1, 3)
    nothing = np.zeros((len(triangles), 3))
    scene = Scene(np.concatenate(quads), triangles, nothing, emission, nothing, lights)
    across = np.linspace(-1, 1, ACROSS)
    points = np.stack([*np.meshgrid(across, across), np.full((ACROSS, ACROSS), 1e-4)], axis=-1).reshape(-1, 3)
    return scene, points, np.tile(UP, (len(points), 1))


def looked(scene, points, normals, rounds=32, seed=0):
    light = DirectLight(LitScene(scene, RayCaster(scene.corners)), points, normals, BakeSettings(seed=seed))
    for _ in light.rounds(0, rounds):
        pass
    return light


def hole_seen(points):
    """Irradiance by a sky of radiance 1 through the hole: pi times the rectangle's form factor (Lambert's formula)."""
    corners = rectangle((0.2, 0.8), (0.2, 0.8), 1.0)
    towards = corners - points[:, None]
    towards /= np.linalg.norm(towards, axis=2, keepdims=True)
    after = np.roll(towards, -1, axis=1)
    across = np.cross(towards, after)
    angle = np.arccos((towards * after).sum(axis=2))
    return np.abs(0.5 * (angle * across[..., 2] / np.linalg.norm(across, axis=2)).sum(axis=1))


def test_light_through_a_hole_is_right_whatever_was_learnt():
    scene, points, normals = room("world")
    expected = hole_seen(points)
    found = np.array([looked(scene, points, normals, seed=seed).irradiance.value[:, 0] for seed in range(40)])
    relative = (found / expected - 1).mean(axis=1)
    assert abs(relative.mean()) < 3.5 * relative.std(ddof=1) / np.sqrt(len(relative))
    z = (found.mean(axis=0) - expected) / (found.std(axis=0, ddof=1) / np.sqrt(len(found)))
    assert abs(z.mean()) < 0.5 and z.std() < 1.3
    # By chance alone a few rays in a hundred get through.
    by_chance = np.sqrt((np.pi / expected - 1) / 128)
    assert np.median(found.std(axis=0, ddof=1) / expected / by_chance) < 0.5


@pytest.mark.parametrize("kind", ["picture", "emissive"])
def test_learning_changes_no_mean(kind, monkeypatch):
    scene, points, normals = room(kind)
    learnt = np.array([looked(scene, points, normals, 64, s).irradiance.value.sum(axis=1) for s in range(16)])
    monkeypatch.setattr(DirectionSums, "guide", lambda self: None)
    plain = np.array([looked(scene, points, normals, 64, 90 + s).irradiance.value.sum(axis=1) for s in range(16)])
    usual = np.concatenate([learnt, plain]).mean()
    a, b = (learnt / usual).mean(axis=1), (plain / usual).mean(axis=1)
    assert abs(a.mean() - b.mean()) < 3.5 * np.sqrt((a.var(ddof=1) + b.var(ddof=1)) / 16)
    assert (learnt.var(axis=0) / usual**2).mean() < 1.1 * (plain.var(axis=0) / usual**2).mean()


def test_the_error_is_honest():
    scene, points, normals = room("world")
    expected = 3 * hole_seen(points)
    inside = []
    for seed in range(12):
        found = looked(scene, points, normals, 128, seed).irradiance
        inside.append((np.abs(found.value.sum(axis=1) - expected) < 1.96 * found.standard_error.sum(axis=1)).mean())
    # Over many seeds it is 92 %: light through a hole has a tail that few rounds do not tell.
    assert 0.9 < np.mean(inside) < 0.98


@pytest.mark.parametrize("rounds", [LEARN_AFTER, LEARN_AFTER + 1, LEARN_AFTER + 2])
def test_the_error_is_known_however_few_rounds_follow_learning(rounds):
    light = looked(*room("uniform"), rounds).irradiance
    assert np.isfinite(light.standard_error).all() and light.relative_error < 1.0


def test_an_even_sky_over_an_open_plane_has_no_noise():
    scene = Scene(
        rectangle((-9, 9), (-9, 9), 0),
        np.array([(0, 1, 2), (0, 2, 3)]),
        *np.zeros((3, 2, 3)),
        (UniformWorld(np.ones(3)),),
    )
    points = np.c_[np.random.default_rng(1).uniform(-1, 1, (300, 2)), np.full(300, 1e-3)]
    found = looked(scene, points, np.tile(UP, (300, 1)), 64).irradiance
    assert found.value == pytest.approx(np.pi, rel=1e-12)
    assert found.standard_error.max() < 1e-6


@pytest.mark.parametrize("kind", ["world", "picture", "emissive"])
def test_threads_change_nothing(kind, monkeypatch):
    scene, points, normals = room(kind)
    monkeypatch.setattr("detp.core.direct.direct_light.POINTS_PER_CHUNK", 100)
    several = looked(scene, points, normals).irradiance.value
    monkeypatch.setattr(parallel, "worker_count", lambda: 1)
    assert np.array_equal(looked(scene, points, normals).irradiance.value, several)


@pytest.mark.parametrize("rounds", [1, 2, 3, 5, 13, 64])
def test_rounds_make_up_whole_samples_and_are_as_many_as_was_asked(rounds):
    found = in_whole_samples(rounds, 4000)
    assert found.mean() == pytest.approx(rounds, rel=0.01) and found.min() >= 1
    for batch in batches(found):
        assert (batch.size * batch.count == found[batch.rows]).all()


def test_warped_numbers_have_the_density_that_is_told():
    generator = np.random.default_rng(2)
    density = generator.exponential(size=(3, SIDE * SIDE))
    density /= density.mean(axis=1, keepdims=True)
    choice = DirectionChoice.over(density)
    group = np.repeat(np.arange(3), 60_000)
    moved, told = choice.warped(group, generator.random((len(group), 2)))
    place = group * SIDE**2 + cells(moved)
    assert np.array_equal(told, density.ravel()[place]) and moved.max() < 1
    counts, expected = np.bincount(place, minlength=density.size), density.ravel() * 60_000 / SIDE**2
    chi = ((counts - expected) ** 2 / expected)[expected > 5]
    assert chi.sum() < len(chi) + 4 * np.sqrt(2 * len(chi))


def test_directions_and_their_uniforms_belong_together():
    generator = np.random.default_rng(3)
    normals = generator.normal(size=(500, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    spots = Spots.of(np.zeros((500, 3)), normals, np.arange(500) // 50)
    uniforms = generator.random((500, 2))
    directions, cosine = spots.directions(uniforms)
    assert np.einsum("ij,ij->i", directions, normals) == pytest.approx(cosine)
    assert spots.uniforms(directions) == pytest.approx(uniforms, abs=1e-6)


def test_groups_hold_neighbours_that_face_alike():
    points = np.random.default_rng(4).random((4000, 3))
    kind = np.arange(4000) % 3
    normals = np.eye(3)[kind]
    points[np.arange(4000), kind] = 0.0
    groups = PointGroups.of(points, normals)
    assert sorted(groups.order) == list(range(4000)) and np.diff(groups.start).max() <= LARGEST_GROUP
    assert np.diff(groups.start).min() >= LARGEST_GROUP // 8
    parts = [groups.order[begin:end] for begin, end in zip(groups.start[:-1], groups.start[1:], strict=True)]
    assert np.mean([np.ptp(rows % 3) == 0 for rows in parts]) > 0.7
    assert np.mean([np.ptp(points[rows], axis=0).max() for rows in parts]) < 0.5
    values = np.arange(4000.0)
    rows = slice(groups.start[1], groups.start[2])
    others = [np.delete(values[rows], i).mean() for i in range(rows.stop - rows.start)]
    assert groups.of_others(values)[rows] == pytest.approx(others)


def test_the_few_points_on_a_wall_are_no_group_with_the_many_on_the_ground():
    generator = np.random.default_rng(5)
    ground = np.c_[generator.uniform(-20, 20, (1700, 2)), np.zeros(1700)]
    wall = np.c_[np.zeros(25), generator.random((25, 2))]
    normals = np.repeat([(0.0, 0, 1), (1.0, 0, 0)], (1700, 25), axis=0)
    groups = PointGroups.of(np.concatenate([ground, wall]), normals)
    of_wall = groups.group[np.isin(groups.order, np.arange(1700, 1725))]
    assert len(np.unique(of_wall)) == 1 and np.diff(groups.start)[of_wall[0]] == 25
