"""Every sampler against its own density: chi-square of values that should be uniform, 200 000 samples each."""

import numpy as np
import pytest
from detp.core.bounds import Bounds
from detp.core.sampling import (
    box_entry,
    choose,
    cone,
    cosine_hemisphere,
    disc,
    frames,
    projected_area,
    sphere,
    triangle,
)
from made_lights import LEAST_P, assert_uniform, turn
from scipy.stats import chisquare

SAMPLES = 200_000


def uniforms(columns, seed=1):
    return np.random.default_rng(seed).random((SAMPLES, columns))


def unit(vector):
    return np.asarray(vector, float) / np.linalg.norm(vector)


def seen_from(directions, axis):
    """Components of directions along axis and along two independent perpendiculars (not those of the samplers)."""
    first = unit(np.cross(axis, [0.3, -0.5, 0.8]))
    return directions @ axis, directions @ first, directions @ np.cross(axis, first)


def test_frames_are_orthonormal_and_right_handed():
    normals = np.random.default_rng(2).normal(size=(1000, 3))
    normals[:4] = [(0, 0, 1), (0, 0, -1), (0, 1, -0.0), (1e-9, 0, -1)]
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    first, second = frames(normals)
    matrices = np.stack([first, second, normals], axis=1)
    assert np.abs(matrices @ matrices.transpose(0, 2, 1) - np.eye(3)).max() < 1e-14
    assert np.linalg.det(matrices) == pytest.approx(1, abs=1e-14)


def test_disc_is_uniform():
    points = disc(uniforms(2))
    assert_uniform((points**2).sum(axis=1), turn(*points.T))


def test_disc_keeps_centre_and_corners_finite():
    edge = np.nextafter(1, 0)
    points = disc(np.array([[0.5, 0.5], [0, 0], [edge, 0], [0, edge], [edge, edge]]))
    assert points[0] == pytest.approx([0, 0])
    assert np.linalg.norm(points[1:], axis=1) == pytest.approx(1)


def test_triangle_is_uniform():
    weights = triangle(uniforms(2))
    assert weights.sum(axis=1) == pytest.approx(1)
    assert_uniform((1 - weights[:, 0]) ** 2, weights[:, 2] / (weights[:, 1] + weights[:, 2]))


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (1, 2, -3)])
def test_cosine_hemisphere_has_its_density(axis):
    axis = unit(axis)
    directions = cosine_hemisphere(np.tile(axis, (SAMPLES, 1)), uniforms(2))
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1)
    along, x, y = seen_from(directions, axis)
    assert_uniform(1 - along**2, turn(x, y))


def test_cosine_hemisphere_takes_a_normal_for_each_row():
    normals = sphere(uniforms(2, 3))
    directions = cosine_hemisphere(normals, uniforms(2, 4))
    assert_uniform(np.einsum("ij,ij->i", normals, directions) ** 2)


def test_sphere_is_uniform():
    directions = sphere(uniforms(2))
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1)
    assert_uniform(0.5 + 0.5 * directions[:, 2], turn(directions[:, 0], directions[:, 1]))


@pytest.mark.parametrize("half", [1e-6, 0.005, 1.0, np.pi / 2, np.pi])
def test_cone_is_uniform_by_solid_angle(half):
    axis = unit((-2, 1, 0.5))
    directions = cone(axis, half, uniforms(2))
    _, x, y = seen_from(directions, axis)
    # 1 - cos t = |direction - axis|^2 / 2 does not cancel
    fall = 0.5 * ((directions - axis) ** 2).sum(axis=1)
    assert_uniform(fall / (2 * np.sin(half / 2) ** 2) * (1 - 1e-8), turn(x, y))


def test_cone_of_no_width_is_its_axis():
    axis = unit((1, 1, 1))
    assert cone(axis, 0.0, uniforms(2)[:10]) == pytest.approx(np.tile(axis, (10, 1)), abs=1e-15)


def test_choose_follows_the_weights_and_leaves_a_uniform():
    weights = np.array([0.0, 2.0, 0.0, 0.5, 7.0, 1e-300, 0.5, 0.0])
    chosen, left = choose(np.cumsum(weights), uniforms(1)[:, 0])
    counts = np.bincount(chosen, minlength=len(weights))
    likely = weights > 0.1
    assert counts[~likely].sum() == 0
    assert chisquare(counts[likely], SAMPLES * weights[likely] / 10).pvalue > LEAST_P
    for row in np.flatnonzero(likely):
        assert_uniform(left[chosen == row])


@pytest.mark.parametrize("weights", [[0, 3, 0], [0, 0, 0.1, 0.7, 0], [1e-310, 0]])
def test_choose_never_takes_a_row_without_weight(weights):
    chosen, left = choose(np.cumsum(weights), np.array([0.0, 0.5, np.nextafter(1, 0)]))
    assert (np.asarray(weights)[chosen] > 0).all()
    assert ((left >= 0) & (left < 1)).all()


def test_choose_without_any_weight_is_row_zero():
    chosen, left = choose(np.zeros(4), np.array([0.0, 0.9]))
    assert chosen.tolist() == [0, 0]
    assert ((left >= 0) & (left < 1)).all()


BOX = Bounds(np.array([-1.0, 2.0, 5.0]), np.array([2.0, 3.0, 7.0]))


@pytest.mark.parametrize("direction", [(1, 2, -3), (-0.2, 0.1, 1), (0, -1, 0), (0, 0.6, 0.8)])
def test_box_entry_is_uniform_over_the_boxs_shadow(direction):
    direction = unit(direction)
    points = box_entry(BOX, np.tile(direction, (SAMPLES, 1)), uniforms(2))
    shares = np.abs(direction) * BOX.face_areas
    entry = np.where(direction > 0, BOX.lower, BOX.upper)
    on_face = (points == entry) & (shares > 0)
    assert (on_face.sum(axis=1) == 1).all()
    lit = shares > 0
    if lit.sum() > 1:
        assert chisquare(on_face.sum(axis=0)[lit], SAMPLES * (shares / shares.sum())[lit]).pvalue > LEAST_P
    for axis in np.flatnonzero(lit):
        within = ((points - BOX.lower) / BOX.size)[on_face[:, axis]]
        assert_uniform(within[:, (axis + 1) % 3], within[:, (axis + 2) % 3])


@pytest.mark.parametrize("upper", [(2, 3, 5), (-1, 3, 7), (-1, 2, 7), (-1, 2, 5)], ids=str)
def test_box_entry_stays_on_boxes_without_volume(upper):
    box = Bounds(BOX.lower, np.array(upper, float))
    points = box_entry(box, sphere(uniforms(2)), uniforms(2, 5))
    assert ((points >= box.lower) & (points <= box.upper)).all()


def test_projected_area_of_a_box():
    cube = Bounds(np.zeros(3), np.ones(3))
    directions = np.array([(1, 0, 0), unit((-1, 1, 1)), unit((0, 1, -1))])
    assert projected_area(cube, directions) == pytest.approx([1, np.sqrt(3), np.sqrt(2)])
    # Cauchy: the mean shadow of a convex body is a quarter of its surface
    shadows = projected_area(BOX, sphere(uniforms(2)))
    quarter = BOX.face_areas.sum() / 2
    assert abs(shadows.mean() - quarter) < 3 * shadows.std() / np.sqrt(SAMPLES)
