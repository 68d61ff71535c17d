"""Direct light by shadow rays: nets, the choice of lamps, shadows through clear surfaces, both ways to find it."""

from itertools import product

import numpy as np
import pytest
from detp.core.bake import baked
from detp.core.direct.ambient_occlusion import ambient_occlusion
from detp.core.direct.direct_light import DirectLight
from detp.core.direct.lit_scene import LitScene
from detp.core.direct.low_discrepancy import scrambled_net
from detp.core.direct.scene_lights import MOST_SHARP_LAMPS
from detp.core.direct.shadows import MOST_IDLE, SeeThrough, Shadows
from detp.core.errors import InvalidSettingError
from detp.core.lights.area import AreaLight
from detp.core.lights.environment import EnvironmentWorld
from detp.core.lights.point import PointLight
from detp.core.lights.spot import SpotLight
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from detp.core.points import Points
from detp.core.rays import Hits, RayCaster
from detp.core.scene import Scene
from detp.core.settings import BakeSettings

UP = np.array((0.0, 0.0, 1.0))


def plane(half=10.0, height=0.0):
    return half * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float) + height * UP


def scene_of(*quads, emission=(), transmittance=(), lights=(), albedo=0.0):
    count = len(quads)
    triangles = (np.arange(count)[:, None, None] * 4 + np.array([(0, 1, 2), (0, 2, 3)])).reshape(-1, 3)
    rows = {"emission": np.zeros((2 * count, 3)), "transmittance": np.zeros((2 * count, 3))}
    for name, given in (("emission", emission), ("transmittance", transmittance)):
        for quad, value in given:
            rows[name][2 * quad : 2 * quad + 2] = value
    return Scene(np.concatenate(quads), triangles, np.full((2 * count, 3), albedo), *rows.values(), lights)


