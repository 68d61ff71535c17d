"""Mirrors and glass against their formulas: Fresnel, Snell, microfacets, a ball as a lens."""

import numpy as np
import pytest
from detp.core.errors import InvalidArrayError
from detp.core.lights.light import Particles
from detp.core.lights.point import PointLight
from detp.core.photons.specular import Specular, SpecularSurfaces, fresnel, visible_normals
from detp.core.photons.tracing import PhotonTracer
from detp.core.rays import RayCaster
from detp.core.scene import Scene
from scipy import stats

TRIANGLE = np.array([[(0, 0, 0), (1, 0, 0), (0, 1, 0)]], float)


def of(corners, normals=None, mirror=0.0, gloss=0.0, clear=0.0, ior=1.5, roughness=0.0):
    """All of the triangles with ``corners`` (T, 3, 3) alike."""
    corners, count = np.asarray(corners, float), len(corners)
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.repeat(flat[:, None], 3, axis=1) if normals is None else normals
    rgb = [np.broadcast_to(np.asarray(value, float), (count, 3)) for value in (mirror, gloss, clear)]
    return Specular(np.arange(count), normals, *rgb, np.full(count, ior), np.full(count, roughness))


def turned(directions, specular, corners=TRIANGLE):
    directions = np.asarray(directions, float)
    points = np.tile(corners.mean(axis=(0, 1)), (len(directions), 1))
    surfaces = SpecularSurfaces(specular, corners)
    return surfaces.turns(np.zeros(len(directions), int), directions, points, np.random.default_rng(1))


def slanting(angles, upward=False):
    """Directions (K, 3) at ``angles`` from the vertical, down or up, towards +x."""
    return np.stack([np.sin(angles), 0 * angles, (1 if upward else -1) * np.cos(angles)], axis=1)


@pytest.mark.parametrize("ratio", [1.5, 1 / 1.5, 1.333, 2.4])
def test_fresnel_reflectance_by_the_angles(ratio):
    limit = np.arcsin(ratio) if ratio < 1 else np.pi / 2
    inside = np.linspace(0.01, 0.999, 50) * limit
    beyond = np.arcsin(np.sin(inside) / ratio)
    across = np.sin(inside - beyond) / np.sin(inside + beyond)
    along = np.tan(inside - beyond) / np.tan(inside + beyond)
    reflectance, cosine = fresnel(np.cos(inside), ratio)
    assert np.allclose(reflectance, (across**2 + along**2) / 2, rtol=1e-8)
    assert np.allclose(cosine, np.cos(beyond), atol=1e-9)
    assert fresnel(np.array([1.0]), ratio)[0] == pytest.approx(((ratio - 1) / (ratio + 1)) ** 2)
    brewster = np.arctan(ratio)
    expected = ((1 - ratio**2) / (1 + ratio**2)) ** 2 / 2
    assert fresnel(np.cos([brewster]), ratio)[0] == pytest.approx(expected)
    assert fresnel(np.array([0.0]), ratio)[0] == 1


def test_total_reflection_and_no_boundary():
    critical = np.arcsin(1 / 1.5)
    assert (fresnel(np.cos(critical + np.array([1e-6, 0.1, 0.7])), 1 / 1.5)[0] == 1).all()
    assert fresnel(np.cos([critical - 1e-3]), 1 / 1.5)[0] < 0.9
    assert np.allclose(fresnel(np.array([1.0, 0.3, 1e-7]), 1.0)[0], 0)


@pytest.mark.parametrize("upward", [False, True])
def test_glass_bends_light_by_snells_law_and_shares_it_by_fresnel(upward):
    angles = np.linspace(0.0, 1.5, 40)
    tint, shine = np.array((0.5, 0.7, 0.9)), np.array((1.0, 0.9, 0.8))
    ratio = 1 / 1.5 if upward else 1.5
    found = turned(slanting(angles, upward), of(TRIANGLE, gloss=shine, clear=tint))
    reflectance, _ = fresnel(np.cos(angles), ratio)
    assert np.allclose(found.mirrored, reflectance[:, None] * shine)
    assert np.allclose(found.refracted, (1 - reflectance)[:, None] * tint)
    assert np.allclose(found.mirrored_direction, slanting(angles, not upward))
    through = reflectance < 1
    beyond = np.arcsin(np.sin(angles[through]) / ratio)
    assert np.allclose(found.refracted_direction[through], slanting(beyond, upward), atol=1e-7)


