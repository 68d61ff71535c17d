"""Geometry follows the face and cosines the shading normal: leaning cards, hollows between smooth faces, low sheets."""

import numpy as np
import pytest
from detp.core.bake import baked
from detp.core.estimator.standpoints import standpoints
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from detp.core.points import Points
from detp.core.rays import RayCaster
from detp.core.settings import BakeSettings
from rooms import box_quads, scene_of

CARD = np.array([[(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)]], float)
FACE = np.array((0, -1.0, 0))
INWARD = CARD[0].mean(axis=0) - CARD[0]


def leaning(degrees: float) -> np.ndarray:
    """The normal of a card that faces -Y, turned so far up."""
    angle = np.radians(degrees)
    return np.cos(angle) * FACE + np.sin(angle) * np.array((0, 0, 1.0))


def card(degrees, lights, others=(), **settings):
    """The light at the corners of a card by shading normals that lean so far, among ``others``."""
    scene = scene_of(np.concatenate([CARD, *others]), 0.0, lights=lights)
    normals, facing = np.tile(leaning(degrees), (4, 1)), np.tile(FACE, (4, 1))
    return baked(scene, Points(CARD[0], normals, INWARD, facing), BakeSettings(**settings))


@pytest.mark.parametrize("degrees", [0, 30, 60, 75, 85, 89, 90])
@pytest.mark.parametrize("together", [False, True])
def test_the_sun_lights_a_card_from_its_front_by_the_cosine_of_its_normal(degrees, together):
    others = [CARD + (0, 0.5, 0), CARD + (1.0, 0, 0)] if together else []
    for side in (-1, 1):
        sun = SunLight((0.1, -side * 0.6, -0.8), (3.0,) * 3)
        expected = 3 * max(float(-sun.direction @ leaning(degrees)), 0.0) if side < 0 else 0.0
        assert np.allclose(card(degrees, [sun], others).irradiance, expected, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("degrees", [0, 45, 70, 90])
def test_a_leaning_card_sees_the_sky_before_its_face_alone(degrees, seed):
    result = card(degrees, [UniformWorld((1 / np.pi,) * 3)], error=0.01, seed=seed)
    expected = (1 + np.cos(np.radians(degrees))) / 2
    # A corner of four walks through the sky in steps of its rays, which are the same at each.
    assert np.allclose(result.irradiance, expected, atol=4 * result.standard_error.max() + 0.01)


def test_the_corners_of_a_smooth_box_read_as_its_walls():
    """Three faces share each corner: moved aside by what of them lies in its plane, none must come to lie behind it."""
    room = box_quads((2, 2, 2)) - 1
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    normals = -corners / np.sqrt(3)
    # One of the three faces is cut in two there, the others lead along their diagonals, or along one edge.
    inward = -corners * np.random.default_rng(1).uniform(0.6, 1.0, corners.shape)
    furnace = scene_of(room, 0.5, 0.5 / np.pi)
    result = baked(furnace, Points(corners, normals, inward, normals), BakeSettings("final"))
    assert np.abs(result.irradiance.mean() - 1) < 0.01
    assert np.abs(result.irradiance - 1).max() < 0.02 + 4 * result.standard_error.max()


def test_points_are_not_lifted_through_a_roof_that_is_met_from_behind():
    floor = np.array([[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]], float)
    roof = floor + np.array([(0, 0, 0), (0, 0, 0.05), (0, 0, 0.05), (0, 0, 0)])
    corners, inward = floor[0], np.array((0.5, 0.5, 0)) - floor[0]
    up = np.tile((0, 0, 1.0), (4, 1))
    caster = RayCaster(scene_of(np.concatenate([floor, roof])).corners, corners)
    (places,) = standpoints(caster, corners, up, inward)
    assert (places.origins[:, 2] > 0).all()
    assert (places.origins[:, 2] < 0.05 * places.origins[:, 0]).all()
