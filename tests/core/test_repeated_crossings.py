"""Particles that cross a disc several times, against plain sums over particles."""

import numpy as np
import pytest
from detp.core.estimator import repeated_crossings
from detp.core.estimator.repeated_crossings import RepeatedCrossings
from detp.core.gatherers.gatherer import Crossings
from detp.core.segments import Segments

DISCS, PARTICLES = 5, 300


def crossings_of(seed, count=4000):
    """Random crossings, each pair once, by particles with several segments each, one of them of negative flux."""
    generator = np.random.default_rng(seed)
    segments = Segments(
        np.zeros((count, 3)),
        np.zeros((count, 3)),
        generator.exponential(size=(count, 3)) * np.where(np.arange(count) % 7 == 0, -1, 1)[:, None],
        np.zeros(count, np.uint16),
        generator.integers(0, PARTICLES, count).astype(np.uint32),
    )
    pairs = generator.permutation(count * DISCS)[: 2 * count]
    return segments, Crossings(pairs // DISCS, pairs % DISCS)


def plain(segments, crossings):
    sums, squares = np.zeros((DISCS, PARTICLES, 3)), np.zeros((DISCS, PARTICLES, 3))
    flux = segments.flux[crossings.segment]
    rows = crossings.disc, segments.particle[crossings.segment]
    np.add.at(sums, rows, flux)
    np.add.at(squares, rows, flux**2)
    return (sums**2 - squares).sum(axis=1)


def collected(segments, crossings, parts=3):
    repeated = RepeatedCrossings(DISCS, segments)
    for rows in np.array_split(np.arange(len(crossings)), parts):
        repeated.add(crossings.taken(rows))
    return repeated.products()


def test_the_products_of_a_particles_crossings_are_exact_whatever_the_portions():
    segments, crossings = crossings_of(1)
    assert collected(segments, crossings) == pytest.approx(plain(segments, crossings))
    assert collected(segments, crossings, 40) == pytest.approx(plain(segments, crossings))


def test_with_too_many_crossings_some_particles_stand_for_all_on_average(monkeypatch):
    monkeypatch.setattr(repeated_crossings, "LEAST_PAIRS", 1000)
    found, expected = [], []
    for seed in range(60):
        segments, crossings = crossings_of(seed)
        found.append(collected(segments, crossings).sum())
        expected.append(plain(segments, crossings).sum())
        shuffled = np.random.default_rng(seed).permutation(len(crossings))
        again = Crossings(crossings.segment[shuffled], crossings.disc[shuffled])
        assert collected(segments, again, 9).sum() == pytest.approx(found[-1])
    differences = np.subtract(found, expected)
    assert np.abs(differences).min() > 0
    assert abs(differences.mean()) < 4 * differences.std(ddof=1) / np.sqrt(60)


def test_without_crossings_nothing_repeats():
    segments, _ = crossings_of(2)
    assert not RepeatedCrossings(DISCS, segments).products().any()