def direct(scene, points, normals=UP, rounds=64, **settings):
    """Value and standard error (N,) of the RGB mean."""
    points = np.atleast_2d(np.asarray(points, float))
    normals = np.broadcast_to(normals, points.shape)
    lit = LitScene(scene, RayCaster(scene.corners))
    light = DirectLight(lit, points + 1e-4 * normals, normals, BakeSettings(**settings))
    for _ in light.rounds(0, rounds // 2):
        pass
    for _ in light.rounds(rounds // 2, rounds):
        pass
    found = light.irradiance
    return found.value.mean(axis=1), found.standard_error.mean(axis=1)


@pytest.mark.parametrize("count", [1, 2, 16, 64])
def test_every_dyadic_box_holds_one_point_of_a_net(count):
    shifts = np.random.default_rng(1).integers(0, 1 << 32, (5, 2), np.uint32)
    nets = scrambled_net(count, shifts)
    assert nets.shape == (5, count, 2) and nets.min() >= 0 and nets.max() < 1
    columns = 1
    while columns <= count:
        boxes = np.floor(nets * (columns, count // columns)).astype(int)
        for box in boxes[..., 0] * (count // columns) + boxes[..., 1]:
            assert sorted(box) == list(range(count))
        columns *= 2


def test_shifted_nets_are_uniform():
    shifts = np.random.default_rng(2).integers(0, 1 << 32, (4000, 2), np.uint32)
    last = scrambled_net(16, shifts)[:, 15]
    counts = np.histogram2d(last[:, 0], last[:, 1], 5, [(0, 1), (0, 1)])[0]
    assert ((counts - 160) ** 2 / 160).sum() < 51  # chi-square, 24 degrees of freedom, p = 0.001


@pytest.mark.parametrize("sharp", [True, False])
def test_many_lamps_bring_the_sum_of_their_light(sharp):
    generator = np.random.default_rng(4)
    count = MOST_SHARP_LAMPS + 10
    places = generator.uniform((-3, -3, 0.5), (3, 3, 2), (count, 3))
    powers = generator.uniform(0, 30, count)
    lamps = tuple(
        PointLight(place, np.full(3, power), 0.0 if sharp else 1e-3)
        for place, power in zip(places, powers, strict=True)
    )
    points = np.c_[generator.uniform(-3, 3, (300, 2)), np.zeros(300)]
    away = places - points[:, None]
    square = (away**2).sum(axis=2)
    expected = (powers / (4 * np.pi) * away[..., 2] / square**1.5).sum(axis=1)
    found, error = direct(scene_of(plane(), lights=lamps), points)
    z = (found - expected) / np.maximum(error, 1e-4 * expected)
    # Of so few rays the error of a point that a rare lamp lights well is now and then far too small.
    assert z.std() < 1.2 and (np.abs(z) > 5).mean() < 0.01 and abs(z.mean()) < 4 / np.sqrt(300)


def test_a_few_lamps_without_extent_are_exact_after_one_round():
    lamps = (PointLight((0, 0, 2.0), np.ones(3)), SunLight((0, 0, -1.0), np.ones(3), 0.0))
    light, error = direct(scene_of(plane(), lights=lamps), (0, 0, 0), rounds=2)
    assert light[0] == pytest.approx(1 / (16 * np.pi) + 1, rel=1e-3) and error[0] == 0


def test_clear_surfaces_let_their_share_pass_and_others_none():
    panes = [(1, (0.5, 0.5, 0.5)), (2, (0.2, 0.2, 0.2))]
    sun = (SunLight((0, 0, -1.0), np.ones(3), 0.0),)
    two = scene_of(plane(), plane(1, 1), plane(1, 2), transmittance=panes, lights=sun)
    found, _ = direct(two, [(0.1, 0.2, 0), (5, 5, 0)])
    assert found == pytest.approx([0.1, 1.0])
    wall = scene_of(plane(), plane(1, 1), plane(1, 2), transmittance=panes[:1], lights=sun)
    assert direct(wall, (0.1, 0.2, 0))[0][0] == 0


def passed(scene, origin, direction):
    """How many surfaces a ray of ``scene`` meets, and the share of the light that comes from behind the last one."""
    surfaces = SeeThrough(RayCaster(scene.corners), scene.transmittance)
    met = list(surfaces.met(np.array([origin], float), np.array([direction], float)))
    return sum(int((hits.triangle >= 0).sum()) for _, hits, _ in met), met[-1][2][0, 0]


def test_light_passes_hundreds_of_clear_surfaces_but_not_once_next_to_nothing_is_left_of_it():
    sheets = [plane(1, 0.01 * number) for number in range(300)]
    for share, count in ((1.0, 300), (0.99, 300), (0.5, 20)):
        scene = scene_of(*sheets, transmittance=[(each, (share,) * 3) for each in range(300)])
        assert passed(scene, (0.1, 0.2, -1), UP) == (
            count,
            pytest.approx(share ** min(count, 19 if share < 0.9 else count)),
        )


def test_a_ray_that_meets_the_same_place_again_and_again_is_given_up(monkeypatch):
    """Of needles, and of faces beside others at 1e19 m, rounding finds the same corner wherever a ray starts."""
    scene = scene_of(plane(1, 1), plane(1, 2), transmittance=[(0, (1.0,) * 3), (1, (1.0,) * 3)])
    caster, first_hits = RayCaster(scene.corners), RayCaster.first_hits

    def held_fast(self, origins, directions, distances=None):
        hits = first_hits(self, origins, directions, distances)
        held = origins[:, 0] > 0
        return Hits(np.where(held, 0, hits.triangle), np.where(held[:, None], (0.5, 0, 1), hits.points))

    monkeypatch.setattr(RayCaster, "first_hits", held_fast)
    starts = np.array([(0.5, 0, 0), (-0.5, 0, 0)])
    met = list(SeeThrough(caster, scene.transmittance).met(starts, np.tile(UP, (2, 1))))
    assert len(met) == MOST_IDLE + 1
    arrived = np.concatenate([rows[hits.triangle < 0] for rows, hits, _ in met])
    assert arrived.tolist() == [1], "what is not held fast passes both panes"


def test_shadows_end_at_the_light():
    scene = scene_of(plane(1, 1), transmittance=[(0, (0.5, 0.5, 0.5))])
    for shown in (scene, scene_of(plane(1, 1))):
        shadows = Shadows(shown, RayCaster(shown.corners))
        share = shadows.transmitted(np.array([(0.1, 0.2, 0)] * 3), np.tile(UP, (3, 1)), np.array((0.9, 1.0, 1.1)))
        assert share[:2].min() == 1 and share[2].max() == shown.transmittance[0, 0]


def test_light_of_a_shining_pane_and_of_what_shines_behind_it():
    radiance = np.ones(3)
    quads = (plane(), plane(1e3, 1), plane(1e3, 2))
    scene = scene_of(*quads, emission=[(1, radiance), (2, 3 * radiance)], transmittance=[(1, 0.5 * radiance)])
    found, error = direct(scene, (0, 0, 0))
    assert found[0] == pytest.approx(np.pi * 2.5, abs=5 * error[0] + 1e-3)


def lit_room(kind):
    """A floor, a wall and a shelf of albedo 0.5 under one light, and the points to look at."""
    shelf = np.array([(-1, -1, 1), (0, -1, 1), (0, 1, 1), (-1, 1, 1)], float)
    wall = np.array([(-1, -1, 0), (-1, 1, 0), (-1, 1, 2), (-1, -1, 2)], float)
    picture = np.random.default_rng(5).exponential(size=(4, 8, 3)) ** 2
    lights = {
        "point": PointLight((0.5, 0.3, 1.6), np.full(3, 20.0), 0.2),
        "soft point": PointLight((0.5, 0.3, 1.6), np.full(3, 20.0), 0.3, soft=True),
        "spot": SpotLight((0.5, 0.3, 1.6), (-0.4, 0, -1.0), np.full(3, 60.0), 1.2, 0.4, 0.1),
        "sun": SunLight((-0.5, 0.1, -1.0), np.full(3, 2.0), 0.4),
        "area": AreaLight((0.4, 0, 1.7), (1, 0, 0), (0, 0.6, 0), np.full(3, 10.0), spread=2.0),
        "world": UniformWorld(np.ones(3)),
        "picture": EnvironmentWorld(picture),
    }
    points = np.array([(-0.5, 0.2, 0), (0.1, 0.1, 0), (0.6, -0.4, 0)])
    return scene_of(plane(1), wall, shelf, lights=(lights[kind],), albedo=0.5), points


@pytest.mark.parametrize("kind", ["point", "soft point", "spot", "sun", "area", "world", "picture"])
def test_shadow_rays_and_photons_find_the_same_light(kind):
    scene, points = lit_room(kind)
    radius, around = 0.1, 48
    # A disc's mean against the mean over points of the same disc.
    turns = 2 * np.pi * (np.arange(around) * 0.618034 % 1)
    reach = radius * np.sqrt((np.arange(around) + 0.5) / around)
    aside = np.c_[reach * np.cos(turns), reach * np.sin(turns), np.zeros(around)]
    normals = np.tile(UP, (len(points), 1))
    settings = BakeSettings(photons=1 << 19, radius=radius, direct="photons", indirect="off", seed=6)
    photons = baked(scene, Points(points, normals), settings)
    rays, error = direct(scene, (points[:, None] + aside).reshape(-1, 3), seed=6)
    rays, error = rays.reshape(-1, around).mean(axis=1), error.reshape(-1, around).mean(axis=1)
    difference = rays - photons.irradiance.mean(axis=1)
    assert np.abs(difference / np.hypot(error, photons.standard_error.mean(axis=1))).max() < 4
    assert rays.max() > 0


def test_direct_and_indirect_add_up_whichever_way_light_is_found():
    scene, points = lit_room("area")
    normals = np.tile(UP, (len(points), 1))

    def found(direct, indirect, **more):
        settings = BakeSettings("final", 1 << 17, 0.1, direct=direct, indirect=indirect, **more)
        return baked(scene, Points(points, normals), settings)

    def assert_alike(one, other):
        error = np.hypot(one.standard_error, other.standard_error)
        assert (np.abs(one.value - other.value) < 4 * error).all()

    whole = found("shadow-rays", "gather")
    assert np.array_equal(whole.irradiance, whole.direct.value + whole.indirect.value)
    for direct, indirect in list(product(("shadow-rays", "photons", "none"), ("gather", "photons")))[1:]:
        other = found(direct, indirect)
        assert_alike(whole.indirect, other.indirect)
        if direct != "none":
            assert_alike(whole.light, other.light)
        else:
            assert not other.direct.value.any()
    alone = found("shadow-rays", "off", error=0.002)
    assert alone.photons == 0
    assert_alike(whole.direct, alone.light)


def test_ambient_occlusion_is_the_open_share_within_its_distance():
    wall = np.array([(0, -50, 0), (0, 50, 0), (0, 50, 100), (0, -50, 100)], float)
    scene = scene_of(plane(), wall)
    points, normals = np.repeat([(0.01, 0, 0), (2.0, 0, 0), (9, 0, 0)], 40, axis=0), np.tile(UP, (120, 1))
    sky, settings = ambient_occlusion(scene, BakeSettings(error=0.004, shadow_distance=3.0))
    result = baked(sky, Points(points, normals), settings)
    # At the wall half the sky is hidden within any distance; three metres from it nothing is.
    open_share = result.irradiance[:, 0].reshape(3, 40).mean(axis=1) / np.pi
    assert open_share[0] == pytest.approx(0.5, abs=0.01) and open_share[2] == pytest.approx(1)
    # A wall at distance x hides what lies within the cone of angle acos(x / 3) about its normal.
    x, reach = 2.0, 3.0
    tilt = np.arccos(x / reach)
    directions = np.random.default_rng(7).normal(size=(400_000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    sky_ward = directions[directions[:, 2] > 0]
    hidden = np.average(-sky_ward[:, 0] > np.cos(tilt), weights=sky_ward[:, 2])
    assert open_share[1] == pytest.approx(1 - hidden, abs=0.005)
    assert result.photons == 0


def test_a_stray_vertex_does_not_make_all_things_occlude():
    wall = np.array([(0, -5, 0), (0, 5, 0), (0, 5, 5), (0, -5, 5)], float)
    room, astray = scene_of(plane(), wall), scene_of(plane(), wall, plane(0.1) + [1e5, 0, 0])
    near, far = (ambient_occlusion(scene, BakeSettings())[1].shadow_distance for scene in (room, astray))
    assert near == pytest.approx(0.2 * room.bounds.radius) and far < 5 * near


def test_equal_seeds_give_equal_light_and_others_do_not():
    scene, points = lit_room("area")
    first, again, other = (direct(scene, points, rounds=4, seed=seed)[0] for seed in (1, 1, 2))
    assert np.array_equal(first, again) and not np.array_equal(first, other)


def test_settings_that_leave_nothing_to_bake_are_refused():
    with pytest.raises(InvalidSettingError, match="at least one"):
        BakeSettings(direct="none", indirect="off")
    with pytest.raises(InvalidSettingError, match="Unknown way"):
        BakeSettings(direct="magic")
    with pytest.raises(InvalidSettingError, match="above 0 m"):
        BakeSettings(shadow_distance=0.0)


def test_shadows_are_the_same_whichever_surfaces_are_met_first():
    generator = np.random.default_rng(8)
    corners = generator.uniform(-1, 1, (80, 1, 3)) + 0.3 * generator.normal(size=(80, 3, 3))
    passing = np.where((np.arange(80) % 2 == 0)[:, None], generator.uniform(0.2, 1, (80, 3)), 0.0)
    nothing = np.zeros((80, 3))
    scene = Scene(corners.reshape(-1, 3), np.arange(240).reshape(80, 3), nothing, nothing, passing, ())
    origins, ways = generator.normal(size=(2, 400, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    distances = np.where(np.arange(400) % 2, np.inf, 1.5)
    shadows = Shadows(scene, RayCaster(scene.corners))
    expected = np.zeros((400, 3))
    for rows, hits, share in shadows.surfaces.met(origins, ways, distances):
        expected[rows[hits.triangle < 0]] = share[hits.triangle < 0]
    found = shadows.transmitted(origins, ways, distances)
    assert found == pytest.approx(expected) and 0.1 < (expected.max(axis=1) == 0).mean() < 0.9
    assert ((expected > 0) & (expected < 1)).any()
