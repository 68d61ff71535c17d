"""Cauchy-Crofton: how often uniform lines through a ball cross a disc's front, or meet an inner sphere."""

import numpy as np
import pytest
from detp.core.discs import TangentDiscs
from detp.core.gatherers.choose import make_gatherer
from detp.core.gatherers.sphere_cache import meets
from detp.core.segments import Segments
from scipy.stats import norm

BALL = 2.0


def unit(rows):
    return rows / np.linalg.norm(rows, axis=1)[:, None]


def uniform_lines(count, generator):
    """Chords of the ball: uniform directions, uniform over the disc that the ball shows each of them."""
    direction = unit(generator.normal(size=(count, 3)))
    side = unit(np.cross(direction, generator.normal(size=(count, 3))))
    away = BALL * np.sqrt(generator.random(count))
    half = np.sqrt(np.maximum(BALL**2 - away**2, 0.0))[:, None] * direction
    middle = away[:, None] * side
    return middle - half, middle + half


def check_rates(hits, trials, probabilities):
    """z-tests at 1 % in all (Sidak's correction)."""
    z = (hits - trials * probabilities) / np.sqrt(trials * probabilities * (1 - probabilities))
    limit = norm.isf((1 - 0.99 ** (1 / len(z))) / 2)
    assert np.abs(z).max() < limit, z


@pytest.mark.parametrize("name, count", [("disc-index", 400_000), ("sphere-cache", 400_000), ("brute-force", 100_000)])
def test_a_disc_is_crossed_from_its_front_by_d2_over_4_r2_of_the_lines(name, count):
    generator = np.random.default_rng(11)
    radii = generator.uniform(0.02, 0.6, 40)
    centres = unit(generator.normal(size=(40, 3))) * ((BALL - radii) * generator.random(40))[:, None]
    discs = TangentDiscs(centres, generator.normal(size=(40, 3)), radii)
    segments = Segments(*uniform_lines(count, generator), np.ones((count, 3)), np.zeros(count, np.uint16))
    hits = np.zeros(40)
    for crossings in make_gatherer(name, discs)[0].crossings(segments):
        hits += np.bincount(crossings.disc, minlength=40)
    check_rates(hits, count, radii**2 / (4 * BALL**2))


def test_an_inner_sphere_is_met_by_r2_over_r2_of_the_lines():
    generator = np.random.default_rng(12)
    origins, ends = uniform_lines(300_000, generator)
    radii = generator.uniform(0.05, 1.0, 20)
    centres = unit(generator.normal(size=(20, 3))) * ((BALL - radii) * generator.random(20))[:, None]
    step = ends - origins
    rays = np.concatenate([origins.T, step.T, 1 / (step**2).sum(axis=1)[None]]).astype(np.float32)
    met = meets(rays, centres.T[:, :, None].astype(np.float32), (radii[:, None] ** 2).astype(np.float32))
    check_rates(met.sum(axis=1), len(origins), (radii / BALL) ** 2)
