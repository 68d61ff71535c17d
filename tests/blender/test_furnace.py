"""White furnaces made in Blender and read by the add-on: every vertex and every corner must read one."""

import numpy as np
import pytest

pytest.importorskip("bpy")

import bpy
from detp.core.bake import baked
from detp.core.estimator.standpoints import Standpoints, standpoints
from detp.core.points import Points
from detp.core.rays import RayCaster
from detp.core.settings import BakeSettings
from detp.detp_addon.reading.read_scene import read_scene
from detp.detp_addon.values import points_of, values_of
from enclosures import ENCLOSURES, furnace, smooth_box
from furnace_table import ALLOWED, baked_with, elements, errors, limit, placed_discs

RAYS = 120

FINAL = BakeSettings("final")

#: metres; each domain with another one, to save time
RADII = {"CORNER": 0.02, "POINT": 0.1}


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
@pytest.mark.parametrize("name", ENCLOSURES)
def test_without_noise_every_element_reads_one(name, domain):
    enclosure = furnace(ENCLOSURES[name], domain)
    placed = placed_discs(enclosure, RADII[domain])
    values = limit(enclosure, placed, RAYS, np.random.default_rng(3))
    exported = enclosure.exported
    places = standpoints(RayCaster(exported.scene.corners), exported.centres, exported.facing, exported.inward)
    hidden = placed.area.hidden | (Standpoints.joined(list(places)).enclosed & (values == 0))
    # Of a value that is off by just as much as allowed the rays' count varies so much.
    error = np.sqrt(ALLOWED * (1 - ALLOWED) / RAYS)
    reading = elements(enclosure, hidden, values, np.full(len(values), error))
    assert reading.wrong == 0
    assert reading.values.mean() == pytest.approx(1, abs=0.001)
    assert reading.filled < 0.25 * len(reading.values)


@pytest.mark.parametrize("name, domain", [
    ("L-shaped room, inner walls of 1 cm", "CORNER"), ("box sunk into the floor", "POINT"),
    ("UV sphere, smooth", "POINT"), ("half-open door", "CORNER"),
])  # fmt: skip
def test_a_bake_reads_one_within_its_noise(name, domain):
    enclosure = furnace(ENCLOSURES[name], domain)
    result = baked_with(enclosure, "visible", 0.1, 200_000)
    noise = errors(result, placed_discs(enclosure, 0.1).area.areas)
    reading = elements(enclosure, result.hidden, result.irradiance[:, 0], noise)
    assert reading.values.mean() == pytest.approx(1, abs=ALLOWED)
    # A few of hundreds of elements lie beyond three standard errors, and none beyond five.
    assert reading.wrong < 0.01
    assert (np.abs(reading.values - 1) < ALLOWED + 5 * reading.errors).all()


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
def test_the_faces_of_a_smooth_box_show_one(domain):
    """Their normals lean from their faces by up to 55 degrees, behind which they lose no light."""
    enclosure = furnace(smooth_box, domain)
    exported = enclosure.exported
    scene = read_scene(bpy.context.scene, bpy.context.view_layer, None, domain, fit="faces")
    targets, points = points_of(scene.targets, scene)
    result = baked(exported.scene, Points(points.centres, points.normals, points.inward, points.facing), FINAL)
    shown = values_of(points, result).irradiance[targets[0].point_rows]
    assert shown == pytest.approx(1, abs=ALLOWED)


def test_a_leaning_card_faces_as_it_lies():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=3, y_subdivisions=3)
    mesh = bpy.context.object.data
    mesh.shade_smooth()
    mesh.normals_split_custom_set([(0.8, 0, 0.6)] * len(mesh.loops))
    shown = read_scene(bpy.context.scene, bpy.context.view_layer, None, "CORNER", fit="faces")
    assert np.allclose(shown.facing, (0, 0, 1))
    assert np.allclose(shown.normals, (0.8, 0, 0.6), atol=1e-3)


@pytest.mark.parametrize("side", [-1, 1])
def test_smooth_faces_face_as_their_surface_where_it_is_hollow_alone(side):
    """A bent strip, met from the side of its fold or from the other, mirrored or not."""
    for mirrored in (False, True):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        strip = [(-1, 0, 1), (-1, 1, 1), (0, 0, 0), (0, 1, 0), (1, 0, 1), (1, 1, 1)]
        faces = [(0, 2, 3, 1), (2, 4, 5, 3)] if side > 0 else [(1, 3, 2, 0), (3, 5, 4, 2)]
        mesh = bpy.data.meshes.new("strip")
        mesh.from_pydata(strip, [], faces)
        mesh.shade_smooth()
        obj = bpy.data.objects.new("strip", mesh)
        obj.scale.y = -1 if mirrored else 1
        bpy.context.scene.collection.objects.link(obj)
        shown = read_scene(bpy.context.scene, bpy.context.view_layer, None, "CORNER", fit="faces")
        along = np.abs(shown.centres[:, 0])[:, None]
        flat = np.sqrt(0.5) * np.stack([-np.sign(shown.centres[:, 0]), 0 * along[:, 0], 1 + 0 * along[:, 0]], axis=1)
        # From the fold, where the surface faces up, to the edge, where it faces as the face does.
        leaning = along * flat + (1 - along) * np.array((0, 0, 1.0))
        leaning /= np.linalg.norm(leaning, axis=1, keepdims=True)
        assert np.allclose(shown.normals, side * leaning, atol=1e-3)
        assert np.allclose(shown.facing, leaning if side > 0 else -flat, atol=1e-3)


def test_the_plain_estimator_is_dark_where_faces_meet():
    enclosure = furnace(ENCLOSURES["closed box"], "CORNER")
    result = baked_with(enclosure, "plain", 0.1, 100_000)
    assert elements(enclosure, result.hidden, result.irradiance[:, 0], result.standard_error[:, 0]).wrong > 0.3
