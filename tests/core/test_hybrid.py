"""The hybrid over frames: what it keeps, that nothing is lost by that, and when it is chosen."""

from dataclasses import replace

import numpy as np
import pytest
from detp.core.discs import TangentDiscs
from detp.core.errors import InvalidArrayError
from detp.core.gatherers.brute_force import BruteForce
from detp.core.gatherers.choose import make_gatherer
from detp.core.gatherers.disc_index import DiscIndex
from detp.core.gatherers.gatherer import Counts
from detp.core.gatherers.hybrid import Hybrid
from detp.core.gatherers.outer_spheres import Sphere, SphereLists, sphere_around, walked_on
from detp.core.settings import BakeSettings
from detp.core.study.fields import uniform_discs, uniform_lines, uniform_points
from detp.core.study.theory import SearchProblem, outer_sphere_tests

STILL, MOVING = 600, 60
MOVES = np.arange(STILL + MOVING) >= STILL


def scene(at, radius=0.1):
    """Discs on the unit ball's surface, and on a small ball ``at`` a place."""
    generator = np.random.default_rng(1)
    still, outward = uniform_discs("surface", STILL, 0.1, generator), uniform_points("surface", MOVING, generator)
    parts = (still.centres, radius * outward + at), (still.normals, outward), (still.radii, np.full(MOVING, 0.05))
    return TangentDiscs(*(np.concatenate(part) for part in parts))


def lines(count=1500, seed=2):
    return uniform_lines(count, np.random.default_rng(seed))


def pairs(gatherer, segments, counts=None):
    found = [np.stack([c.segment, c.disc], 1) for c in gatherer.crossings(segments, counts)]
    return np.unique(np.concatenate(found), axis=0)


def way(steps, step=0.02):
    return np.column_stack([step * np.arange(steps) - 0.5, np.zeros(steps), np.full(steps, 0.1)])


def test_frames_find_what_brute_force_finds_and_keep_the_index():
    segments, hybrid = lines(), Hybrid(scene(way(1)[0]), MOVES)
    index, kept = hybrid.still, 0
    for at in way(7, 0.1):
        before, hybrid = hybrid, hybrid.moved(scene(at))
        assert np.array_equal(pairs(hybrid, segments), pairs(BruteForce(scene(at)), segments))
        assert hybrid.still is index
        kept += sum(one is other for one, other in zip(before.mobile._spheres, hybrid.mobile._spheres, strict=False))
    assert kept > 4


def test_a_search_of_an_earlier_frame_still_finds_that_frames_crossings():
    segments, first = lines(), Hybrid(scene(way(1)[0]), MOVES)
    expected = pairs(first, segments)
    second = first.moved(scene(np.array([0.5, 0.2, 0.0])))
    pairs(second, segments)
    assert np.array_equal(pairs(first, segments), expected)
    assert np.array_equal(pairs(second, segments), pairs(BruteForce(second._discs), segments))


def test_lists_are_kept_for_the_same_segments_alone():
    lists, segments = SphereLists(), lines()
    outer, inner = Sphere(np.zeros(3), 0.5), Sphere(np.array([0.1, 0.0, 0.0]), 0.2)

    def made(segments, *spheres):
        counts = Counts()
        return lists.near(segments, spheres, counts), counts.totals()["lists"]

    near, count = made(segments, outer, inner)
    assert count == 2
    # Of another flux, as when some count no more.
    again, count = made(replace(segments, flux=0.0 * segments.flux), outer, inner)
    assert count == 0 and np.array_equal(near, again)
    assert made(segments, outer, Sphere(inner.centre, 0.1))[1] == 1
    assert made(segments, outer, inner)[1] == 1
    other = lines(seed=3)
    assert made(other, outer, inner)[1] == 2
    assert len(lists._held) == 2
    del other
    assert len(lists._held) == 1


