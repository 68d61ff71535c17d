"""The visible-area estimator where the plain one fails: concave edges, hollows, thin walls, buried points."""

import numpy as np
import pytest
from detp.core.bake import baked
from detp.core.discs import TangentDiscs
from detp.core.estimator.standpoints import standpoints
from detp.core.estimator.visible_area import NUDGE, visible_discs
from detp.core.lights.emissive import EmissiveTriangles
from detp.core.lights.point import PointLight
from detp.core.lights.world import UniformWorld
from detp.core.points import Points
from detp.core.rays import RayCaster
from detp.core.scene import Scene
from detp.core.settings import BakeSettings
from rooms import box_quads, scene_of, z_scores

RADIUS = 0.1


def furnace(quads, albedo=0.5):
    """A closed room in which E = 1 everywhere: its surfaces emit to the inside only."""
    lit = scene_of(quads, albedo)
    light = InwardLight(lit.corners, np.full((len(lit.triangles), 3), (1 - albedo) / np.pi))
    return scene_of(quads, albedo, lights=(light,))


class InwardLight(EmissiveTriangles):
    """Emissive triangles of which only the side of their normal shines."""

    def flux(self, bounds):
        return super().flux(bounds) / 2

    def emit(self, uniforms, bounds):
        front = np.array((1, 1, 0.5, 1)) * uniforms
        sent = super().emit(front, bounds)
        return type(sent)(sent.origins, sent.directions, sent.flux / 2)


def corner_points(quads):
    """Every corner of every face, with the face's normal and the way to the face's middle."""
    points = quads.reshape(-1, 3)
    normals = np.cross(quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0])
    normals = np.repeat(normals / np.linalg.norm(normals, axis=1)[:, None], 4, axis=0)
    inward = np.repeat(quads.mean(axis=1), 4, axis=0) - points
    return points, normals, inward


def baked_with(scene, points, normals, inward, estimator="visible", photons=600_000, radius=RADIUS):
    # All light by discs at the points themselves, which are what is tried here.
    settings = BakeSettings(photons=photons, radius=radius, estimator=estimator, direct="photons", indirect="photons")
    return baked(scene, Points(points, normals, inward), settings)


def test_furnace_reads_one_at_every_corner_and_edge_of_a_box():
    quads = box_quads((2, 2, 2))
    points, normals, inward = corner_points(quads)
    middles = (quads + np.roll(quads, 1, axis=1)).reshape(-1, 3) / 2
    points = np.concatenate([points, middles])
    normals, inward = np.tile(normals, (2, 1)), np.concatenate([inward, np.repeat(quads.mean(1), 4, axis=0) - middles])
    visible = baked_with(furnace(quads), points, normals, inward)
    plain = baked_with(furnace(quads), points, normals, inward, "plain")
    # A corner shows a quarter of its disc and an edge a half: that is what the plain estimator reads.
    assert plain.irradiance[:24].mean() == pytest.approx(0.25, abs=0.02)
    assert plain.irradiance[24:].mean() == pytest.approx(0.5, abs=0.02)
    allowed = 0.02 + 3 * visible.standard_error[:, 0] / np.sqrt(24)
    for group in (slice(0, 24), slice(24, 48)):
        assert abs(visible.irradiance[group, 0].mean() - 1) < allowed[group].mean()
    assert np.abs(z_scores(visible, 1.0)).max() < 4


def test_furnace_reads_one_inside_a_sphere():
    quads = sphere_quads(48)
    scene = furnace(quads)
    generator = np.random.default_rng(4)
    rows = generator.choice(len(quads), 60, replace=False)
    points = quads[rows, 0]
    inward = quads.mean(axis=1)[rows] - points
    visible = baked_with(scene, points, -points / np.linalg.norm(points, axis=1)[:, None], inward)
    plain = baked_with(scene, points, -points, np.zeros_like(points), "plain", photons=100_000)
    assert plain.irradiance.max() < 0.1
    assert np.abs(z_scores(visible, 1.0)).max() < 4
    assert visible.irradiance[:, 0].mean() == pytest.approx(1, abs=0.02)


