"""The tools that measure what faces show: light at given places, colours between vertices, and the figures."""

from argparse import Namespace

import bpy
import numpy as np
import pytest
from cycles_places import clearance, light_at
from cycles_reference import at_standpoints
from detp.detp_addon.tradeoff.face_copies import centred, render_faces
from face_places import drawn_places, given_places
from measure_faces import figures
from shown_faces import shown_faces
from small_scenes import box_on_floor, grid, lamp


def test_cycles_light_at_any_place_is_that_of_a_point_light():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    grid("Floor", size=20)
    lamp((0, 0, 2), 100.0)
    bpy.data.lights["Lamp"].shadow_soft_size = 0.0
    generator = np.random.default_rng(1)
    places = np.column_stack([generator.uniform(-5, 5, (200, 2)), np.zeros(200)])
    up = np.tile([0.0, 0.0, 1.0], (200, 1))
    tilted = np.tile([np.sin(0.5), 0.0, np.cos(0.5)], (200, 1))
    ways = np.array([0.0, 0.0, 2.0]) - places
    distance = np.linalg.norm(ways, axis=1)
    starts = places + clearance(places)[:, None] * up
    for normals in (up, tilted):
        cosine = np.maximum(np.einsum("ij,ij->i", ways, normals) / distance, 0.0)
        found = light_at(starts, normals, 3, up)
        # E = I cos / r^2 with I = W / 4 pi (Blender's point light), and E / pi is baked.
        assert found[:, :, 0] == pytest.approx(np.tile(100 / (4 * np.pi**2) * cosine / distance**2, (2, 1)), abs=1e-4)


def test_a_reference_at_standpoints_belongs_to_the_corners():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    floor = grid("Floor", (100, 0, 0), size=2)  # so far away that it is moved to the origin before
    lamp((100, 0, 2), 100.0)
    bpy.data.lights["Lamp"].shadow_soft_size = 0.0
    bpy.context.view_layer.update()
    bpy.context.scene.unit_settings.scale_length = 0.01
    found = at_standpoints(["Floor"], Namespace(standpoints=10, samples=3, output="none"))["Floor|1"][:, 0]
    corners = np.array([floor.data.vertices[loop.vertex_index].co for loop in floor.data.loops])
    there = np.isfinite(found)
    assert len(np.unique(corners[there], axis=0)) == 10
    squared = (corners[there] ** 2).sum(axis=1) + 4
    assert found[there] == pytest.approx(100 / (4 * np.pi**2) * 2 / squared**1.5, rel=1e-3)


def test_what_is_far_away_comes_near_with_the_places_on_it():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    floor = grid("Floor", (84_937.25, 447_633.1875, 0.7), size=10)
    floor.data.vertices[-1].co.y += 0.3  # so that their middle is no number of single precision
    bpy.context.view_layer.update()
    scene = bpy.context.scene
    faces = render_faces(scene, bpy.context.view_layer, ["Floor"])
    near, _ = centred(scene, faces)
    again = render_faces(scene, bpy.context.view_layer, ["Floor"])["Floor"]
    assert np.abs(again.corners).max() < 10
    assert again.corners == pytest.approx(near["Floor"].corners, abs=1e-6)


@pytest.mark.parametrize("domain", ["POINT", "CORNER"])
@pytest.mark.parametrize("finer", [False, True])
def test_colours_are_interpolated_over_the_faces(domain, finer):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    floor = grid("Floor", (1, 2, 3))
    floor.scale = (-2, 1, 1)
    if finer:
        for _ in range(2):
            bpy.ops.object.editmode_toggle()
            bpy.ops.mesh.subdivide()
            bpy.ops.object.editmode_toggle()
    bpy.context.view_layer.update()
    layer = floor.data.attributes.new("irradiance", "FLOAT_COLOR", domain)
    vertices = floor.data.vertices
    elements = vertices if domain == "POINT" else [vertices[loop.vertex_index] for loop in floor.data.loops]
    for element, vertex in zip(layer.data, elements, strict=True):
        x, y, _ = floor.matrix_world @ vertex.co
        element.color = (10 + x, 10 + y, 5, 1)
    places = np.column_stack([np.random.default_rng(2).uniform((-2.5, 0.5), (4.5, 3.5), (50, 2)), np.full(50, 3.0)])
    shown = shown_faces(["Floor"], "irradiance")["Floor"].at(places, np.tile([0.0, 0.0, 1.0], (50, 1)))
    expected = np.column_stack([10 + places[:, 0], 10 + places[:, 1], np.full(50, 5.0)])
    assert shown == pytest.approx(expected, abs=1e-4)


def test_places_are_spread_by_area_and_not_below_a_plate():
    box_on_floor()
    plate = bpy.data.objects["Box"]
    plate.scale.z, plate.location.z = 0.002, 0.001
    places, normals = drawn_places(2000)
    floor = places.positions[places.names[places.object] == "Floor"]
    plate = places.positions[places.names[places.object] == "Box"]
    assert np.einsum("ij,ij->i", normals, places.facing) == pytest.approx(np.ones(len(normals)), abs=1e-6)
    # The floor has 4 x 4 less the square of 1 x 1 where the plate lies on it, whose lower side can be seen from below.
    assert len(floor) / len(plate) == pytest.approx((16 - 1) / 2, rel=0.02)
    assert not (np.abs(floor[:, :2]) < 0.49).all(axis=1).any()


def test_given_light_is_that_of_a_face(tmp_path):
    box_on_floor()
    light = {}
    for name in ("Floor", "Box"):
        loops = len(bpy.data.objects[name].data.loops)
        for seed in (1, 2):
            light[f"{name}|{seed}"] = np.full((loops, 3), np.nan)
            light[f"{name}|{seed}"][:4] = seed
    np.savez(tmp_path / "faces.npz", **light)
    places = given_places(tmp_path / "faces.npz")
    first = bpy.data.objects["Floor"].data.polygons[0]
    assert places.light[:, 0] == pytest.approx(np.array([[1.0] * 3, [2.0] * 3]))
    assert places.area[0] == pytest.approx(first.area)
    assert np.abs(places.positions[places.group == 0] - np.array(first.center)).max() < 0.2
    assert places.facing[0] == pytest.approx((0, 0, 1))


def test_figures_of_what_is_shown():
    generator = np.random.default_rng(3)
    true, area = np.exp(generator.normal(size=20_000)), generator.random(20_000)
    halves = true * (1 + 0.05 * generator.normal(size=(2, 20_000)))
    right = figures(true, halves, area)
    assert right["half"] == right["tenth"] == right["twice"] == 0.0
    assert right["mean"] == pytest.approx(1.0, abs=0.01)
    # A mean of two halves is off by as much as half their difference: nothing is left but chance.
    assert right["seen"] < 0.004
    assert right["median"] < 0.01
    dim = np.where(np.arange(20_000) % 10 == 0, 0.04, 0.8) * true
    share = area[::10].sum() / area.sum()
    found = figures(dim, halves, area)
    assert (found["half"], found["tenth"]) == pytest.approx((share, share))
    assert found["median"] == pytest.approx(0.2, abs=0.01)
    assert found["95"] == pytest.approx(0.96, abs=0.01)
    assert figures(2.5 * true, halves, area)["twice"] == pytest.approx(1.0, abs=0.01)
