"""The study's formulas against counted searches."""

import numpy as np
import pytest
from detp.core.gatherers.brute_force import BruteForce
from detp.core.gatherers.disc_index import DiscIndex
from detp.core.gatherers.gatherer import KINDS, Counts
from detp.core.gatherers.sphere_cache import SphereCache
from detp.core.machine import this_machine
from detp.core.parallel import worker_count
from detp.core.study.fields import spacing, uniform_discs, uniform_lines
from detp.core.study.measure import counted
from detp.core.study.theory import (
    SearchProblem,
    best_q,
    disc_index_tests,
    rebuild_cost,
    sphere_cache_tests,
    spheres_made,
)


def pairs_of(gatherer, segments, counts=None):
    found = [np.stack([c.segment, c.disc], 1) for c in gatherer.crossings(segments, counts)]
    return np.unique(np.concatenate(found), axis=0)


def field(kind, points, ratio, lines, seed=1):
    generator = np.random.default_rng(seed)
    return uniform_discs(kind, points, ratio * spacing(kind, points), generator), uniform_lines(lines, generator)


@pytest.mark.parametrize("dimension, best", [(2.0, np.exp(-0.5)), (2.5, None), (3.0, 2 / 3)])
def test_the_best_q_is_the_least_rebuild_cost(dimension, best):
    q = np.linspace(0.3, 0.95, 6501)
    least = q[rebuild_cost(q, dimension).argmin()]
    assert best_q(dimension) == pytest.approx(least, abs=2e-4)
    assert best is None or best_q(dimension) == pytest.approx(best)


def test_rebuild_cost_is_the_sum_over_the_spheres():
    for dimension in (2.0, 2.4, 3.0):
        sums = []
        for steps in (12, 16, 24):
            q = 1e-3 ** (1 / steps)
            radii = q ** np.arange(1, steps + 1)
            sums.append((radii / q) ** 2 @ radii**-dimension / rebuild_cost(q, dimension))
        # Up to the ends of the sum, the same factor for every Q.
        assert np.ptp(sums) < 0.02 * np.mean(sums)


@pytest.mark.parametrize("kind, dimension", [("volume", 3.0), ("surface", 2.0)])
def test_the_formulas_count_what_the_searches_do_to_a_factor_of_two(kind, dimension):
    for points, ratio in ((3000, 0.5), (3000, 3.0)):
        discs, lines = field(kind, points, ratio, 600)
        problem = SearchProblem.of(discs, len(lines), dimension)
        last = 1.5 * problem.radius
        for q in (0.5, 0.8):
            counts = counted(SphereCache(discs, q, last, short=0), lines)
            assert 0.5 < sum(sphere_cache_tests(problem, q, last)) / counts["work"] < 2.5
        counts = counted(DiscIndex(discs), lines)
        assert 0.4 < sum(disc_index_tests(problem, 8, roots=6 if kind == "volume" else 1)) / counts["work"] < 2.5


def test_spheres_are_made_at_least_once_and_hardly_more_than_once_a_point():
    problem = SearchProblem(1.0, 500, 0.01, 1.0, 2.0)
    made_ = spheres_made(problem, np.array([1.0, 0.5, 0.1, 0.0101, 0.01, 0.005]))
    assert (np.diff(made_) >= 0).all() and made_[0] >= 1.0 and made_[-1] == pytest.approx(500, rel=1e-3)


def test_counting_changes_nothing_and_counts_all():
    discs, lines = field("surface", 500, 1.0, 700)
    for gatherer in (DiscIndex(discs), SphereCache(discs), BruteForce(discs)):
        counts = Counts()
        found = pairs_of(gatherer, lines, counts)
        assert np.array_equal(found, pairs_of(gatherer, lines))
        totals = counts.totals()
        assert tuple(totals) == KINDS and totals["segments"] == 700
        if gatherer.name == "brute-force":
            assert totals["tests"] == 700 * 500
        else:
            assert totals["crossings"] == len(found) <= totals["tests"] <= totals["discs"] <= totals["listed"]
            assert totals["patches"] > 0 and totals["nodes"] > 0
            assert (totals["lists"] > 0) == (gatherer.name == "sphere-cache")


def test_this_machine_is_measured_once():
    machine = this_machine()
    assert machine is this_machine()
    assert machine.slowness > 0 and 1.0 <= machine.parallel <= worker_count()
    assert machine.wall_seconds(2.0) == pytest.approx(2.0 * machine.slowness / machine.parallel)
