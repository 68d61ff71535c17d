"""The running estimate: mean, standard error and merging, against plain sums over simulated particles."""

import numpy as np
import pytest
from detp.core.discs import TangentDiscs
from detp.core.errors import InvalidArrayError
from detp.core.estimator import crossing_sums
from detp.core.estimator.crossing_sums import Accumulator
from detp.core.estimator.estimate import IrradianceEstimate
from detp.core.estimator.rings import nested_areas
from detp.core.estimator.visible_area import DIRECTIONS, VisibleArea, whole_discs
from detp.core.gatherers.disc_index import DiscIndex
from detp.core.gatherers.gatherer import Crossings
from detp.core.irradiance import Irradiance
from detp.core.segments import Segments


def simulated(particles, seed, share=0.05):
    """One disc of area 2, crossed by a share of the particles with a random flux; the estimate and each X."""
    generator = np.random.default_rng(seed)
    discs = TangentDiscs.of_radius(np.zeros((1, 3)), [(0, 0, 1)], np.sqrt(2 / np.pi))
    flux = generator.exponential(size=(particles, 3)) / particles
    crossing = np.flatnonzero(generator.random(particles) < share)
    segments = Segments(np.zeros((particles, 3)), np.zeros((particles, 3)), flux, np.zeros(particles, np.uint16))
    (placed,) = whole_discs(discs)
    accumulator = Accumulator(discs, segments, placed.area)
    for part in np.array_split(crossing, 3):
        accumulator.add(Crossings(part, np.zeros(len(part), np.int64)))
    each = np.zeros((particles, 3))
    each[crossing] = flux[crossing] * particles / 2
    return accumulator.estimate(particles), each


def with_one_more(each):
    """The standard error (3,) of the mean of ``each`` (n, 3), counting one crossing more, of sum X^2 / sum X."""
    count = len(each)
    more = ((each**2).sum(axis=0) / each.sum(axis=0)) ** 2
    return np.sqrt((each.var(axis=0) + more / count) / (count - 1))


def test_mean_and_standard_error_are_those_of_the_particles():
    estimate, each = simulated(10_000, 1)
    assert estimate.irradiance.value[0] == pytest.approx(each.mean(axis=0))
    assert estimate.irradiance.standard_error[0] == pytest.approx(with_one_more(each), rel=2e-4)
    # Each segment is a particle of its own, and none comes again.
    assert not estimate.repeated.any()


def test_halves_of_the_particles_differ_by_as_much_as_the_estimate_is_off():
    found = np.array([simulated(2000, seed)[0].with_contrasts[0] for seed in range(400)])
    off = np.column_stack([found[:, :3].sum(axis=1), found[:, 3:]])
    off[:, 0] -= off[:, 0].mean()
    # Variances of 400 normal deviations are off by 7 %; none tells of another.
    assert (off[:, 1:] ** 2).mean(axis=0) == pytest.approx(np.full(3, off[:, 0].var()), rel=0.25)
    assert np.abs(np.corrcoef(off.T) - np.eye(4)).max() < 0.2


def test_merged_estimates_are_the_estimate_of_all_particles():
    (first, each_first), (second, each_second) = simulated(3000, 2), simulated(7000, 3)
    merged = first.merged(second)
    each = np.concatenate([each_first, each_second])
    assert merged.samples == 10_000
    assert merged.irradiance.value[0] == pytest.approx(each.mean(axis=0))
    assert merged.irradiance.standard_error[0] == pytest.approx(with_one_more(each), rel=1e-3)
    assert np.array_equal(IrradianceEstimate.empty(np.full((1, 1), 2.0)).merged(first).total, first.total)


def test_bright_light_elsewhere_does_not_make_a_dim_disc_uncertain():
    particles, flux = 10_000, np.repeat([[1.0], [100.0]], 5_000, axis=0) * np.ones(3)
    discs = TangentDiscs.of_radius(np.zeros((2, 3)), [(0, 0, 1)] * 2, np.sqrt(1 / np.pi))
    segments = Segments(np.zeros((particles, 3)), np.zeros((particles, 3)), flux, np.zeros(particles, np.uint16))
    (placed,) = whole_discs(discs)
    accumulator = Accumulator(discs, segments, placed.area)
    dim, bright = np.arange(0, 100), np.arange(5_000, 5_100)
    accumulator.add(Crossings(np.concatenate([dim, bright]), np.repeat([0, 1], 100)))
    found = accumulator.estimate(particles).irradiance
    # 100 and one crossing more; the one is partly like those of the other disc.
    assert found.standard_error[0] / found.value[0] == pytest.approx(np.full(3, np.sqrt(1.5) / 10), rel=0.01)
    assert found.standard_error[1] / found.value[1] == pytest.approx(np.full(3, np.sqrt(1.01) / 10), rel=0.01)


