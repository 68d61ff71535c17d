"""Distant lights in parts send together what they send as a whole, the inner ones where it is wanted."""

import numpy as np
import pytest
from detp.core.bounds import Bounds
from detp.core.lights.light import EMISSION_DIMENSIONS
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from detp.core.photons.distant_light import Between, shells_of, wanted_box

WHOLE = Bounds(np.array((-10.0, -10, -1)), np.array((10.0, 10, 3)))
SMALL = Bounds(np.array((4.0, 3, -1)), np.array((6.0, 6, 1)))
COUNT = 200_000


@pytest.mark.parametrize("light", [SunLight((0.5, 0.2, -1), (2.0, 1.0, 3.0), 0.1), UniformWorld((1.0, 0.5, 0.2))])
def test_the_parts_bring_as_much_through_any_place_as_the_light_itself(light):
    uniforms = np.random.default_rng(1).random((COUNT, EMISSION_DIMENSIONS))
    parts = [Between(light, *shell) for shell in shells_of(SMALL, WHOLE)]
    assert len(parts) == 4
    whole, *through = (_through_cells(part.emit(uniforms, WHOLE)) for part in [light, *parts])
    assert all(part.sum() > 0 for part in through) and through[-1].sum() > through[0].sum()
    allowed = 5 * np.sqrt(whole.max() * whole.sum() / COUNT * 4) + 1e-9
    assert np.abs(sum(through) - whole).max() < allowed
    assert np.allclose(sum(part.flux(WHOLE) for part in parts), light.flux(WHOLE))


def test_shells_grow_by_twice_their_width():
    far = Bounds(np.full(3, -1000.0), np.full(3, 1000.0))
    shells = shells_of(SMALL, far)
    outer = [shell[1].size.max() for shell in shells[:-1]]
    assert shells[0][0] is None and shells[-1][1] is None
    assert np.allclose(np.divide(outer[1:], outer[:-1]), 2.0)
    assert len(shells) < 12


def _through_cells(sent) -> np.ndarray:
    """Flux of the particles through the squares of the plane z = 0 in the box, from above."""
    falling = sent.directions[:, 2] < -1e-6
    share = sent.origins[falling, 2] / -sent.directions[falling, 2]
    at = sent.origins[falling] + share[:, None] * sent.directions[falling]
    ahead = share > 0
    edges = np.linspace(-10, 10, 9)
    return np.histogram2d(at[ahead, 0], at[ahead, 1], (edges, edges), weights=sent.flux[falling, 0][ahead])[0]


def test_a_box_is_made_apart_only_where_it_is_much_smaller():
    places = np.random.default_rng(2).uniform(-1, 1, (1000, 3))
    assert wanted_box(places, Bounds.of(1.2 * places)) is None
    box = wanted_box(places, Bounds.of(100 * places))
    assert (box.lower < -0.9).all() and (box.upper < 1.3).all()
    assert wanted_box(np.zeros((5, 3)), Bounds.of(places)) is None
