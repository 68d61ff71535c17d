"""Bakes that are updated: the same light as a bake of the changed scene gives, and exactly the first where it is again
what it was."""

from dataclasses import replace

import numpy as np
import pytest
from detp.core.bake import baked
from detp.core.errors import InvalidSettingError, NotUpdatableError, SessionTooLargeError
from detp.core.estimator.estimate import IrradianceEstimate
from detp.core.lights.area import AreaLight
from detp.core.lights.environment import EnvironmentWorld
from detp.core.lights.point import PointLight
from detp.core.lights.spot import SpotLight
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from detp.core.packing import packed, unpacked
from detp.core.points import Points
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.core.update.changed_places import Balls, Sight
from detp.core.update.first_bake import KINDS
from detp.core.update.session import BakeSession
from detp.core.update.unchanged import light_scale, same_rows, same_triangles
from rooms import box_quads, face_points, scene_of
from scipy import stats

LAMP = PointLight((2.2, 1.5, 2.2), (100.0, 90.0, 80.0), 0.15)
BAKES = 5


def room(corner=None, colour=(0.8, 0.3, 0.1), lamp=LAMP, across=5):
    """A room with points on its walls, ``across`` times as many on each, and a box of half a metre at ``corner`` with
    points of its own, the last."""
    quads, albedo = box_quads((4, 3, 2.5)), [(0.6, 0.6, 0.6)] * 6
    if corner is not None:
        box = box_quads((0.5, 0.5, 0.5))[:, ::-1] + np.array(corner)
        quads, albedo = np.concatenate([quads, box]), albedo + [colour] * 6
    return scene_of(quads, np.array(albedo), lights=(lamp,)), Points(*face_points(quads, across))


def settings(seed=0):
    """Half of the bakes, and so of the updates, by the hybrid: the light is the same."""
    return BakeSettings(error=0.08, photons=12_000, seed=seed, gatherer="hybrid" if seed % 2 else "auto")


BOX, AWAY = (1.0, 1.0, 0.0), (1.5, 1.2, 0.4)
CHANGES = {
    "moved": (room(BOX), room(AWAY)),
    "removed": (room(BOX), room()),
    "added": (room(), room(BOX)),
    "recoloured": (room(BOX), room(BOX, (0.1, 0.2, 0.9))),
}


@pytest.fixture(scope="module")
def sessions():
    """Baked sessions, each with a seed of its own, of a room with its box and of the empty one."""
    found = {}
    for name, scene, seeds in (("box", room(BOX), 0), ("empty", room(), 50)):
        found[name] = [BakeSession(*scene, settings(seeds + number)) for number in range(BAKES)]
        for session in found[name]:
            session.first = finished(session.bake())
    return found


@pytest.fixture(scope="module")
def full(sessions):
    """Whole bakes of the changed scenes by the name of the change, with other seeds than the sessions'."""
    again = {"removed": sessions["empty"], "added": sessions["box"]}
    return {
        name: [session.first for session in again[name]]
        if name in again
        else [baked(*after, settings(100 + seed)) for seed in range(BAKES)]
        for name, (_, after) in CHANGES.items()
    }


def light(result):
    return result.irradiance.sum(axis=1)


@pytest.mark.parametrize("change", CHANGES)
def test_an_update_finds_the_light_of_a_whole_bake(change, sessions, full):
    before, after = CHANGES[change]
    updated = [
        finished(s.update(*after, dear=True))
        for s in sessions["empty" if before[0] is CHANGES["added"][0][0] else "box"]
    ]
    expected = np.mean([light(bake) for bake in full[change]], axis=0)
    seen = expected > 0.02 * np.median(expected)
    off = [(light(u) - light(f))[seen] / expected[seen] for u, f in zip(updated, full[change], strict=True)]
    # Points of one bake share photons and records, so that only bakes are independent: of all points, and of the
    # nearest to the change.
    near = np.argsort(np.linalg.norm(after[1].centres[seen] - BOX, axis=1))[:40]
    for part in (slice(None), near):
        assert stats.ttest_1samp([each[part].mean() for each in off], 0.0).pvalue > 0.002
    errors = [
        np.hypot(u.standard_error.sum(axis=1), f.standard_error.sum(axis=1))
        for u, f in zip(updated, full[change], strict=True)
    ]
    scores = np.concatenate([each * expected[seen] / error[seen] for each, error in zip(off, errors, strict=True)])
    assert 0.6 < np.sqrt(np.mean(scores**2)) < 1.3
    # As good as a whole bake.
    assert np.median([u.relative_error / f.relative_error for u, f in zip(updated, full[change], strict=True)]) < 1.2


