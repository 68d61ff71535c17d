"""Shadow rays by compiled kernels find what NumPy finds, from every kind of light and through clear surfaces."""

import numpy as np
import pytest
from detp.core.direct.direct_light import DirectLight
from detp.core.direct.lamp_table import lamp_table
from detp.core.lights.area import AreaLight
from detp.core.lights.environment import EnvironmentWorld
from detp.core.lights.point import PointLight
from detp.core.lights.spot import SpotLight
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from detp.core.rays import RayCaster
from detp.core.scene import Scene
from detp.core.settings import BakeSettings

POWER = np.array((3.0, 2.0, 1.0))
ABOVE = np.array((0.3, -0.2, 1.4))
STRETCHED = np.array([(0.5, 0.1, 0.0), (0.0, 1.2, 0.2), (0.1, 0.0, 0.8)])

LAMPS = {
    "point": PointLight(ABOVE, POWER),
    "ball": PointLight(ABOVE, POWER, 0.2),
    "ball around points": PointLight((0.0, 0.0, 0.2), POWER, 0.5),
    "soft": PointLight(ABOVE, POWER, 0.3, soft=True),
    "spot": SpotLight(ABOVE, (-0.2, 0.1, -1.0), POWER, 1.5, 0.4),
    "hard spot": SpotLight(ABOVE, (-0.2, 0.1, -1.0), POWER, 1.0, 0.0, 0.1),
    "stretched spot": SpotLight(ABOVE, STRETCHED, POWER, 1.5, 0.4, 0.1),
    "soft spot": SpotLight(ABOVE, (-0.2, 0.1, -1.0), POWER, 1.5, 0.4, 0.1, soft=True),
    "sharp sun": SunLight((0.1, 0.2, -1.0), POWER),
    "sun": SunLight((0.1, 0.2, -1.0), POWER, 0.3),
    "rectangle": AreaLight(ABOVE, (1.0, 0, 0), (0, 0.6, 0.1), POWER),
    "far rectangle": AreaLight((20.0, 3.0, 40.0), (0.1, 0, 0), (0, 0.2, 0), POWER),
    "parallelogram": AreaLight(ABOVE, (1.0, 0, 0), (0.3, 0.6, 0), POWER),
    "ellipse": AreaLight(ABOVE, (1.0, 0, 0), (0, 0.6, 0), POWER, "ellipse"),
    "near ellipse": AreaLight((0, 0, 0.3), (3.0, 0, 0), (0, 2.5, 0), POWER, "ellipse"),
    "narrow rectangle": AreaLight(ABOVE, (1.0, 0, 0), (0, 0.6, 0), POWER, spread=1.0),
    "narrow ellipse": AreaLight(ABOVE, (1.0, 0, 0), (0, 0.6, 0), POWER, "ellipse", 1.0),
    "beam": AreaLight(ABOVE, (1.0, 0, 0), (0, 0.6, 0), POWER, "ellipse", 0.0),
}


PICTURE = np.random.default_rng(5).exponential(size=(6, 12, 3)) ** 3 * (np.arange(6) > 1)[:, None, None]

AROUND = {
    "world": ((UniformWorld(POWER),), False),
    "picture": ((EnvironmentWorld(PICTURE),), False),
    "dark picture": ((EnvironmentWorld(np.zeros((2, 4, 3))), UniformWorld(POWER)), False),
    "triangles": ((), True),
    "triangles and world": ((UniformWorld(POWER),), True),
    "triangles, picture and lamp": ((EnvironmentWorld(PICTURE), LAMPS["ball"]), True),
}


def shaded(lights, clear, emission=None):
    """Triangles strewn over a floor, and points on it that look about; ``clear`` lets a third of them pass light."""
    generator = np.random.default_rng(1)
    corners = generator.uniform((-1, -1, 0.05), (1, 1, 1.2), (60, 1, 3)) + 0.15 * generator.normal(size=(60, 3, 3))
    nothing = np.zeros((60, 3))
    passing = np.where((np.arange(60) % 3 == 0)[:, None], (0.3, 0.6, 0.9), 0.0) if clear else nothing
    triangles = np.arange(180).reshape(60, 3)
    scene = Scene(
        corners.reshape(-1, 3), triangles, nothing, nothing if emission is None else emission, passing, tuple(lights)
    )
    points = np.c_[generator.uniform(-1, 1, (300, 2)), np.zeros(300)]
    normals = generator.normal(size=(300, 3)) * 0.4 + (0, 0, 1)
    return scene, points, normals / np.linalg.norm(normals, axis=1)[:, None]