def test_metal_reflects_its_colour_and_glass_nothing_less_than_all():
    found = turned(slanting(np.linspace(0, 1.5, 9)), of(TRIANGLE, mirror=(1.0, 0.8, 0.3)))
    assert np.allclose(found.mirrored, (1.0, 0.8, 0.3)) and not found.refracted.any()
    found = turned(slanting(np.linspace(0, 1.5, 9)), of(TRIANGLE, gloss=1.0, clear=1.0))
    assert np.allclose(found.mirrored + found.refracted, 1.0)


def test_rough_and_smoothly_shaded_surfaces_send_all_light_to_its_proper_side():
    generator = np.random.default_rng(7)
    for roughness in (0.0, 0.1, 1.0):
        normals = generator.normal(size=(1, 3, 3)) * 0.7 + (0, 0, 1)
        corners, specular = TRIANGLE, of(TRIANGLE, normals, roughness=roughness, gloss=1.0, clear=1.0)
        directions = generator.normal(size=(5000, 3))
        directions[:9] *= (1, 1, 0)
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        found = turned(directions, specular, corners)
        side = np.where(directions[:, 2] < 0, 1.0, -1.0)
        through = found.refracted[:, 0] > 0
        for turn, towards, rows in ((found.mirrored_direction, side, slice(None)),
                                    (found.refracted_direction, -side, through)):  # fmt: skip
            assert np.allclose(np.linalg.norm(turn[rows], axis=1), 1.0)
            assert ((turn[:, 2] * towards)[rows] >= -1e-12).all()


def test_microfacets_are_met_as_they_are_seen():
    alpha, tilt, count = 0.4, 1.0, 100_000
    towards = np.tile((np.sin(tilt), 0.0, np.cos(tilt)), (count, 1))
    normals, uniforms = np.tile((0.0, 0.0, 1.0), (count, 1)), np.random.default_rng(3).random((count, 2))
    facets = visible_normals(normals, towards, np.full(count, alpha), uniforms)
    # Their density is D(m) (m v)+, normalised, over the hemisphere.
    height, turn = np.meshgrid((np.arange(2000) + 0.5) / 2000, (np.arange(720) + 0.5) / 720 * 2 * np.pi)
    ring = np.sqrt(1 - height**2)
    grid = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=-1)
    density = np.maximum(grid @ towards[0], 0) / (height**2 * (alpha**2 - 1) + 1) ** 2
    for moment in (lambda m: m, lambda m: m**2):
        expected = (density[..., None] * moment(grid)).sum(axis=(0, 1)) / density.sum()
        values = moment(facets)
        error = values.std(axis=0) / np.sqrt(count)
        assert (np.abs(values.mean(axis=0) - expected) < 4 * error).all()


def test_microfacets_seen_from_above_follow_the_distribution():
    alpha, count = 0.3, 20_000
    up = np.tile((0.0, 0.0, 1.0), (count, 1))
    facets = visible_normals(up, up, np.full(count, alpha), np.random.default_rng(5).random((count, 2)))
    squared = 1 / facets[:, 2] ** 2 - 1
    assert stats.kstest(squared / (alpha**2 + squared), "uniform").pvalue > 0.001


def ball(rings=48, radius=1.0):
    """Triangles (T, 3, 3) of a sphere around the origin, and the true normals at their corners."""
    angle, turn = np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1)
    ring, height = np.sin(angle)[:, None], np.cos(angle)[:, None] * np.ones(len(turn))
    net = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=-1)
    a, b, c, d = net[:-1, :-1], net[1:, :-1], net[1:, 1:], net[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3, 3)
    edges = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    triangles = triangles[np.linalg.norm(np.cross(*edges), axis=1) > 1e-9]
    return radius * triangles, triangles


