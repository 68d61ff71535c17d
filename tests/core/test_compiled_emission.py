"""Compiled emission: the same particles as NumPy's from every light, by the same uniform numbers."""

import numpy as np
import pytest
from detp.core import sampling
from detp.core.bounds import Bounds
from detp.core.lights.area import AreaLight
from detp.core.lights.emissive import EmissiveTriangles
from detp.core.lights.environment import EnvironmentWorld
from detp.core.lights.light import EMISSION_DIMENSIONS
from detp.core.lights.point import PointLight
from detp.core.lights.spot import SpotLight
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from detp.core.photons.emission_guide import EmissionGuide

pytestmark = pytest.mark.usefixtures("kernels")
POWER = (1.0, 2.0, 3.0)
BOUNDS = Bounds(np.array([-1.0, -2.0, -3.0]), np.array([4.0, 2.0, 1.0]))


def triangles(count):
    """Shining triangles, among them a dark one and one without area, at the end too."""
    generator = np.random.default_rng(3)
    corners, radiance = generator.normal(size=(count, 3, 3)), generator.normal(size=(count, 3))
    radiance[[0, count // 2, -1]], corners[1] = 0.0, corners[1, :1]
    return EmissiveTriangles(corners, radiance)


def sky():
    """A picture with black pixels, and black ones all along its top."""
    generator = np.random.default_rng(4)
    radiance = generator.uniform(0.0, 1.0, (9, 16, 3)) ** 4
    radiance[generator.random((9, 16)) < 0.3] = 0.0
    radiance[-1] = 0.0
    return EnvironmentWorld(radiance)


LIGHTS = {
    "point": PointLight((1, 2, 3), POWER),
    "ball": PointLight((1, 2, 3), POWER, radius=0.5),
    "soft": PointLight((1, 2, 3), POWER, radius=0.5, soft=True),
    "spot": SpotLight((1, 2, 3), (1, 1, -1), POWER, 1.0, 0.3, radius=0.2, soft=True),
    "area": AreaLight((0, 0, 0), (1, 0, 0), (0, 2, 1), POWER),
    "ellipse": AreaLight((0, 0, 0), (1, 0, 0), (0, 2, 1), POWER, "ellipse", spread=1.0),
    "sun": SunLight((1, 2, -3), POWER, 0.3),
    "world": UniformWorld(POWER),
    "sky": sky(),
    "triangles": triangles(1000),
    "one triangle": EmissiveTriangles(np.eye(3)[None], [POWER]),
}


@pytest.mark.parametrize("name", LIGHTS)
@pytest.mark.parametrize("ascending", [True, False])
def test_every_light_sends_the_same(monkeypatch, name, ascending):
    uniforms = np.random.default_rng(5).random((3000, EMISSION_DIMENSIONS))
    uniforms[0], uniforms[1] = 0.0, np.nextafter(1.0, 0.0)
    if ascending:
        uniforms[:, 0].sort()
    fast = LIGHTS[name].emit(uniforms, BOUNDS)
    monkeypatch.setenv("DETP_COMPILED", "off")
    slow = LIGHTS[name].emit(uniforms, BOUNDS)
    for field in ("origins", "directions", "flux"):
        assert getattr(fast, field) == pytest.approx(getattr(slow, field), rel=1e-12, abs=1e-12)
    assert (fast.start is None) == (slow.start is None)
    if fast.start is not None:
        # At the rim of the disc they shine from nowhere on.
        assert fast.start[2:] == pytest.approx(slow.start[2:], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("boxes", [1, 7, 5000])
def test_draws_are_the_same(monkeypatch, boxes):
    generator = np.random.default_rng(6)
    lower = generator.uniform(0.0, 0.5, (boxes, EMISSION_DIMENSIONS)) * (boxes > 1)
    upper = 1.0 - lower
    natural, chance = generator.dirichlet(np.ones(boxes), 2)
    guide = EmissionGuide(np.sort(generator.integers(0, 3, boxes)), lower, upper, natural, chance)
    fast = guide.draws(2000, np.random.default_rng(7))
    monkeypatch.setenv("DETP_COMPILED", "off")
    slow = guide.draws(2000, np.random.default_rng(7))
    assert np.array_equal(fast.light, slow.light)
    for field in ("uniforms", "weight", "density"):
        assert getattr(fast, field) == pytest.approx(getattr(slow, field), rel=1e-12, abs=1e-15)


def test_directions_keep_their_digits(monkeypatch):
    grid = np.linspace(0.0, np.nextafter(1.0, 0.0), 101)
    uniforms = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    axes = np.random.default_rng(8).normal(size=(len(uniforms), 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]

    def found():
        return (
            sampling.disc(uniforms),
            sampling.cosine_hemisphere(axes, uniforms),
            sampling.cosine_hemisphere(np.array([0.0, 0.0, -1.0]), uniforms),
            sampling.around(axes, 2.0 * uniforms[:, 0], uniforms[:, 1]),
            sampling.around(axes[0], 1e-12 * uniforms[:, 0], 1.0 - 2.0 * uniforms[:, 1]),
        )

    fast = found()
    monkeypatch.setenv("DETP_COMPILED", "off")
    for one, other in zip(fast, found(), strict=True):
        assert np.abs(one - other).max() < 1e-15
