"""Compiled bounces: the same particles on the same ways as NumPy's."""

import numpy as np
import pytest
from detp.core import compiled
from detp.core.lights.point import PointLight
from detp.core.lights.world import UniformWorld
from detp.core.photons import tracing
from detp.core.photons.tracing import PhotonTracer
from detp.core.rays import RayCaster
from rooms import box_quads, scene_of

pytest.importorskip("numba")


@pytest.fixture(scope="module", autouse=True)
def kernels():
    compiled.compile_now()
    assert compiled.kernels() is not None


def lit_room(**lamp):
    """A coloured room without one wall, under a sky and a lamp."""
    quads = box_quads((3, 2, 1))[:5]
    albedo = np.random.default_rng(1).uniform(0.2, 0.9, (10, 3))[::2]
    lights = (PointLight((1, 1, 0.5), (1.0, 2.0, 3.0), **lamp), UniformWorld((0.1, 0.2, 0.3)))
    return scene_of(quads, albedo, lights=lights)


@pytest.mark.parametrize("bounces", [0, 1, 2, 64])
@pytest.mark.parametrize("direct", [True, False])
@pytest.mark.parametrize("lamp", [{}, {"radius": 0.2, "soft": True}])
def test_compiled_bounces_are_numpys(monkeypatch, bounces, direct, lamp):
    scene = lit_room(**lamp)
    tracer = PhotonTracer(scene, RayCaster(scene.corners), scene.bounds.expanded(0.1), bounces, direct)
    fast = tracer.trace(3000, np.random.default_rng(2), first=7)
    monkeypatch.setattr(tracing, "kernels", lambda saving: None)
    slow = tracer.trace(3000, np.random.default_rng(2), first=7)
    assert len(fast.segments) == len(slow.segments)
    for name in ("bounce", "particle"):
        assert np.array_equal(getattr(fast.segments, name), getattr(slow.segments, name))
    for name in ("origins", "ends", "flux"):
        assert getattr(fast.segments, name) == pytest.approx(getattr(slow.segments, name), rel=1e-12, abs=1e-12)
    assert fast.cut_flux == pytest.approx(slow.cut_flux, rel=1e-12)


def test_a_direction_along_a_surface_and_a_black_particle_do_no_harm():
    functions = compiled.kernels()
    triangle, zeros = np.zeros(2, np.int32), np.zeros(2, np.float32)
    edged, normals, albedo = np.arange(9.0)[None], np.array([[0.0, 0, 1]]), np.full((1, 3), 0.5)
    directions, flux = np.array([[1.0, 0, 0], [0, 0, -1]]), np.array([[0.0, 0, 0], [1, 1, 1]])
    ends, rows, kept, points = np.empty((2, 3)), np.empty(2, np.int64), np.empty((3, 3)), np.empty((3, 3))
    alive = functions.meet(
        triangle, zeros, zeros, edged, normals, albedo, np.zeros((2, 3)), directions, flux, np.array([0.0, 0.4]),
        1e-3, 0.01, np.zeros(3), 1.0, ends, rows, kept, points,
    )  # fmt: skip
    assert alive == 1
    assert rows[0] == 1
    assert kept[0] == pytest.approx(1.0)
    assert np.isfinite(ends).all()
