"""How values bend where triangles meet."""

import numpy as np
import pytest
from detp.core.fit.bends import Bends
from detp.core.fit.shown_faces import ShownFaces


def two_triangles(third, fourth=(0.7, -1.0, 0.0)):
    """Triangles on either side of the edge from the origin to x = 1, with these far corners."""
    positions = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], third, fourth])
    triangles = np.array([[0, 1, 2], [1, 0, 3]])
    normals = np.broadcast_to([0.0, 0.0, 1.0], (2, 3, 3))
    return ShownFaces(triangles, positions[triangles], normals, 4), positions


def test_values_that_run_evenly_do_not_bend():
    faces, positions = two_triangles((0.2, 2.0, 0.0))
    assert Bends.of(faces).at(3.0 + positions @ [1.0, -2.0, 0.0]) == pytest.approx([0.0], abs=1e-12)


def test_a_bend_is_what_the_line_between_the_far_corners_passes_above_the_edge():
    faces, _ = two_triangles((0.2, 2.0, 0.0))
    # The line crosses the edge a third of its way up from y = -1.
    assert Bends.of(faces).at(np.array([0.0, 0.0, 3.0, 0.0])) == pytest.approx([1.0])


def test_a_fold_counts_as_if_it_lay_flat():
    bends = Bends.of(two_triangles((0.2, 0.0, 2.0))[0])
    assert bends.at(np.array([0.0, 0.0, 3.0, 0.0])) == pytest.approx([1.0])
    assert bends.angles == pytest.approx([np.pi / 2.0])


def test_slivers_beside_each_other_and_edges_of_more_than_two_triangles_have_none():
    assert len(Bends.of(two_triangles((9.0, 0.1, 0.0))[0])) == 0
    faces, _ = two_triangles((0.2, 2.0, 0.0))
    thrice = ShownFaces(*(np.concatenate([part, part[:1]]) for part in (faces.values, faces.corners, faces.normals)), 4)
    assert len(Bends.of(thrice)) == 0


def test_factors_are_those_of_the_squares():
    faces, _ = two_triangles((0.2, 2.0, 0.0))
    bends, values = Bends.of(faces), np.array([1.0, -2.0, 3.0, 0.5])
    pairs, factors = bends.pairs, bends.products(np.array([2.0]))
    squares = bends.squares(np.array([2.0])) @ values**2 + 2.0 * factors @ values[pairs].prod(axis=1)
    assert squares == pytest.approx(2.0 * bends.at(values)[0] ** 2)