class Beam:
    """Light straight down in a thin ring around the z axis, for the tests of lenses."""

    sharp = True

    def __init__(self, radius):
        self.radius = radius

    def flux(self, bounds):
        return np.ones(3)

    def emit(self, uniforms, bounds):
        count, turn = len(uniforms), 2 * np.pi * uniforms[:, 0]
        origins = np.stack([self.radius * np.cos(turn), self.radius * np.sin(turn), np.full(count, 9.0)], axis=1)
        return Particles(origins, np.tile((0.0, 0.0, -1.0), (count, 1)), np.full((count, 3), 1 / count))


def scene_of(corners, specular, light):
    zero = np.zeros((len(corners), 3))
    triangles = np.arange(3 * len(corners)).reshape(-1, 3)
    return Scene(corners.reshape(-1, 3), triangles, zero, zero, zero, (light,), specular)


@pytest.mark.parametrize("ior", [1.33, 1.5, 1.9])
def test_a_glass_ball_focuses_where_a_ball_lens_does(ior):
    corners, normals = ball()
    scene = scene_of(corners, of(corners, normals, clear=1.0, ior=ior), Beam(0.05))
    traced = PhotonTracer(scene, RayCaster(corners), scene.bounds, 64).trace(4000, np.random.default_rng(2))
    after = traced.segments.taken(traced.segments.bounce == 2)
    assert after.flux.sum() == pytest.approx(3 * (4 * ior / (ior + 1) ** 2) ** 2, rel=0.03)
    step = after.ends - after.origins
    # The height at which each ray comes closest to the axis.
    along = -(after.origins[:, :2] * step[:, :2]).sum(axis=1) / (step[:, :2] ** 2).sum(axis=1)
    focus = -(after.origins + along[:, None] * step)[:, 2]
    # Rays off the axis by 0.05 of the radius meet within 1 % before the paraxial focus; facets scatter single rays.
    assert np.median(focus) == pytest.approx(ior / (2 * (ior - 1)), rel=0.01)


def test_mirrors_that_no_light_meets_change_no_bit():
    room = np.array([[(0, 0, 0), (3, 0, 0), (0, 3, 0)], [(0, 0, 0), (0, 3, 0), (0, 0, 3)],
                     [(0, 0, 0), (0, 0, 3), (3, 0, 0)], [(3, 0, 0), (0, 0, 3), (0, 3, 0)],
                     [(9, 9, 9), (9, 10, 9), (9, 9, 10)]], float)  # fmt: skip
    grey, none = np.full((5, 3), 0.6), np.zeros((5, 3))
    lamp = PointLight((0.4, 0.4, 0.4), (1.0, 2.0, 3.0))
    mirror = Specular([4], room[None, 4], np.ones((1, 3)), none[:1], none[:1], [1.5], [0.2])
    paths = []
    for specular in (None, mirror):
        scene = Scene(room.reshape(-1, 3), np.arange(15).reshape(5, 3), grey, none, none, (lamp,), specular)
        tracer = PhotonTracer(scene, RayCaster(room), scene.bounds, 64)
        paths.append(tracer.trace(5000, np.random.default_rng(8)).segments)
    for name in ("origins", "ends", "flux", "bounce"):
        assert np.array_equal(getattr(paths[0], name), getattr(paths[1], name))


@pytest.mark.parametrize("changes", [
    {"triangles": [1, 0]}, {"triangles": [0, 0]}, {"triangles": [-1, 0]}, {"ior": [1.5, 0.0]}, {"ior": [1.5]},
    {"mirror": -np.ones((2, 3))}, {"roughness": [np.nan, 0]}, {"normals": np.zeros((2, 3, 3))},
    {"gloss": np.ones((1, 3))}, {"normals": np.ones((2, 3))},
])  # fmt: skip
def test_specular_refuses_wrong_arrays(changes):
    values = {"triangles": [0, 1], "normals": np.ones((2, 3, 3)), "ior": [1.5, 1.5], "roughness": [0, 0]}
    values |= {name: np.zeros((2, 3)) for name in ("mirror", "gloss", "clear")}
    with pytest.raises(InvalidArrayError):
        Specular(**(values | changes))


def test_a_scene_refuses_specular_triangles_that_it_does_not_have():
    table = Specular([4], TRIANGLE + 1, *np.zeros((3, 1, 3)), [1.5], [0.0])
    with pytest.raises(InvalidArrayError, match="specular triangles"):
        scene_of(TRIANGLE, table, Beam(0.1))
