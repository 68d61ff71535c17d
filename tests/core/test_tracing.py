"""Photon tracing: what is kept of the particles' paths."""

from dataclasses import replace

import numpy as np
import pytest
from detp.core.bounds import Bounds
from detp.core.lights.point import PointLight
from detp.core.photons.emission import Emission
from detp.core.photons.tracing import PhotonTracer
from detp.core.rays import RayCaster
from detp.core.scene import Scene


def clear_cell():
    """A tetrahedron that reflects, with a clear pane in it and a lamp behind the pane."""
    tetrahedron = np.array([(0, 0, 0), (3, 0, 0), (0, 3, 0), (0, 0, 3)], float)
    pane = np.array([(0.1, 0.1, 0.5), (1, 0.1, 0.5), (0.1, 1, 0.5)])
    triangles = [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3), (4, 5, 6)]
    grey, clear = np.repeat([0.5, 0.0], (4, 1)), np.repeat([0.0, 1.0], (4, 1))
    lamp = PointLight((0.3, 0.3, 0.2), (1.0, 2.0, 3.0))
    by_channel = (np.tile(values[:, None], 3) for values in (grey, 0 * grey, clear))
    return Scene(np.concatenate([tetrahedron, pane]), triangles, *by_channel, (lamp,))


def test_without_direct_light_the_same_paths_are_followed_and_their_first_pieces_left_out():
    scene = clear_cell()
    caster = RayCaster(scene.corners)
    whole, indirect = (
        PhotonTracer(scene, caster, scene.bounds, 64, direct=direct).trace(2000, np.random.default_rng(4))
        for direct in (True, False)
    )
    rows = whole.segments.bounce > 0
    # Behind the pane the light is still direct.
    assert 2000 < (~rows).sum() < 4000
    for name in ("origins", "ends", "flux", "bounce"):
        assert np.array_equal(getattr(whole.segments, name)[rows], getattr(indirect.segments, name))
    assert np.array_equal(whole.cut_flux, indirect.cut_flux)


def test_lights_get_their_share_of_the_particles_exact_to_one_and_stratified():
    lamps = tuple(PointLight((0.3, 0.3, 0.2), (power, 0.0, 0.0)) for power in (1.0, 7.0, 0.0, 2.0))
    emission = Emission(replace(clear_cell(), lights=lamps), Bounds((0, 0, 0), (3, 3, 3)), seen=np.array([1, 0, 0, 0]))
    assert emission.shares == pytest.approx([0.55, 0.35, 0.1])
    sent, lights = emission.emit(1001, np.random.default_rng(4))
    count = np.bincount(lights)
    assert (np.diff(lights) >= 0).all() and np.abs(count - 1001 * emission.shares).max() <= 1
    assert sent.flux[:, 0] == pytest.approx(np.array([1.0, 7.0, 2.0])[lights] / (1001 * emission.shares[lights]))
    # Of a point light the first number is how far a particle's way falls from straight up.
    for light, first in enumerate(np.split(0.5 * (1.0 - sent.directions[:, 2]), np.cumsum(count)[:-1])):
        assert np.array_equal(np.floor(first * count[light]), np.arange(count[light]))
