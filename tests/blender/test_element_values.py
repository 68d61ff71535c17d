"""One colour per element: its own point's, its neighbours' when it has none, in the quantity that was asked for."""

import numpy as np
from detp.detp_addon.element_values import Faces, quantity_values, spread


def test_elements_without_a_point_take_from_their_face_then_from_the_object():
    values = np.array([[1.0, 0, 0], [3.0, 0, 0], [8.0, 0, 0]])
    faces = Faces(np.array([0, 0, 0, 1, 1, 1, 2, 2, 2]), np.arange(9))
    rows = np.array([0, 1, -1, 2, 2, 2, -1, -1, -1])
    filled = spread(values, rows, faces)[:, 0]
    np.testing.assert_allclose(filled, [1, 3, 2, 8, 8, 8, 28 / 5, 28 / 5, 28 / 5])
    assert (spread(values, np.full(9, -1), faces) == 0).all()


def test_vertices_without_a_face_take_the_mean_of_the_object():
    values = np.array([[1.0, 1, 1], [3.0, 3, 3]])
    faces = Faces(np.array([0, 0, 0]), np.array([0, 1, 2]))
    filled = spread(values, np.array([0, 1, -1, -1]), faces)
    np.testing.assert_allclose(filled[:, 0], [1, 3, 2, 2])


def test_quantities_follow_their_formulas():
    irradiance, albedo, emission = (np.full((2, 3), value) for value in (np.pi, 0.5, 0.25))
    np.testing.assert_allclose(quantity_values("irradiance", irradiance, albedo, emission), np.pi)
    np.testing.assert_allclose(quantity_values("lighting", irradiance, albedo, emission), 1)
    np.testing.assert_allclose(quantity_values("shaded", irradiance, albedo, emission), 0.75)