def test_without_the_update_the_test_above_would_fail(sessions, full):
    old = np.mean([light(s.first)[:150] for s in sessions["box"]], axis=0)
    new = np.array([light(bake)[:150] for bake in full["moved"]])
    lit = new.mean(axis=0) > 0.02 * np.median(new)
    scores = (old - new.mean(axis=0))[lit] / np.maximum(new.std(axis=0, ddof=1)[lit], 1e-9)
    assert np.sqrt(np.mean(scores**2)) > 2.0


def test_there_and_back_again_is_exactly_the_first_bake(sessions):
    session, generator = sessions["box"][0], np.random.default_rng(1)
    for _ in range(2):
        finished(session.update(*room(generator.uniform((0.2, 0.2, 0.0), (3.2, 2.2, 1.5))), dear=True))
    again = finished(session.update(*room(BOX)))
    assert np.array_equal(again.irradiance, session.first.irradiance)
    assert np.array_equal(again.standard_error, session.first.standard_error)


def test_after_many_moves_the_light_is_that_of_the_last_one_alone_and_back_again_the_first():
    """Errors cannot add up, where an update is a function of the first bake and the scene as it is."""
    session, generator = BakeSession(*room(BOX, across=2), BakeSettings(error=0.5)), np.random.default_rng(5)
    first = finished(session.bake())
    other = BakeSession.of(session.kept)
    for corner in generator.uniform((0.2, 0.2, 0.0), (3.2, 2.2, 1.5), (25, 3)):
        last = room(corner, across=2)
        moved = finished(session.update(*last, dear=True))
    alone, back = finished(other.update(*last, dear=True)), finished(session.update(*room(BOX, across=2)))
    for one, same in ((moved, alone), (first, back)):
        assert np.array_equal(one.irradiance, same.irradiance)
        assert np.array_equal(one.standard_error, same.standard_error)
    assert not np.array_equal(moved.irradiance, first.irradiance)


def test_stronger_lights_of_another_colour_need_nothing_found(sessions):
    session, scale = sessions["box"][0], np.array([2.0, 0.5, 3.0])
    scene, points = room(BOX, lamp=replace(LAMP, power=scale * LAMP.power))
    again = finished(session.update(scene, points))
    assert again.irradiance == pytest.approx(session.first.irradiance * scale, rel=1e-12)
    assert again.standard_error == pytest.approx(session.first.standard_error * scale, rel=1e-12)
    moved = finished(session.update(*room(AWAY, lamp=replace(LAMP, power=scale * LAMP.power)), dear=True))
    assert moved.irradiance == pytest.approx(
        finished(session.update(*room(AWAY), dear=True)).irradiance * scale, rel=1e-12
    )
    assert light_scale(scene.lights, ()) is None


def test_lights_are_scaled_only_when_all_are_alike():
    lamps = [LAMP, SunLight((0, 0, -1), (3.0, 2.0, 0.0)), UniformWorld((0.1, 0.1, 0.2))]
    twice = [replace(LAMP, power=2 * LAMP.power), replace(lamps[1], irradiance=2 * lamps[1].irradiance)]
    twice.append(UniformWorld(2 * lamps[2].radiance))
    assert np.array_equal(light_scale(lamps, lamps), np.ones(3)) and np.array_equal(light_scale([], []), np.ones(3))
    assert light_scale(lamps, twice) == pytest.approx(2.0)
    assert light_scale(lamps, [twice[0], *lamps[1:]]) is None
    assert light_scale(lamps, [replace(LAMP, radius=0.2), *lamps[1:]]) is None
    # Of light in a channel that was dark nothing is known.
    assert light_scale(lamps[1:2], [replace(lamps[1], irradiance=(3.0, 2.0, 1.0))]) is None


def test_the_same_change_gives_the_same_light(sessions):
    once, twice = (finished(sessions["box"][0].update(*room(AWAY), dear=True)) for _ in range(2))
    assert np.array_equal(once.irradiance, twice.irradiance)


def test_what_cannot_be_updated_is_said(sessions):
    session, (scene, points) = sessions["box"][0], room(BOX)
    with pytest.raises(NotUpdatableError, match="lights have changed"):
        finished(session.update(*room(BOX, lamp=replace(LAMP, position=(2.0, 1.5, 2.2)))))
    with pytest.raises(NotUpdatableError, match="left the box"):
        finished(session.update(*room((9.0, 0.0, 0.0))))
    with pytest.raises(NotUpdatableError, match="no finished bake"):
        finished(BakeSession(scene, points, settings()).update(scene, points))
    with pytest.raises(InvalidSettingError, match="shadow rays"):
        BakeSession(scene, points, BakeSettings(direct="photons"))
    large = BakeSession(scene, points, settings(), limit=10_000)
    assert np.array_equal(finished(large.bake()).irradiance, session.first.irradiance)
    with pytest.raises(SessionTooLargeError, match="GB"):
        finished(large.update(scene, points))


