"""Light in scenes with mirrors and glass: nothing is lost, a furnace stays one, a mirror shows the lamp's image."""

from dataclasses import replace

import numpy as np
import pytest
from detp.core.lights.point import PointLight
from detp.core.lights.sun import SunLight
from detp.core.photons.specular import Specular
from detp.core.photons.tracing import PhotonTracer
from detp.core.rays import RayCaster
from detp.core.scene import Scene
from rooms import box_quads, scene_of
from scipy import stats

BATCHES, PARTICLES = 16, 6_000


def ball(centre, radius, rings=16):
    """Triangles (T, 3, 3) of a sphere, outside in front, and the sphere's normals (T, 3, 3) at their corners."""
    angle, turn = np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1)
    ring, height = np.sin(angle)[:, None], np.cos(angle)[:, None] * np.ones(len(turn))
    net = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=-1)
    a, b, c, d = net[:-1, :-1], net[1:, :-1], net[1:, 1:], net[:-1, 1:]
    below, above = np.stack([a, b, c], axis=2)[:-1], np.stack([a, c, d], axis=2)[1:]
    normals = np.concatenate([below.reshape(-1, 3, 3), above.reshape(-1, 3, 3)])
    return np.asarray(centre) + radius * normals, normals


def with_specular(scene, corners, normals=None, **properties):
    """The scene with ``corners`` (T, 3, 3) added as specular triangles that do nothing else to light."""
    count, first = len(corners), len(scene.triangles)
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.repeat(flat[:, None], 3, axis=1) if normals is None else normals
    values = {"mirror": 0.0, "gloss": 0.0, "clear": 0.0} | properties
    rgb = {name: np.broadcast_to(np.asarray(values[name], float), (count, 3)) for name in ("mirror", "gloss", "clear")}
    numbers = [np.full(count, properties.get(name, value)) for name, value in (("ior", 1.5), ("roughness", 0.0))]
    table = Specular(first + np.arange(count), normals, **rgb, ior=numbers[0], roughness=numbers[1])
    if scene.specular is not None:
        table = Specular(
            *(np.concatenate([getattr(scene.specular, name), value]) for name, value in vars(table).items())
        )
    more = np.zeros((count, 3))
    optics = {name: np.concatenate([getattr(scene, name), more]) for name in ("albedo", "emission", "transmittance")}
    vertices = np.concatenate([scene.vertices, corners.reshape(-1, 3)])
    faces = np.concatenate([scene.triangles, len(scene.vertices) + np.arange(3 * count).reshape(-1, 3)])
    return replace(scene, vertices=vertices, triangles=faces, specular=table, **optics)


def landed(scene, values, bounces=64, seed=1):
    """Flux (BATCHES, 3) W that meets the triangles, each weighed by its row of ``values`` (T, 3); and what was cut."""
    caster = RayCaster(scene.corners)
    tracer = PhotonTracer(scene, caster, scene.bounds, bounces)
    sums, cut = np.zeros((BATCHES, 3)), np.zeros((BATCHES, 3))
    for batch in range(BATCHES):
        traced = tracer.trace(PARTICLES, np.random.default_rng([seed, batch]))
        steps = traced.segments.ends - traced.segments.origins
        hits = caster.first_hits(traced.segments.origins, steps / np.linalg.norm(steps, axis=1)[:, None])
        rows = np.flatnonzero(hits.triangle >= 0)
        sums[batch] = (traced.segments.flux[rows] * values[hits.triangle[rows]]).sum(axis=0)
        cut[batch] = traced.cut_flux
    return sums, cut, tracer.emitted_flux


def assert_mean(samples, expected):
    assert stats.ttest_1samp(samples, expected).pvalue > 0.001, f"{samples.mean():.5f} instead of {expected:.5f}"


def weights(scene, rows):
    values = np.zeros((len(scene.triangles), 3))
    values[rows] = 1.0
    return values


GLASS = {"gloss": 1.0, "clear": 1.0}


@pytest.mark.parametrize("properties", [
    {**GLASS}, {**GLASS, "ior": 1 / 1.5}, {"mirror": 1.0}, {**GLASS, "roughness": 0.25},
    {"mirror": 1.0, "roughness": 0.5},
], ids=["glass", "air in glass", "mirror", "rough glass", "rough metal"])  # fmt: skip
def test_a_lossless_ball_changes_nothing_in_a_furnace(properties):
    albedo = 0.5
    room = scene_of(box_quads((2, 2, 2)), albedo, (1 - albedo) / np.pi)
    # One wall is black and shines as much as the others reflect and shine: what the ball turns must be even, too.
    room = replace(room, albedo=room.albedo * (np.arange(12) > 1)[:, None])
    room = replace(room, emission=np.where((np.arange(12) > 1)[:, None], room.emission, 1 / np.pi))
    scene = with_specular(room, *ball((1.1, 0.9, 0.8), 0.6), **properties)
    for wall in (slice(0, 2), slice(2, 12)):
        values = weights(scene, wall)
        sums, cut, emitted = landed(scene, values)
        assert_mean(sums.sum(axis=1) / 3, 4.0 * (1 if wall.stop == 2 else 5))
        # Facets with the normals of a ball hold a few particles for ever.
        assert cut.max() < 1e-3 * emitted[0]


