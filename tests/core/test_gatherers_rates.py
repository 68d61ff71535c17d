"""Cauchy-Crofton: how often uniform lines through a ball cross a disc's front, or meet an inner sphere."""

import numpy as np
import pytest
from detp.core.discs import TangentDiscs
from detp.core.gatherers.choose import make_gatherer
from detp.core.study.crofton import share_met
from detp.core.study.fields import uniform_lines, unit
from detp.core.study.theory import share_through
from scipy.stats import norm


def check_rates(hits, trials, probabilities):
    """z-tests at 1 % in all (Sidak's correction)."""
    z = (hits - trials * probabilities) / np.sqrt(trials * probabilities * (1 - probabilities))
    limit = norm.isf((1 - 0.99 ** (1 / len(z))) / 2)
    assert np.abs(z).max() < limit, z


@pytest.mark.parametrize("name, count", [("disc-index", 400_000), ("sphere-cache", 400_000), ("brute-force", 100_000)])
def test_a_disc_is_crossed_from_its_front_by_d2_over_4_r2_of_the_lines(name, count):
    generator = np.random.default_rng(11)
    radii = generator.uniform(0.01, 0.3, 40)
    centres = unit(generator.normal(size=(40, 3))) * ((1.0 - radii) * generator.random(40))[:, None]
    discs = TangentDiscs(centres, generator.normal(size=(40, 3)), radii)
    hits = np.zeros(40)
    for crossings in make_gatherer(name, discs)[0].crossings(uniform_lines(count, generator)):
        hits += np.bincount(crossings.disc, minlength=40)
    check_rates(hits, count, radii**2 / 4)


def test_an_inner_sphere_is_met_by_r2_over_r2_of_the_lines():
    generator = np.random.default_rng(12)
    lines = uniform_lines(300_000, generator)
    radii = generator.uniform(0.025, 0.5, 20)
    centres = unit(generator.normal(size=(20, 3))) * ((1.0 - radii) * generator.random(20))[:, None]
    met = [share_met(lines, centres[at : at + 1], radius)[0] for at, radius in enumerate(radii)]
    check_rates(np.array(met) * len(lines), len(lines), share_through(radii, 1.0))