def test_the_standard_error_covers_the_truth_as_often_as_it_says():
    inside = 0
    for seed in range(400):
        estimate, _ = simulated(20_000, 100 + seed)
        inside += abs(estimate.irradiance.value[0, 0] - 0.05 / 2) < 1.96 * estimate.irradiance.standard_error[0, 0]
    assert 0.92 < inside / 400 < 0.98


def test_where_nothing_crossed_the_error_is_that_of_one_crossing():
    estimate, _ = simulated(1000, 4, share=0.0)
    assert (estimate.irradiance.value == 0).all()
    assert estimate.irradiance.standard_error[0] == pytest.approx(np.sqrt(0.5) / 1000, rel=0.1)


def test_no_crossings_add_nothing():
    segments = Segments(np.zeros((1, 3)), np.ones((1, 3)), np.ones((1, 3)), np.zeros(1, np.uint16))
    discs = TangentDiscs.of_radius(np.zeros((1, 3)), [(0, 0, 1)], 1.0)
    (placed,) = whole_discs(discs)
    sums = Accumulator(discs, segments, placed.area)
    assert len(sums.add(Crossings(np.empty(0, np.int64), np.empty(0, np.int64)))) == 0
    assert not sums.total.any() and not sums.squares.any()


@pytest.mark.parametrize("size", [1, 500])
def test_sums_do_not_depend_on_slices(monkeypatch, size):
    generator = np.random.default_rng(3)
    discs = TangentDiscs.of_radius(generator.uniform(-1, 1, (300, 3)), generator.normal(size=(300, 3)), 0.4)
    reach = 0.4 * np.minimum(1.0, generator.uniform(0.0, 1.5, (300, DIRECTIONS)))
    reach[::3] = 0.4
    visible = VisibleArea(reach, nested_areas(reach, discs.radii), (reach < 0.4).any(axis=1), np.zeros(300, bool))
    flux = generator.exponential(size=(1000, 3)) * np.where(np.arange(1000) % 7 == 0, -1, 1)[:, None]
    segments = Segments(*generator.uniform(-1.5, 1.5, (2, 1000, 3)), flux, np.ones(1000, np.uint16))
    found = list(DiscIndex(discs).crossings(segments))
    whole, cut = (Accumulator(discs, segments, visible) for _ in range(2))
    kept = [whole.add(crossings) for crossings in found]
    monkeypatch.setattr(crossing_sums, "CROSSINGS_PER_CHUNK", size)
    assert all(np.array_equal(cut.add(crossings), inside) for crossings, inside in zip(found, kept, strict=True))
    assert np.array_equal(cut.total, whole.total) and np.array_equal(cut.squares, whole.squares)
    expected = np.zeros((300, 3))
    for crossings, inside in zip(found, kept, strict=True):
        np.add.at(expected, crossings.disc[inside], flux[crossings.segment[inside]])
    assert 0.3 < np.concatenate(kept).mean() < 0.9
    assert whole.total.sum(axis=1) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_dark_points_and_single_particles():
    empty = IrradianceEstimate.empty(np.ones((2, 1))).irradiance
    assert np.isnan(empty.relative_error)
    assert (empty.value == 0).all() and np.isinf(empty.standard_error).all()


def test_only_estimates_of_the_same_points_merge():
    with pytest.raises(InvalidArrayError):
        IrradianceEstimate.empty(np.ones((2, 1))).merged(IrradianceEstimate.empty(np.ones((3, 1))))


def test_light_of_two_kinds_adds_up_and_so_do_the_variances():
    first = Irradiance(np.full((1, 3), 2.0), np.full((1, 3), 0.3))
    both = first + Irradiance(np.full((1, 3), 1.0), np.full((1, 3), 0.4))
    assert both.value[0] == pytest.approx(3.0)
    assert both.standard_error[0] == pytest.approx(0.5)
    assert both.relative_errors == pytest.approx(1 / 6)
    assert both.relative_error == pytest.approx(0.6745 / 6, rel=2e-3)
    assert (first + Irradiance.dark(1)).standard_error[0] == pytest.approx(0.3)
