"""Cells in which gather rays land, and where they are trusted."""

import numpy as np
import pytest
from detp.core.bake import baked
from detp.core.direct.lit_scene import LitScene
from detp.core.direct.surrounding_light import CONTRASTS, in_part
from detp.core.gather.cells import Cells
from detp.core.gather.records import NEAR, Landings, RecordFinder, Records
from detp.core.gather.reflected_light import MOST_FOLLOWED, ReflectedLight, by_cells
from detp.core.lights.area import AreaLight
from detp.core.lights.point import PointLight
from detp.core.points import Points, facings
from detp.core.rays import RayCaster
from detp.core.sampling import cosine_hemisphere
from detp.core.scene import Scene
from detp.core.settings import BakeSettings
from rooms import box_quads, face_points, scene_of

CELLS = Cells(np.full(3, -1.0), 0.01)


def test_records_tell_of_their_own_cells_and_of_no_others():
    generator = np.random.default_rng(1)
    numbers = np.unique(generator.integers(0, 1 << 62, 5000).astype(np.uint64))
    cut = generator.random(len(numbers)) < 0.2
    finder = RecordFinder(np.zeros(3), 0.01, numbers, cut)
    assert np.array_equal(finder.rows(numbers), np.where(cut, -1, np.arange(len(numbers))))
    others = np.setdiff1d(generator.integers(0, 1 << 63, 5000).astype(np.uint64), numbers)
    assert (finder.rows(others) == -1).all()
    nothing = RecordFinder(np.zeros(3), 0.01, numbers[:0], cut[:0])
    assert (nothing.rows(others) == -1).all()


def test_cells_are_as_wide_as_a_fifth_of_the_ray_but_no_smaller_than_the_finest():
    lengths = np.array([1e-6, 0.05, 0.2, 0.5, 1.9])
    sides = CELLS.sides(CELLS.levels(lengths))
    assert np.isclose(sides[0], CELLS.finest) and CELLS.finest >= 0.01
    long = lengths > 0.2
    assert ((sides <= 0.2 * lengths) & (sides > 0.1 * lengths))[long].all()


def test_sides_of_a_wall_and_sheets_behind_each_other_have_cells_of_their_own():
    places = np.array([(0.1, 0.1, 0.105), (0.1, 0.1, 0.105), (0.1, 0.1, 0.1085)])
    normals = np.array([(0, 0, 1.0), (0, 0, -1.0), (0, 0, 1.0)])
    numbers = CELLS.numbers(places, normals, CELLS.levels(np.full(3, 0.001)))
    assert len(np.unique(numbers)) == 3
    assert len(np.unique(facings(np.array([(1.0, 0, 0), (0.99, 0.1, 0.1)])))) == 1


def test_places_that_are_too_far_away_to_count_cells_share_the_last():
    places = np.array([(0.1, 0.1, far) for far in (3.4e38, 1e37, -1e37)])
    up = np.tile((0, 0, 1.0), (3, 1))
    with np.errstate(all="raise"):
        numbers = CELLS.numbers(places, up, np.zeros(3, np.int64))
    assert numbers[0] == numbers[1] != numbers[2]


def test_cells_that_a_wall_cuts_and_rays_that_are_too_short_are_not_looked_up():
    floor = [[(-1, -1, 0), (1, -1, 0), (1, 1, 0)], [(-1, -1, 0), (1, 1, 0), (-1, 1, 0)]]
    wall = [[(0.01, -1, 0), (0.01, 1, 0), (0.01, 1, 1)], [(0.01, -1, 0), (0.01, 1, 1), (0.01, -1, 1)]]
    caster = RayCaster(np.array(floor + wall, float))
    generator = np.random.default_rng(2)
    places = np.c_[generator.uniform(-0.5, 0.5, (20000, 2)), np.zeros(20000)]
    up, lengths = np.tile((0, 0, 1.0), (20000, 1)), np.full(20000, 0.5)
    landings = Landings(places, places + 1e-4 * up, up, lengths)
    records = Records(caster, landings, 1000, 0, 0.1).finder
    found = records.find(landings, landings.lengths) >= 0
    assert not found[np.abs(places[:, 0] - 0.01) < 0.005].any()
    assert found[np.abs(places[:, 0] - 0.01) > 0.25].mean() > 0.99
    short = Landings(places, places, up, np.full(20000, 0.9 * NEAR * records.finest))
    assert (records.find(short, short.lengths) == -1).all()
    # What lies close by, but at the end of a long way over other surfaces, is looked up.
    assert np.array_equal(records.find(short, landings.lengths) >= 0, found)


