"""One colour per element: from its own corners, from its neighbours when it has none, in the quantity asked for."""

import numpy as np
import pytest
from detp.detp_addon.writing.element_values import Faces, quantity_values, spread


def strip(columns, by_vertex, apart=1.0):
    """A row of ``columns`` squares, ``apart`` long, whose corners go round from the lower left."""
    places = np.array([(apart * x, y, 0) for x in range(columns + 1) for y in (0, 1)], float)
    corners = np.array([(2 * x, 2 * x + 2, 2 * x + 3, 2 * x + 1) for x in range(columns)]).ravel()
    return Faces(np.repeat(np.arange(columns), 4), corners, places, by_vertex)


def grey(*values):
    return np.repeat(np.array(values, float)[:, None], 3, axis=1)


def test_corners_without_a_point_take_from_their_own_face_first():
    rows = np.array([0, -1, -1, 1, 2, 2, 2, 2])
    filled = spread(grey(1, 3, 9), rows, strip(2, False))[:, 0]
    # Not from the second face, which shares the vertices.
    np.testing.assert_allclose(filled, [1, 1, 3, 3, 9, 9, 9, 9])


def test_faces_without_any_take_from_their_neighbours_at_the_vertices_ring_by_ring():
    rows = np.array([0, 0, 1, 1, *[-1] * 8, 2, 2, 2, 2])
    filled = spread(grey(1, 3, 9), rows, strip(4, False))[:, 0].reshape(4, 4)
    np.testing.assert_allclose(filled[1, [0, 3]], (1, 3))
    np.testing.assert_allclose(filled[2, 1:3], 9)
    assert filled[1:3].min() >= 1 and filled.max() == 9


def test_vertices_without_a_point_are_filled_in_rings_and_nearer_ones_weigh_more():
    rows = np.full(16, -1)
    rows[[0, 3]], rows[[13, 14]] = 0, 1
    filled = spread(grey(2, 6), rows, strip(4, True))[:, 0]
    np.testing.assert_allclose(filled[[0, 1, 8, 9]], [2, 2, 6, 6])
    np.testing.assert_allclose(filled[[2, 3, 6, 7]], [2, 2, 6, 6])
    np.testing.assert_allclose(filled[4:6], 4)
    faces = strip(2, True)
    faces.positions[4:, 0] = 4
    rows = np.array([0, -1, -1, 0, -1, 1, 1, -1])
    # One edge away from 2, three from 6.
    np.testing.assert_allclose(spread(grey(2, 6), rows, faces)[2:4, 0], 3)


def test_what_no_ring_reaches_takes_the_mean():
    one = strip(1, True)
    alone = Faces(one.corner_face, one.corner_vertex, np.concatenate([one.positions, np.ones((2, 3))]), True)
    filled = spread(grey(1, 3), np.array([0, 0, 1, 1]), alone)
    np.testing.assert_allclose(filled[4:], 2)
    assert (spread(grey(1), np.full(4, -1), one) == 0).all()


def test_a_vertex_is_the_mean_of_its_corners_by_their_angles_without_hidden_ones():
    # A square and half a square meet in the vertices 2 and 3.
    places = np.array([(0, 0, 0), (0, 1, 0), (1, 0, 0), (1, 1, 0), (2, 0, 0)], float)
    faces = Faces(np.array([0, 0, 0, 0, 1, 1, 1]), np.array([0, 2, 3, 1, 2, 4, 3]), places, True)
    filled = spread(grey(1, 7), np.array([0, 0, 0, 0, 1, 1, 1]), faces)[:, 0]
    np.testing.assert_allclose(filled, [1, 1, 4, (90 * 1 + 45 * 7) / 135, 7])
    hidden = spread(grey(1, 7), np.array([0, 0, -1, 0, 1, -1, 1]), faces)[:, 0]
    np.testing.assert_allclose(hidden[[2, 3]], [4, 7])
    # The vertex without any other corner has neighbours at distance 1 and the square root of 2.
    assert hidden[4] == pytest.approx((4 * 1 + 7 * 2**-0.5) / (1 + 2**-0.5))


def test_a_large_buried_part_is_filled_quickly():
    columns = 20_000
    rows = np.full(4 * columns, -1)
    rows[:4], rows[-4:] = 0, 1
    for by_vertex in (False, True):
        filled = spread(grey(1, 3), rows, strip(columns, by_vertex))
        assert filled.min() == 1 and filled.max() == 3
        assert (filled > 0).all()


def test_quantities_follow_their_formulas():
    irradiance, albedo, emission = (np.full((2, 3), value) for value in (np.pi, 0.5, 0.25))
    np.testing.assert_allclose(quantity_values("irradiance", irradiance, albedo, emission), np.pi)
    np.testing.assert_allclose(quantity_values("lighting", irradiance, albedo, emission), 1)
    np.testing.assert_allclose(quantity_values("shaded", irradiance, albedo, emission), 0.75)