def test_outlines_that_are_looked_at_sparsely_read_one_as_well(monkeypatch):
    quads = box_quads((2, 2, 2))
    points, normals, inward = corner_points(quads)
    discs = TangentDiscs.of_radius(points, normals, RADIUS)
    caster = RayCaster(furnace(quads).corners)
    dense, sparse = (next(visible_discs(caster, discs, inward, every)).area for every in (1, 4))
    assert sparse.reach.shape == dense.reach.shape and (sparse.partial == dense.partial).all()
    # Corners see a quarter of their discs: an octagon's quarter instead of that of 32 sides, at the most.
    assert (sparse.areas < dense.areas).all() and (sparse.areas > 0.8 * dense.areas).all()
    monkeypatch.setattr("detp.core.bake.look_in_every", lambda *_: 4)
    visible = baked_with(furnace(quads), points, normals, inward)
    assert np.abs(z_scores(visible, 1.0)).max() < 4
    assert visible.irradiance[:, 0].mean() == pytest.approx(1, abs=0.03)


def sphere_quads(steps):
    """A unit sphere of quads whose normals point inward, without its poles' last rings (closed by thin quads)."""
    azimuth = np.linspace(0, 2 * np.pi, steps + 1)
    polar = np.linspace(0.001, np.pi - 0.001, steps // 2 + 1)
    p, a = np.meshgrid(polar, azimuth, indexing="ij")
    grid = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1)
    quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=2)
    return quads.reshape(-1, 4, 3)


def test_no_light_leaks_under_a_thin_wall():
    size, wall = (2, 1, 1), 1.0
    partition = np.array([(wall, 0, 0), (wall, 1, 0), (wall, 1, 1), (wall, 0, 1)], float)
    quads = np.concatenate([box_quads(size), [partition]])
    scene = scene_of(quads, 0.5, lights=(PointLight((0.5, 0.5, 0.5), (10.0, 10.0, 10.0)),))
    y = np.linspace(0.2, 0.8, 7)
    lit = np.stack([np.full(7, wall - 0.03), y, np.zeros(7)], axis=1)
    dark = np.stack([np.full(7, wall + 0.03), y, np.zeros(7)], axis=1)
    points, normals = np.concatenate([lit, dark]), np.tile((0, 0, 1.0), (14, 1))
    visible = baked_with(scene, points, normals, np.zeros((14, 3)), photons=300_000).irradiance
    plain = baked_with(scene, points, normals, np.zeros((14, 3)), "plain", photons=300_000).irradiance
    assert visible[7:].max() < 0.001 * visible[:7].mean()
    assert plain[7:].mean() > 0.1 * plain[:7].mean()


def test_a_disc_in_a_narrow_gap_is_not_lifted_through_the_wall():
    gap = 0.2 * NUDGE * RADIUS
    floor = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    scene = scene_of([floor, floor + (0, 0, gap)], lights=(PointLight((0, 0, 1.0), (1.0, 1.0, 1.0)),))
    points, normals = np.array([(0.1, 0, 0), (0.1, 0, gap)]), np.tile((0, 0, 1.0), (2, 1))
    lower, upper = baked_with(scene, points, normals, np.zeros((2, 3)), photons=100_000).irradiance[:, 0]
    assert lower == 0 < upper


def test_buried_points_are_hidden_and_others_are_not():
    floor = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    box = box_quads((0.002, 0.002, 0.002)) - np.array((0.001, 0.001, 0.0005))
    scene = scene_of(np.concatenate([[floor], box]), 0.5, lights=(PointLight((0, 0, 1.0), (1.0, 1.0, 1.0)),))
    points = np.array([(0, 0, 0), (0.5, 0.5, 0)], float)
    result = baked_with(scene, points, np.tile((0, 0, 1.0), (2, 1)), np.zeros((2, 3)), photons=1000)
    assert result.hidden.tolist() == [True, False]