@pytest.mark.parametrize("bounces", [1, 2, 4, 64])
def test_rays_that_nothing_is_known_of_bring_every_reflection_once(bounces):
    # In a closed room that shines and reflects alike everywhere each reflection brings the albedo times the one before.
    albedo, count = np.array((0.9, 0.5, 0.2)), 20000
    scene = scene_of(box_quads((1, 1, 1)), albedo, 1.0)
    caster = RayCaster(scene.corners)
    nowhere = Landings(*np.zeros((3, 0, 3)), np.zeros(0))
    light = ReflectedLight(LitScene(scene, caster), Records(caster, nowhere, 1, 0).finder, bounces)
    origins, normals, generator = np.full((count, 3), 0.5), np.tile((0, 0, 1.0), (count, 1)), np.random.default_rng(3)
    directions = cosine_hemisphere(normals, generator.random((count, 2)))
    hits = caster.first_hits(origins, directions)
    rows, group = np.arange(count), np.zeros(count, np.int64)
    found = light.sent(origins, directions, rows, hits, group, None, generator)
    expected = np.pi * sum(albedo**n for n in range(1, min(bounces, MOST_FOLLOWED) + 1))
    error = found[:, :3].std(axis=0) / np.sqrt(count)
    assert not found[:, 3:].any()
    assert (np.abs(found[:, :3].mean(axis=0) - expected) < 4.0 * error + 1e-9).all()


def test_light_from_a_gap_above_a_lamp_is_not_blurred_into_the_room():
    """Between a white lamp and the ceiling 1 cm above it light is two hundred times brighter than in the room."""
    lamp = [[(0.75, 0.8, 1.99), (0.75, 1.2, 1.99), (1.25, 1.2, 1.99), (1.25, 0.8, 1.99)]]
    room = box_quads((2, 2, 2))
    scene = scene_of(np.concatenate([room, lamp]), 0.75, np.r_[np.zeros(6), 20.0])
    points = Points(*face_points(np.delete(room, 1, axis=0), across=6))
    gathered = [baked(scene, points, BakeSettings("preview", seed=seed)) for seed in range(2)]
    found = np.mean([result.irradiance.sum(axis=1).mean() for result in gathered])
    by_photons = BakeSettings(indirect="photons", photons=1 << 18, radius=0.2)
    assert found == pytest.approx(baked(scene, points, by_photons).irradiance.sum(axis=1).mean(), rel=0.05)


def test_a_floor_seen_from_two_metres_is_not_lit_as_a_few_patches():
    """A lamp between two planes makes a spot on the floor; nothing is near, and still its light is not a few cells'."""
    floor = [[(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)]]
    roof = [[(-1.5, -1.5, 2), (-1.5, 1.5, 2), (1.5, 1.5, 2), (1.5, -1.5, 2)]]
    lamp = PointLight((0, 0, 1), (100.0, 100.0, 100.0))
    scene = scene_of(np.array(floor + roof), np.array((0.9, 0.0)), 0.0, [lamp])
    points = Points(*face_points(np.array(roof), across=16))
    steps = (np.arange(200) + 0.5) / 50 - 2.0
    places = np.stack([*np.meshgrid(steps, steps), np.zeros((200, 200))], axis=-1).reshape(-1, 3)
    direct = 100.0 / (4 * np.pi) / ((places**2).sum(axis=1) + 1.0) ** 1.5
    away = ((places[:, None] - points.centres) ** 2).sum(axis=2)
    expected = (0.9 * direct[:, None] / np.pi * 4.0 / away**2).sum(axis=0) * 4e-4
    found = [
        baked(scene, points, BakeSettings("final", bounces=1, seed=seed)).indirect.value[:, 0] for seed in range(4)
    ]
    assert np.mean(found, axis=1) / expected.mean() == pytest.approx(np.ones(4), abs=0.03)