def test_spheres_are_those_of_the_studys_walk():
    generator, current, q = np.random.default_rng(4), {}, 0.7
    radii = 2.0 * q ** np.arange(1, 9)
    spheres, centre = (), np.zeros(3)
    for _ in range(200):
        centre = centre + 0.03 * generator.normal(size=3)
        moving = Sphere(centre, 0.12)
        spheres = walked_on(spheres, moving, 2.0, q)
        for level, radius in enumerate(radii):
            if radius < moving.radius:
                break
            held = level in current and np.linalg.norm(centre - current[level]) + moving.radius <= radius
            if not held:
                current = {number: value for number, value in current.items() if number < level}
                current[level] = centre
        assert [tuple(s.centre) for s in spheres] == [tuple(current[level]) for level in range(len(spheres))]
        assert np.allclose([s.radius for s in spheres], radii[: len(spheres)]) and all(s.holds(moving) for s in spheres)
        assert len(spheres) == np.count_nonzero(radii >= moving.radius)


def test_the_formula_counts_the_comparisons_with_outer_spheres():
    segments = lines(4000)
    problem = SearchProblem(len(segments), MOVING, 0.05, 1.0, 2.0)
    for step, steps in ((0.005, 60), (0.05, 16)):
        lists, spheres, counts = SphereLists(), (), Counts()
        first = sphere_around(scene(way(1)[0])).radius
        for number, at in enumerate(way(steps, step)):
            spheres = walked_on(spheres, sphere_around(scene(at).taken(MOVES)), first, 0.6)
            lists.near(segments, spheres, counts if number else None)
        counted = counts.totals()["nodes"] / (steps - 1)
        assert 0.4 < outer_sphere_tests(problem, 0.15, step, 0.6) / counted < 2.5


def test_discs_that_were_to_stay_and_move_all_the_same_are_found():
    segments, at = lines(), way(1)[0]
    unaware = Hybrid(scene(at))
    assert not unaware.moving.any()
    moved = scene(at + 0.3)
    hybrid = unaware.moved(moved)
    assert np.array_equal(hybrid.moving, MOVES)
    assert np.array_equal(pairs(hybrid, segments), pairs(BruteForce(moved), segments))
    assert hybrid.moved(scene(at)).still is hybrid.still


def test_what_cannot_be_is_said():
    discs = scene(way(1)[0])
    for wrong in (MOVES[1:], MOVES.astype(int)):
        with pytest.raises(InvalidArrayError, match="one for each disc"):
            Hybrid(discs, wrong)
        with pytest.raises(InvalidArrayError, match="one for each disc"):
            make_gatherer("hybrid", discs, moving=wrong)
    with pytest.raises(InvalidArrayError, match="as many as before"):
        Hybrid(discs, MOVES).moved(discs.taken(slice(5)))


def test_in_a_bake_of_one_frame_it_is_disc_indexing_and_says_so():
    discs = scene(way(1)[0])
    hybrid, why = make_gatherer("hybrid", discs)
    assert isinstance(hybrid.still.search, DiscIndex) and not hybrid.moving.any()
    assert "nothing moves, so that it is Disc Indexing." in why
    hybrid, why = make_gatherer("hybrid", discs, moving=MOVES)
    assert "Disc Indexing for 600 discs that stay, Sphere Cache for 60 that move." in why
    everything, _ = make_gatherer("hybrid", discs, moving=np.ones(len(discs), bool))
    assert np.array_equal(pairs(everything, lines()), pairs(hybrid, lines()))
    assert BakeSettings(gatherer="hybrid").gatherer == "hybrid"


def test_auto_takes_it_where_some_discs_move_and_others_stay():
    discs, some = scene(way(1)[0]), np.arange(STILL + MOVING)
    for moving, expected in ((None, False), (MOVES, True), (some >= 0, False), (some < 0, False)):
        gatherer, why = make_gatherer("auto", discs, moving)
        assert (gatherer.name == "hybrid") == expected, why
        assert np.array_equal(pairs(gatherer, lines()), pairs(BruteForce(discs), lines()))
    gatherer, why = make_gatherer("auto", discs, MOVES)
    assert why == "Hybrid: Disc Indexing for 600 discs that stay, Disc Indexing for 60 that move."