def found_both_ways(scene, points, normals, monkeypatch, rounds=8, **settings):
    """Direct light by NumPy and by kernels."""
    both = []
    for how in ("off", "on"):
        monkeypatch.setenv("DETP_COMPILED", how)
        light = DirectLight(scene, RayCaster(scene.corners), points, normals, BakeSettings(**settings))
        for _ in light.rounds(0, rounds):
            pass
        both.append(light)
    return both


def assert_same_light(one, other, to=1e-9):
    a, b = one.irradiance, other.irradiance
    for left, right in ((a.value, b.value), (a.standard_error, b.standard_error)):
        assert np.allclose(left, right, rtol=to, atol=to * np.abs(right).max())
    assert one.rays == other.rays and (a.value.sum(axis=1) > 0).mean() > 0.1


@pytest.mark.parametrize("clear", [False, True])
@pytest.mark.parametrize("kind", LAMPS)
def test_each_kind_of_lamp(kernels, kind, clear, monkeypatch):
    assert lamp_table([LAMPS[kind]]) is not None
    assert_same_light(*found_both_ways(*shaded([LAMPS[kind]], clear), monkeypatch))


@pytest.mark.parametrize("kind", LAMPS)
def test_each_kind_among_others(kernels, kind, monkeypatch):
    others = (LAMPS["ball"], LAMPS["sun"], LAMPS["ellipse"])
    assert_same_light(*found_both_ways(*shaded([LAMPS[kind], *others], False), monkeypatch))


def shining():
    """Radiance of the triangles: some shine, one takes light away."""
    generator = np.random.default_rng(6)
    emission = np.where((np.arange(60) % 4 == 1)[:, None], generator.exponential(size=(60, 3)), 0.0)
    emission[5] *= -0.1
    return emission


@pytest.mark.parametrize("clear", [False, True])
@pytest.mark.parametrize("kind", AROUND)
def test_each_kind_of_surroundings_as_they_are_learnt(kernels, kind, clear, monkeypatch):
    lights, emissive = AROUND[kind]
    scene, points, normals = shaded(lights, clear, shining() if emissive else None)
    monkeypatch.setattr("detp.core.direct.direction_guide.LEAST_GAIN", 1.0)
    numpy_s, compiled_s = found_both_ways(scene, points, normals, monkeypatch, 16)
    # What was learnt is kept in single precision, and rays follow it.
    assert_same_light(numpy_s, compiled_s, 1e-5)
    for one, other in zip(numpy_s._seen.sums, compiled_s._seen.sums, strict=True):
        assert np.allclose(one, other, rtol=1e-4, atol=1e-5 * np.abs(other).max())
    assert not numpy_s._guide._even.all() and np.allclose(
        numpy_s._guide._density, compiled_s._guide._density, rtol=1e-4
    )


@pytest.mark.parametrize("kind", ["world", "triangles and world"])
@pytest.mark.parametrize("clear", [False, True])
def test_shadows_within_a_distance(kernels, kind, clear, monkeypatch):
    lights, emissive = AROUND[kind]
    scene = shaded(lights, clear, shining() if emissive else None)
    near = found_both_ways(*scene, monkeypatch, 4, shadow_distance=0.4)
    assert_same_light(*near)
    far = found_both_ways(*scene, monkeypatch, 4)[0].irradiance.value
    assert (near[0].irradiance.value > far * 1.1).any()


def test_lamps_without_a_row_go_on_with_numpy(kernels, monkeypatch):
    class Other(PointLight):
        pass

    lamp = Other(ABOVE, POWER, 0.2)
    assert lamp_table([LAMPS["sun"], lamp]) is None
    own, known = (found_both_ways(*shaded([one], False), monkeypatch)[1] for one in (lamp, LAMPS["ball"]))
    assert_same_light(own, known)
