"""Compiled bounces: the same particles on the same ways as NumPy's."""

from dataclasses import replace

import numpy as np
import pytest
from detp.core.lights.point import PointLight
from detp.core.lights.world import UniformWorld
from detp.core.photons import compiled_bounces
from detp.core.photons.specular import Specular
from detp.core.photons.tracing import PhotonTracer
from detp.core.rays import RayCaster
from detp.core.scene import Scene
from rooms import box_quads, scene_of

pytestmark = pytest.mark.usefixtures("kernels")


def lit_room(**lamp):
    """A coloured room without one wall, under a sky and a lamp."""
    quads = box_quads((3, 2, 1))[:5]
    albedo = np.random.default_rng(1).uniform(0.2, 0.9, (10, 3))[::2]
    lights = (PointLight((1, 1, 0.5), (1.0, 2.0, 3.0), **lamp), UniformWorld((0.1, 0.2, 0.3)))
    return scene_of(quads, albedo, lights=lights)


def room_of_all_kinds():
    """Coloured walls that also let light pass, as alpha does, around triangles of every kind anyhow."""
    generator = np.random.default_rng(5)
    scene = lit_room(radius=0.2, soft=True)
    corners = generator.uniform(0.0, 1.0, (40, 1, 3)) * (3, 2, 1) + generator.normal(size=(40, 3, 3)) * 0.3
    rows, kind = np.arange(10, 50), np.arange(40)[:, None] % 8
    colour = generator.uniform(0.3, 1.0, (5, 40, 3))
    clear = np.isin(kind, (1, 2, 3, 4))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, None]
    normals = normals / np.linalg.norm(normals, axis=2, keepdims=True) + 0.4 * generator.normal(size=(40, 3, 3))
    table = Specular(
        rows,
        normals,
        mirror=colour[0] * np.isin(kind, (0, 5, 7)),
        gloss=colour[1] * clear,
        clear=colour[2] * clear,
        ior=generator.uniform(0.7, 2.0, 40),
        roughness=np.where(np.isin(kind, (0, 1, 2))[:, 0], 0.0, generator.uniform(0.0, 1.0, 40)),
    )
    vertices = np.concatenate([scene.vertices, corners.reshape(-1, 3)])
    triangles = np.concatenate([scene.triangles, len(scene.vertices) + np.arange(120).reshape(-1, 3)])
    albedo = np.concatenate([scene.albedo, colour[4] * np.isin(kind, (3, 6, 7))])
    through = np.concatenate([scene.transmittance + 0.3, colour[3] * np.isin(kind, (6, 7))])
    return Scene(vertices, triangles, albedo, 0 * albedo, through, scene.lights, table)


@pytest.mark.parametrize("bounces", [0, 2, 8])
@pytest.mark.parametrize("direct", [True, False])
def test_every_kind_of_surface_does_the_same(monkeypatch, bounces, direct):
    compare(monkeypatch, room_of_all_kinds(), bounces, direct, 1e-9)


@pytest.mark.parametrize("direct", [True, False])
def test_panes_alone(monkeypatch, direct):
    scene = replace(room_of_all_kinds(), specular=None)
    compare(monkeypatch, scene, 64, direct, 1e-11)


@pytest.mark.parametrize("bounces", [0, 1, 2, 64])
@pytest.mark.parametrize("direct", [True, False])
@pytest.mark.parametrize("lamp", [{}, {"radius": 0.2, "soft": True}])
def test_compiled_bounces_are_numpys(monkeypatch, bounces, direct, lamp):
    compare(monkeypatch, lit_room(**lamp), bounces, direct, 1e-12)


def compare(monkeypatch, scene, bounces, direct, tolerance):
    tracer = PhotonTracer(scene, RayCaster(scene.corners), scene.bounds.expanded(0.1), bounces, direct)
    fast = tracer.trace(3000, np.random.default_rng(2), first=7)
    monkeypatch.setenv("DETP_COMPILED", "off")
    slow = tracer.trace(3000, np.random.default_rng(2), first=7)
    assert len(fast.segments) == len(slow.segments)
    for name in ("bounce", "particle"):
        assert np.array_equal(getattr(fast.segments, name), getattr(slow.segments, name))
    for name in ("origins", "ends", "flux"):
        assert getattr(fast.segments, name) == pytest.approx(getattr(slow.segments, name), rel=tolerance, abs=tolerance)
    assert fast.cut_flux == pytest.approx(slow.cut_flux, rel=tolerance)


def test_there_is_always_room(monkeypatch):
    monkeypatch.setattr(compiled_bounces, "ROOM", 1)
    compare(monkeypatch, lit_room(), 64, True, 1e-12)