def test_where_most_light_is_to_be_found_anew_a_bake_is_due(sessions):
    session = sessions["box"][0]
    with pytest.raises(NotUpdatableError, match="as long as a bake"):
        finished(session.update(*room(AWAY)))
    # Without its box the room has few points that see much of where it was.
    finished(session.update(*room()))
    assert np.array_equal(finished(session.update(*room(BOX))).irradiance, session.first.irradiance)


def test_rows_that_come_several_times_are_matched_one_by_one():
    before = np.array([(1.0, 0.0), (2.0, 0.0), (1.0, 0.0), (3.0, 5.0)])
    after = np.array([(4.0, 0.0), (1.0, -0.0), (1.0, 0.0), (1.0, 0.0), (3.0, 5.0)])
    # The third stands where it stood, the second has moved there from the first place, and there is no other.
    assert same_rows(before, after).tolist() == [-1, 0, 2, -1, 3]


def test_triangles_are_the_same_in_place_and_material():
    before, after = room(BOX)[0], room(BOX, (0.1, 0.2, 0.9))[0]
    assert np.array_equal(same_triangles(before, after) < 0, np.arange(24) >= 12)


def test_balls_hold_all_that_changed_and_are_apart_where_that_is():
    parts = np.concatenate([np.random.default_rng(2).uniform(0, 1, (9, 3, 3)) + at for at in (0, (7, 0, 0), (0, 9, 9))])
    balls = Balls.around(parts)
    assert len(balls) == 3 and (balls.radii < 1.0).all()
    assert balls.reach(parts.reshape(-1, 3), 0.0).all()


def test_rays_into_cones_bring_the_light_that_comes_from_there():
    balls = Balls(np.array([(0.3, 0.0, 1.0), (-0.5, 0.2, 0.8), (0.0, 0.0, 0.1)]), np.array([0.4, 0.5, 0.05]))
    place, up = np.array([(0.0, 0.0, 0.0)]), np.array([(0.0, 0.0, 1.0)])
    generator = np.random.default_rng(3)
    sight = Sight.of(balls, np.repeat(place, 4000, axis=0), np.repeat(up, 4000, axis=0), 0.1)
    rays = sight.rays(generator)
    # Cosine-weighted directions say the same of the share of light from all cones together.
    found = np.bincount(rays.row, rays.scale, 4000)
    directions = np.c_[generator.normal(size=(200_000, 2)), np.zeros(200_000)]
    directions /= np.linalg.norm(directions, axis=1)[:, None] / np.sqrt(generator.random(200_000))[:, None]
    directions[:, 2] = np.sqrt(1.0 - (directions[:, :2] ** 2).sum(axis=1))
    expected = (sight.ball(np.zeros(200_000, int), directions) >= 0).mean()
    assert found.mean() == pytest.approx(expected, abs=4 * np.hypot(found.std() / 63, 0.5 / 447))


def test_exchanged_particles_leave_the_sums_of_the_others():
    generator = np.random.default_rng(4)

    def sums(particles):
        total, squares, repeated = generator.random((3, 6, 2, 3))
        return IrradianceEstimate(
            total,
            squares,
            repeated[:, 0],
            generator.random((6, 3)),
            squares[::-1],
            np.ones((6, 2)),
            particles,
            (1.0, 2.0),
        )

    kept, old, new = sums(50), sums(0), sums(0)
    found = kept.merged(old).exchanged(old, new)
    for name in ("total", "squares", "repeated", "contrasts"):
        assert getattr(found, name) == pytest.approx(getattr(kept.merged(new), name))


LIGHTS = (
    LAMP,
    PointLight((1.0, 2.0, 2.0), (5.0, 5.0, 9.0)),
    SpotLight((3.0, 1.0, 2.4), (0.1, 0.2, -1.0), (60.0, 50.0, 50.0), 1.2, 0.3, 0.05),
    AreaLight((2.0, 1.5, 2.4), (0.4, 0.0, 0.0), (0.0, 0.3, 0.0), (20.0, 20.0, 30.0)),
    SunLight((0.3, 0.2, -1.0), (3.0, 3.0, 2.0), 0.1),
    EnvironmentWorld(np.random.default_rng(6).random((4, 8, 3))),
)


def test_a_session_that_was_packed_finds_the_same_light():
    scene, points = room(BOX, across=2)
    emission = np.zeros((len(scene.triangles), 3))
    emission[3] = 2.0
    scene = replace(scene, lights=LIGHTS, emission=emission)
    session = BakeSession(scene, points, BakeSettings(error=0.5))
    first = finished(session.bake())
    other = BakeSession.of(unpacked(packed(session.kept, KINDS), KINDS))
    changed, moved = room(AWAY, across=2)
    changed = replace(changed, lights=scene.lights, emission=scene.emission)
    once, twice = (finished(each.update(changed, moved, dear=True)) for each in (session, other))
    assert twice.irradiance == pytest.approx(once.irradiance, rel=1e-9, abs=1e-12)
    assert np.array_equal(finished(other.update(scene, points)).irradiance, first.irradiance)
