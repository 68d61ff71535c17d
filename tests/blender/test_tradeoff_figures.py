"""Errors beyond a reference's noise, the Pareto front, and time at equal error, on made-up figures."""

import numpy as np
import pytest
from detp.core.settings import BakeSettings
from detp.detp_addon.command.command import _parser
from detp.detp_addon.tradeoff.candidates import candidates
from detp.detp_addon.tradeoff.cycles_bake import extrapolated_seconds
from detp.detp_addon.tradeoff.face_copies import INWARD, CopiedFaces
from detp.detp_addon.tradeoff.figures import equal_error_seconds, figures, pareto_front


def test_the_front_holds_what_nothing_beats():
    seconds, errors = [1.0, 2.0, 3.0, 4.0, 2.0, 5.0], [0.5, 0.2, 0.3, 0.1, 0.2, 0.1]
    assert pareto_front(seconds, errors).tolist() == [True, True, False, True, True, False]


def test_the_references_noise_is_taken_out_in_squares():
    generator = np.random.default_rng(1)
    truth = generator.uniform(1.0, 2.0, 40_000)
    first, second = truth * generator.normal(1.0, 0.04, (2, len(truth)))
    ours = truth * generator.normal(1.0, 0.03, len(truth))
    noise = np.abs(first - second) / 2
    found = figures(ours, (first + second) / 2, noise)
    # The median of |normal| is 0.6745 sigma; its standard error here is below one percent of it.
    assert found["median_beyond_noise"] == pytest.approx(0.6745 * 0.03, rel=0.04)
    assert found["percentile_95_beyond_noise"] == pytest.approx(1.96 * 0.03, rel=0.04)
    assert found["reference_noise"] == pytest.approx(0.6745 * 0.04 / np.sqrt(2), rel=0.04)


def test_dark_points_count_but_have_no_relative_error():
    found = figures(np.array([1.1, 0.5]), np.array([1.0, 0.0]), np.zeros(2))
    assert (found["points"], found["lit"]) == (2, 1)
    assert found["median_beyond_noise"] == pytest.approx(0.1)
    assert found["mean_absolute_beyond_noise"] == pytest.approx(0.6)
    assert "median_beyond_noise" not in figures(np.zeros(2), np.zeros(2), np.zeros(2))


def test_time_at_equal_error_with_the_set_up_each_time_and_once():
    samples = np.array([1, 4, 16, 64])
    seconds, errors = 10.0 + 0.5 * samples, 0.4 / np.sqrt(samples)
    plain, once = equal_error_seconds(samples, seconds, errors, aim=0.02)
    assert plain == pytest.approx(12.0 * 100)  # four samples, a tenth of their error
    assert once == pytest.approx(10.0 + 0.5 * 400)
    # A coarser error than that of one sample still needs one.
    assert equal_error_seconds(samples, seconds, errors, aim=0.8)[1] == pytest.approx(10.5)
    assert equal_error_seconds([8], [3.0], [0.2], aim=0.1) == pytest.approx((12.0, 12.0))
    # Nothing can be told of what samples cost when four times as many took no longer.
    assert np.isnan(equal_error_seconds([4, 16], [0.06, 0.05], [0.2, 0.1], aim=0.01)[1])


def test_the_time_of_objects_that_were_not_reached_follows_their_corners():
    corners = np.array([10.0, 40.0, 20.0, 1000.0, 30.0])
    assert extrapolated_seconds(corners, 0.5 + 0.01 * corners) == pytest.approx(2.5 + 11.0)
    assert extrapolated_seconds(corners, 0.5 + 0.01 * corners[:2]) == pytest.approx(2.5 + 11.0)
    assert extrapolated_seconds(corners, np.array([2.0])) == pytest.approx(10.0)
    assert extrapolated_seconds(corners, np.array([2.0, 1.0])) == pytest.approx(7.5)


def test_corners_are_drawn_into_their_faces_and_lifted():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    faces = CopiedFaces.joined([CopiedFaces(square, np.tile([0.0, 0, 1], (4, 1)), np.array([4]))] * 2)
    assert faces.face.tolist() == [0] * 4 + [1] * 4
    moved = faces.just_inside(radius=1.0)
    assert moved.corners[0, :2] == pytest.approx([INWARD / 2] * 2)
    assert (moved.corners[:, 2] > 0).all() and (moved.corners[:, 2] < 1e-4).all()
    assert len(faces.taken(np.array([False, True])).corners) == 4


def test_every_candidate_can_be_asked_for_on_the_command_line():
    names = ("quality", "error", "photons", "radius", "gatherer", "estimator", "direct")
    for candidate in candidates(0.25, quick=False):
        given = _parser().parse_args(["bake", "scene.blend", *candidate.options])
        asked = BakeSettings(seconds=given.time, **{name: getattr(given, name) for name in names})
        assert asked == candidate.settings