def test_a_wall_in_the_light_of_a_sharp_patch_does_not_depend_on_where_records_fall():
    """Its records lie inside or outside of the patch, of which they tell as one."""
    centre, size, over_floor = np.array((0.13, 0.2, 3.0)), 0.7, np.array((0.8,) * 3)
    floor = np.array([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], float)
    wall = np.stack([floor[:, 0], np.full(4, 2.0), floor[:, 1] + 2.0], axis=1)
    lamp = AreaLight(centre, (size, 0, 0), (0, size, 0), (49.0, 49.0, 49.0), spread=0.0)
    quads = np.concatenate([floor, wall]), [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)]
    scene = Scene(*quads, albedo=np.tile(over_floor, (4, 1)), lights=[lamp])
    across, up = (part.ravel() for part in np.meshgrid(np.linspace(-1.5, 1.5, 8), np.linspace(0.3, 3.5, 8)))
    points = np.stack([across, np.full(64, 2.0), up], axis=1)
    patch = [part.ravel() for part in np.meshgrid(*[size * ((np.arange(60) + 0.5) / 60 - 0.5)] * 2)]
    ways = np.stack([centre[0] + patch[0], centre[1] + patch[1], np.zeros(3600)], axis=1) - points[:, None]
    # 100 W/m^2 on the patch: the sum of cos cos E albedo dA / (pi r^2).
    squared = (ways**2).sum(axis=2)
    expected = (100.0 * 0.8 * size**2) * (-ways[..., 1] * -ways[..., 2] / (np.pi * squared**2)).mean(axis=1)
    off = []
    for seed in range(8):
        found = baked(scene, Points(points, np.tile((0, -1.0, 0), (64, 1))), BakeSettings(bounces=1, seed=seed))
        off.append(np.median(np.abs(found.irradiance[:, 0] / expected - 1.0)))
    assert np.mean(off) < 0.12  # 0.26 where each record looks from its own place alone


def test_contrasts_are_what_eight_parts_of_the_photons_differ_by():
    """Of a cell's light by eight independent parts the contrasts are as large as its mean is off, and independent."""
    generator = np.random.default_rng(5)
    # By records, their photons' parts, and cells.
    parts = 1.0 + 0.1 * generator.normal(size=(2, 4, 5000))
    signs = np.array([(1, 1, -1, -1), (1, -1, 1, -1), (1, -1, -1, 1)]) / 4.0
    light = np.repeat(parts.mean(axis=1)[..., None], 3, axis=2)
    found = by_cells(np.concatenate([light, 3.0 * (parts.swapaxes(1, 2) @ signs.T)], axis=2).reshape(-1, 6))[:-1]
    total = found[:, :3].sum(axis=1)
    off = np.column_stack([total - 3.0, found[:, 3:]])
    assert off.std(axis=0) == pytest.approx(np.full(1 + CONTRASTS, 0.3 / np.sqrt(8)), rel=0.05)
    assert np.abs(np.corrcoef(off.T) - np.eye(1 + CONTRASTS)).max() < 0.06
    # Of a surface that sends on a part, and more of what is red, the contrasts are off by what is left of the sum.
    part = in_part(found.copy(), np.tile((0.9, 0.3, 0.0), (5000, 1)))
    assert part[:, 3:] == pytest.approx(found[:, 3:] * (part[:, :3].sum(axis=1) / total)[:, None])
