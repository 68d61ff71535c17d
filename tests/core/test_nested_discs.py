"""Nested discs: their areas, the rings of crossings, and how much of a disc is used where light is even or is not."""

import numpy as np
import pytest
from detp.core.discs import TangentDiscs
from detp.core.estimator.nested_discs import nested_estimate
from detp.core.estimator.rings import RINGS, nested_areas, offsets, rings_of
from detp.core.estimator.visible_area import DIRECTIONS
from detp.core.gatherers.gatherer import Crossings
from detp.core.segments import Segments
from scipy import stats

DISC = np.pi * 0.25 ** np.arange(RINGS)


def outlines(count, seed):
    """Outlines of discs of radius 1, some whole, some cut near the centre or far from it, one with corners at it."""
    generator = np.random.default_rng(seed)
    reach = np.minimum(1.0, generator.uniform(0.0, 1.0, (count, 1)) + generator.exponential(0.4, (count, DIRECTIONS)))
    reach[0], reach[1, ::2], reach[2, :16] = 1.0, 0.0, 0.001
    return reach


def inside(reach, points):
    """Which points (P, 2) lie inside the outline with these (D,) corners, by the angles and the chords."""
    turn = np.arctan2(points[:, 1], points[:, 0]) % (2 * np.pi) * (DIRECTIONS / (2 * np.pi))
    at = np.minimum(turn.astype(int), DIRECTIONS - 1)
    angle = np.arange(DIRECTIONS + 1) * (2 * np.pi / DIRECTIONS)
    corners = np.append(reach, reach[0])[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    a, b = corners[at], corners[at + 1]
    side, way = b - a, points - a
    return side[:, 0] * way[:, 1] >= side[:, 1] * way[:, 0]


def test_nested_areas_are_those_that_points_thrown_at_random_find():
    reach, count = outlines(12, 1), 200_000
    areas = nested_areas(3.0 * reach, np.full(12, 3.0)) / 9.0
    assert areas[0] == pytest.approx(DISC)
    generator = np.random.default_rng(2)
    for ring in range(RINGS):
        radius = 0.5**ring
        points = radius * np.sqrt(generator.random((count, 1)))
        angle = generator.random(count) * 2 * np.pi
        points = points * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        for row in range(1, 12):
            # The outermost is a polygon, whose sides run inside the circle.
            share = areas[row, ring] / DISC[ring]
            hits = inside(reach[row], points).sum()
            assert stats.binomtest(int(hits), count, min(share, 1.0)).pvalue > 1e-4 or share == pytest.approx(1.0)


def test_a_smaller_nested_disc_never_has_more_area_and_no_outline_gives_none():
    areas = nested_areas(outlines(500, 3), np.ones(500))
    assert (np.diff(areas, axis=1) <= 1e-12).all() and (areas >= 0).all()
    assert (nested_areas(np.zeros((1, DIRECTIONS)), np.ones(1)) == 0).all()


def test_crossings_lie_in_the_ring_of_their_distance():
    generator = np.random.default_rng(4)
    distance = np.array([1.9, 1.01, 0.99, 0.51, 0.49, 0.26, 0.24, 0.0])
    angle = generator.random(8) * 2 * np.pi
    tilt = generator.normal(size=(8, 3)) * 0.3
    at = np.stack([distance * np.cos(angle), distance * np.sin(angle), np.zeros(8)], axis=1) + (5.0, 0.0, 0.0)
    way = np.array((0.0, 0.0, 1.0)) + tilt
    segments = Segments(at + way, at - 2 * way, np.ones((8, 3)), np.zeros(8, np.uint16))
    discs = TangentDiscs.of_radius(np.array([(0.0, 9.0, 0.0), (5.0, 0.0, 0.0)]), [(0, 0, 1)] * 2, 2.0)
    crossings = Crossings(np.arange(8), np.ones(8, np.int64))
    rings = rings_of(offsets(discs, segments, crossings), discs.radii[crossings.disc])
    assert rings.tolist() == [0, 0, 1, 1, 2, 2, 3, 3]


def crossed(expected, points, seed):
    """Estimates of points, whose nested discs of radius 1 are ``expected`` (RINGS,) to be crossed so many times.

    Every crossing brings 1 W of 10 000 particles; returns value, standard error without and with the blur.
    """
    generator = np.random.default_rng(seed)
    counts = generator.poisson(-np.diff(expected, append=0.0), (points, RINGS)).astype(float)
    flux = np.repeat(counts[:, :, None], 3, axis=2)
    samples = 10_000
    value, moment, blur, same = nested_estimate(
        flux, flux * samples, np.full((points, 3), 1.0 * samples), flux, np.tile(DISC, (points, 1)), samples
    )
    assert same == pytest.approx(value)
    return value[:, 0], np.sqrt(moment[:, 0] / samples), np.sqrt(moment[:, 0] / samples + blur[:, 0])


@pytest.mark.parametrize("crossings", [30, 300, 3000])
def test_in_even_light_the_estimate_is_right_and_little_noisier_than_the_whole_disc(crossings):
    value, _, error = crossed(crossings * DISC / np.pi, 40_000, crossings)
    truth = crossings / np.pi
    # Squares grow with the crossings, which leaves a bias of a quarter of the noise's square.
    assert value.mean() / truth == pytest.approx(1.0, abs=0.25 / crossings + 4 * 1.1 / np.sqrt(crossings * len(value)))
    assert value.std() < 1.17 * np.sqrt(crossings) / np.pi
    assert 0.94 < (np.abs(value - truth) < 1.96 * error).mean() < 0.975


def test_beside_a_shadow_only_the_lit_middle_of_the_disc_counts():
    # Light on the inner quarter of the radius alone: the whole disc would see a sixteenth of it.
    expected = 6400 * np.minimum(DISC / np.pi, DISC[2] / np.pi)
    value, _, _ = crossed(expected, 2000, 5)
    assert value.mean() / (6400 / np.pi) == pytest.approx(1.0, abs=0.02)


def test_blur_that_is_not_removed_is_in_the_error():
    # The innermost disc alone is dark, and has few crossings to tell so.
    expected = 1000.0 * np.maximum(DISC - DISC[3], 0.0) / np.pi
    value, noise, error = crossed(expected, 2000, 6)
    assert 0.1 < value.mean() / (1000 / np.pi) < 0.6
    assert (value < 1.96 * noise).mean() < 0.1
    assert (value < 1.96 * error).mean() > 0.9


def test_an_outline_narrower_than_the_nested_discs_leaves_one_estimate():
    generator = np.random.default_rng(7)
    reach = generator.uniform(0.02, 0.12, (500, DIRECTIONS))
    areas = nested_areas(reach, np.ones(500))
    assert (np.diff(areas, axis=1) <= 0).all() and areas[:, 3] == pytest.approx(areas[:, 0])
    flux = np.zeros((500, RINGS, 3))
    flux[:, 3] = generator.poisson(5.0, (500, 1))
    value, moment, blur, _ = nested_estimate(flux, flux * 10_000, np.full((500, 3), 1e4), flux, areas, 10_000)
    assert value == pytest.approx(flux[:, 3] / areas[:, :1])
    assert moment == pytest.approx((flux[:, 3] + 1.0) * 1e4 / areas[:, :1] ** 2) and (blur < 1e-9 * moment).all()