def test_a_closed_room_with_gold_and_coloured_glass_absorbs_what_its_lamp_emits():
    gold, flux = np.array((1.0, 0.77, 0.34)), np.array((10.0, 20.0, 5.0))
    room = scene_of(box_quads((2, 2, 2)), (0.5, 0.6, 0.7), lights=(PointLight((0.3, 0.4, 1.5), flux),))
    scene = with_specular(room, *ball((0.6, 1.3, 0.5), 0.4), mirror=gold, roughness=0.1)
    scene = with_specular(scene, *ball((1.4, 0.8, 0.6), 0.5), gloss=1.0, clear=(0.9, 1.0, 0.8))
    first = len(room.triangles)
    absorbed = np.zeros((len(scene.triangles), 3))
    absorbed[:first] = 1 - room.albedo
    count = (len(scene.triangles) - first) // 2
    absorbed[first : first + count] = 1 - gold
    sums, cut, emitted = landed(scene, absorbed)
    assert emitted == pytest.approx(flux)
    # Green is lost in nothing but the walls and the gold; red and blue also in the glass.
    assert_mean((sums + cut)[:, 1], flux[1])
    assert ((sums + cut).mean(axis=0) < 0.999 * flux)[[0, 2]].all()


def test_mean_irradiance_of_a_room_with_clear_glass_is_that_of_the_empty_room():
    albedo = 0.6
    room = scene_of(box_quads((2, 3, 2)), albedo, lights=(PointLight((0.3, 0.4, 1.5), (1.0, 1.0, 1.0)),))
    scene = with_specular(room, *ball((1.2, 1.6, 0.7), 0.6), **GLASS)
    sums, _, _ = landed(scene, weights(scene, slice(0, 12)))
    assert_mean(sums[:, 0], 1 / (1 - albedo))


def square(half, height, at=(0.0, 0.0)):
    """Two triangles (2, 3, 3) in a level plane, facing up."""
    quad = np.array([(-half, -half, height), (half, -half, height), (half, half, height), (-half, half, height)])
    quad[:, :2] += at
    return quad[[(0, 1, 2), (0, 2, 3)]]


@pytest.mark.parametrize("tau", [0.0, 0.4])
def test_a_mirror_adds_the_light_of_the_lamps_image(tau):
    """A lamp between a level mirror and a small receiver above: direct light, and that of its image below."""
    tint, height, level = np.array((1.0, 0.6, 0.2)) * (1 - tau), 1.0, 3.0
    receiver, flux, at = square(0.5, level, (0.4, 0.2))[:, ::-1], 4 * np.pi, np.zeros(2)
    lamp = PointLight((*at, height), (flux,) * 3)
    floor = square(9.0, -0.5)
    receivers = np.concatenate([receiver, floor])
    scene = Scene(receivers.reshape(-1, 3), np.arange(12).reshape(4, 3), *np.zeros((3, 4, 3)), (lamp,))
    scene = with_specular(scene, square(8.0, 0.0), mirror=tint)
    scene = replace(scene, transmittance=np.where(np.arange(6)[:, None] > 3, tau, 0.0) * np.ones(3))
    sums, _, _ = landed(scene, weights(scene, slice(0, 2)))
    grid = (np.arange(200) + 0.5) / 200 - 0.5
    x, y = np.meshgrid(grid + 0.4, grid + 0.2)

    def received(rise):
        return (rise / (x**2 + y**2 + rise**2) ** 1.5).mean()

    for channel in range(3):
        assert_mean(sums[:, channel], received(level - height) + tint[channel] * received(level + height))
    # An alpha below one lets its share through, whatever the rest does.
    sums, _, _ = landed(scene, weights(scene, slice(2, 4)))
    if tau == 0.0:
        assert not sums.any()
    else:
        grid = 18 * ((np.arange(400) + 0.5) / 400 - 0.5)
        x, y = np.meshgrid(grid, grid)
        through = np.maximum(np.abs(x), np.abs(y)) / 1.5 <= 8.0
        assert_mean(sums[:, 0], tau * 324 * (through * 1.5 / (x**2 + y**2 + 2.25) ** 1.5).mean())


def test_specular_turns_count_as_bounces_and_straight_passage_does_not():
    pane = square(1.0, 1.0)
    sun = SunLight((0, 0, -1.0), (1.0, 1.0, 1.0), 0.0)
    floor = square(3.0, 0.0)
    scene = Scene(floor.reshape(-1, 3), np.arange(6).reshape(2, 3), *np.zeros((3, 2, 3)), (sun,))
    bending = with_specular(scene, pane, clear=1.0)
    caster = RayCaster(bending.corners)
    bent = (
        PhotonTracer(bending, caster, bending.bounds.expanded(0.1), 64).trace(1000, np.random.default_rng(1)).segments
    )
    assert set(bent.bounce) == {0, 1} and (bent.bounce == 1).any()
    none = PhotonTracer(bending, caster, bending.bounds.expanded(0.1), 0).trace(1000, np.random.default_rng(1))
    assert set(none.segments.bounce) == {0} and none.cut_flux[0] > 0
    straight = replace(bending, specular=None, transmittance=np.repeat([(0.0,) * 3, (1.0,) * 3], 2, axis=0))
    passed = PhotonTracer(straight, caster, straight.bounds.expanded(0.1), 0).trace(1000, np.random.default_rng(1))
    assert set(passed.segments.bounce) == {0} and not passed.cut_flux.any()