def test_an_open_surface_has_whole_discs():
    quad = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    scene = Scene(quad, [(0, 1, 2), (0, 2, 3)], *np.zeros((3, 2, 3)), (PointLight((0.5, 0.5, 1), (1, 1, 1)),))
    points, normals = quad, np.tile((0, 0, 1.0), (4, 1))
    plain = baked_with(scene, points, normals, np.zeros((4, 3)), "plain", photons=1_000_000)
    visible = baked_with(scene, points, normals, np.zeros((4, 3)), photons=1_000_000)
    # Lifting the disc by a hundredth of its radius is all that differs.
    assert plain.irradiance == pytest.approx(np.full((4, 3), 1.5**-1.5 / (4 * np.pi)), rel=0.1)
    assert visible.irradiance == pytest.approx(plain.irradiance, rel=0.1)


def test_a_rounded_convex_corner_sees_the_whole_sky():
    cube = box_quads((1, 1, 1))[:, ::-1]
    corners = np.unique(cube.reshape(-1, 3), axis=0)
    outward = corners - 0.5
    scene = scene_of(cube, lights=(UniformWorld((1.0, 1.0, 1.0)),))
    # The middles of the faces around a corner, which lead into the solid.
    inward = -outward / 3
    result = baked_with(scene, corners, outward, inward, photons=500_000, radius=2 * RADIUS)
    assert not result.hidden.any()
    assert np.abs(z_scores(result, np.pi)).max() < 4
    assert result.irradiance.mean() == pytest.approx(np.pi, rel=0.02)


def enclosed_and_hidden(quads, points, normals, lights):
    scene = scene_of(quads, 0.5, lights=lights)
    (places,) = standpoints(RayCaster(scene.corners), points, normals)
    settings = BakeSettings(photons=20_000, radius=RADIUS, direct="photons", indirect="photons")
    return places.enclosed.tolist(), baked(scene, Points(points, normals), settings).hidden.tolist()


def test_points_inside_closed_things_are_enclosed_and_hidden():
    floor = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    thing = box_quads((0.6, 0.6, 0.6))[:, ::-1] - (0.3, 0.3, 0.1)
    points = np.array([(0, 0, 0), (0.2, 0.1, 0), (0.6, 0.5, 0)], float)
    lamp = PointLight((0.5, 0.5, 1.0), (1.0, 1.0, 1.0))
    found = enclosed_and_hidden(np.concatenate([[floor], thing]), points, np.tile((0, 0, 1.0), (3, 1)), (lamp,))
    assert found == ([True, True, False], [True, True, False])


def test_a_lit_room_of_outward_faces_encloses_its_points_but_does_not_hide_them():
    room = box_quads((1, 1, 1))[:, ::-1]
    points, normals = np.array([(0.5, 0.5, 0), (0.2, 0.3, 0)]), np.tile((0, 0, 1.0), (2, 1))
    lamp = PointLight((0.5, 0.5, 0.5), (1.0, 1.0, 1.0))
    assert enclosed_and_hidden(room, points, normals, (lamp,)) == ([True, True], [False, False])


def test_a_dark_room_stays_dark():
    rooms = np.concatenate([box_quads((1, 1, 1)), box_quads((1, 1, 1)) + (2, 0, 0)])
    points, normals = np.array([(0.5, 0.5, 0), (2.5, 0.5, 0)]), np.tile((0, 0, 1.0), (2, 1))
    lamp = PointLight((0.5, 0.5, 0.5), (1.0, 1.0, 1.0))
    assert enclosed_and_hidden(rooms, points, normals, (lamp,)) == ([False, False], [False, False])


def test_a_disc_in_a_wedge_is_not_lifted_through_its_other_side():
    floor = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    # A leaf that stands on the floor's middle line and leans over by 40 degrees, 20 cm thick.
    along, up = np.array((0, 1.0, 0)), np.array((np.cos(0.7), 0, np.sin(0.7)))
    leaf = box_quads((1, 1, 0.2))[:, ::-1] @ np.stack([up, along, np.cross(up, along)])
    scene = scene_of(np.concatenate([[floor], leaf]), lights=(UniformWorld((1.0, 1.0, 1.0)),))
    discs = TangentDiscs.of_radius(np.array([(0, 0.5, 0)]), np.array([(0, 0, 1.0)]), RADIUS)
    (placed,) = visible_discs(RayCaster(scene.corners), discs, np.array([(0.5, 0, 0)]))
    assert placed.discs.centres[0, 2] < np.tan(0.7) * placed.discs.centres[0, 0]
