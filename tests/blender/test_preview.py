"""The preview shows the baked colours at the exposure it states, and leaves no trace in the scene."""

import math

import bpy
import numpy as np
import pytest
from detp.detp_addon.preview import render_preview as preview
from detp.detp_addon.preview.render_preview import EXPOSED_TO, NEUTRAL, exposure_gain, render_preview
from detp.detp_addon.writing.write_attributes import MeshColours, write_colours
from fuzz.fingerprint import users
from PIL import Image


@pytest.fixture(autouse=True)
def _small_picture_of_an_empty_file(monkeypatch):
    monkeypatch.setattr(preview, "WIDTH", 320)
    monkeypatch.setattr(preview, "HEIGHT", 180)
    bpy.ops.wm.read_factory_settings(use_empty=True)


def cube(name, rgb=None, location=(0, 0, 0), size=2.0):
    bpy.ops.mesh.primitive_cube_add(location=location, size=size)
    obj = bpy.context.object
    obj.name = name
    if rgb is not None:
        write_colours([MeshColours(obj, {"light": np.tile(np.asarray(rgb, float), (24, 1))})], "CORNER", "light")
    bpy.context.view_layer.update()
    return obj


def camera_above(width=60, height=40):
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 12
    camera.location = (0, 0, 20)
    bpy.context.collection.objects.link(camera)
    scene = bpy.context.scene
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = width, height


def drawn(path):
    exposure = render_preview(bpy.context.scene, bpy.context.view_layer, "light", path)
    return exposure, np.asarray(Image.open(path).convert("RGB"), float) / 255


def srgb(linear):
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)


def contents():
    kinds = ("scenes", "objects", "meshes", "materials", "worlds", "cameras", "images", "node_groups")
    return {kind: {(block.name, users(block)) for block in getattr(bpy.data, kind)} for kind in kinds}


def test_baked_colours_are_exposed_others_grey_and_darkness_black(tmp_path):
    cube("baked", (2.0, 1.0, 0.5), (-4, 0, 0))
    cube("black", (0.0, 0.0, 0.0), (0, 0, 0))
    cube("plain", None, (4, 0, 0)).pass_index = 7
    camera_above()
    before = contents()
    exposure, picture = drawn(tmp_path / "p.png")
    gain = 2**exposure
    assert gain == pytest.approx(EXPOSED_TO / (0.2126 * 2 + 0.7152 + 0.0722 * 0.5), rel=1e-5)
    height, width = picture.shape[:2]
    assert width / height == pytest.approx(1.5, rel=0.01) and abs(width * height / (320 * 180) - 1) < 0.02

    def at(x):
        row, column = height // 2, round(width * (x / 12 + 0.5))
        return picture[row - 3 : row + 4, column - 3 : column + 4].mean(axis=(0, 1))

    np.testing.assert_allclose(at(-4), srgb(np.minimum(gain * np.array([2.0, 1.0, 0.5]), 1)), atol=0.01)
    np.testing.assert_allclose(at(0), 0, atol=0.01)
    np.testing.assert_allclose(at(4), srgb(np.full(3, NEUTRAL)), atol=0.01)
    assert contents() == before
    assert bpy.data.objects["plain"].pass_index == 7
    assert bpy.context.scene.view_layers[0].material_override is None


def test_instances_show_the_colours_of_their_object(tmp_path):
    baked = cube("baked", (1, 1, 1))
    kept = bpy.data.collections.new("kept")
    kept.objects.link(baked)
    bpy.context.collection.objects.unlink(baked)
    instance = bpy.data.objects.new("instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", kept
    bpy.context.collection.objects.link(instance)
    camera_above()
    _, picture = drawn(tmp_path / "p.png")
    assert picture[picture.shape[0] // 2, picture.shape[1] // 2] == pytest.approx(1.0, abs=0.01)


def test_without_a_camera_everything_baked_is_in_the_picture(tmp_path):
    cube("a", (1, 1, 1), (100, 50, 3))
    cube("b", (1, 1, 1), (104, 58, 3))
    _, picture = drawn(tmp_path / "p.png")
    assert picture.shape[:2] == (180, 320)
    bright = picture.mean(axis=2) > 0.5
    assert bright.mean() > 0.02
    edges = np.concatenate([bright[0], bright[-1], bright[:, 0], bright[:, -1]])
    assert not edges.any()


def test_a_closed_room_is_seen_from_inside(tmp_path):
    cube("room", (0.3, 0.3, 0.3), size=6.0)
    cube("thing", (1.0, 0.0, 0.0), (0, 0, -2))
    _, picture = drawn(tmp_path / "p.png")
    red = (picture[..., 0] > 0.8) & (picture[..., 1] < 0.1)
    assert 0.01 < red.mean() < 0.5
    assert (picture.mean(axis=2) > 0.2).mean() > 0.99


def plane(name, size, rgb=(1, 1, 1), location=(0, 0, 0)):
    bpy.ops.mesh.primitive_plane_add(size=size, location=location)
    obj = bpy.context.object
    obj.name = name
    write_colours([MeshColours(obj, {"light": np.tile(np.asarray(rgb, float), (4, 1))})], "CORNER", "light")
    bpy.context.view_layer.update()
    return obj


def test_a_room_with_a_wing_is_seen_from_inside(tmp_path):
    """Most of its box lies outside of it."""
    outline = [(0, 0), (8, 0), (8, 2), (2, 2), (2, 8), (0, 8)]
    walls = [((k + 1) % 6, k, k + 6, (k + 1) % 6 + 6) for k in range(6)]
    mesh = bpy.data.meshes.new("room")
    faces = [tuple(range(6)), tuple(range(11, 5, -1)), *walls]
    mesh.from_pydata([(x, y, z) for z in (0, 2.5) for x, y in outline], [], faces)
    room = bpy.data.objects.new("room", mesh)
    bpy.context.collection.objects.link(room)
    write_colours([MeshColours(room, {"light": np.full((len(mesh.loops), 3), 0.5)})], "CORNER", "light")
    bpy.context.view_layer.update()
    _, picture = drawn(tmp_path / "p.png")
    assert (picture.mean(axis=2) > 0.2).mean() > 0.99


def test_the_cameras_depth_of_field_does_not_blur(tmp_path):
    cube("thing", (1, 1, 1))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.collection.objects.link(camera)
    camera.location, bpy.context.scene.camera = (0, 0, 6), camera
    lens = camera.data.dof
    lens.use_dof, lens.focus_distance, lens.aperture_fstop = True, 0.3, 0.5
    _, picture = drawn(tmp_path / "p.png")
    between = (picture.mean(axis=2) > 0.3) & (picture.mean(axis=2) < 0.7)
    assert between.mean() < 0.01 and lens.use_dof


def test_a_flat_floor_is_seen_from_above(tmp_path):
    """The middle of its box lies on it, and all of it is in the picture."""
    plane("floor", 4.0)
    _, picture = drawn(tmp_path / "p.png")
    bright = picture.mean(axis=2) > 0.5
    assert 0.1 < bright.mean() < 0.6
    assert not (bright[0].any() or bright[-1].any())


def test_a_solid_thing_is_seen_from_outside(tmp_path):
    cube("tower", (1, 1, 1)).scale = (1, 1, 8)
    bpy.context.view_layer.update()
    _, picture = drawn(tmp_path / "p.png")
    bright = picture.mean(axis=2) > 0.5
    assert 0.02 < bright.mean() < 0.5 and not bright[:, 0].any()


def share_of_red(tmp_path):
    _, picture = drawn(tmp_path / "p.png")
    return ((picture[..., 0] > 0.5) & (picture[..., 1] < 0.1)).mean()


@pytest.mark.parametrize(("around", "size"), [("ground", 400.0), ("sky", 25.0), ("sky", 60.0), ("sky", 400.0)])
def test_a_wide_ground_or_sky_does_not_hide_what_is_in_it(tmp_path, around, size):
    if around == "ground":
        plane("ground", size, (0.1, 0.1, 0.1))
    else:
        cube("sky", (0.5, 0.5, 0.5), size=size).scale = (-1, 1, 1)
    for place in ((0, 0, 0.5), (3, 2, 0.5)):
        cube(f"crate {place}", (1.0, 0.0, 0.0), place, 1.0)
    assert 0.005 < share_of_red(tmp_path) < 0.5


@pytest.mark.parametrize(("x", "y"), [(-2, 2), (2, -2)])
def test_a_set_is_seen_from_its_open_side(tmp_path, x, y):
    """Two walls of a corner, which show their fronts to its inside, and something on the floor between."""
    plane("floor", 4.0, (0.1, 0.1, 0.1))
    plane("wall", 4.0, (0.1, 0.1, 0.1), (x, 0, 2)).rotation_euler = (0, -math.copysign(math.pi / 2, x), 0)
    plane("other", 4.0, (0.1, 0.1, 0.1), (0, y, 2)).rotation_euler = (math.copysign(math.pi / 2, y), 0, 0)
    cube("thing", (1.0, 0.0, 0.0), (0.6 * x, 0.6 * y, 0.5), 1.0)
    assert 0.005 < share_of_red(tmp_path) < 0.5


def test_a_thing_far_astray_does_not_make_specks_of_the_rest(tmp_path):
    for name, place in (("a", 0), ("b", 4), ("astray", 5000)):
        cube(name, (1, 1, 1), (place, 0, 0))
    _, picture = drawn(tmp_path / "p.png")
    assert (picture.mean(axis=2) > 0.5).mean() > 0.02


def test_cards_that_coincide_are_even(tmp_path):
    """Black and white at the same place: each pixel shows about as much of both as its neighbours."""
    for name, light in (("white", 1.0), ("black", 0.0)):
        plane(name, 8.0, (light,) * 3)
    camera_above()
    _, picture = drawn(tmp_path / "p.png")
    middle = picture[40:-40, 60:-60].mean(axis=2)
    assert middle.std() < 0.12


def test_of_cards_back_to_back_each_shows_its_front(tmp_path):
    """The upper one is white, and alone in the picture."""
    plane("upper", 8.0, (1.0, 1.0, 1.0))
    plane("lower", 8.0, (0.0, 0.0, 0.0)).rotation_euler = (math.pi, 0, 0)
    camera_above()
    _, picture = drawn(tmp_path / "p.png")
    assert picture[40:-40, 60:-60].min() > 0.75


def test_a_black_bake_has_no_exposure(tmp_path):
    cube("black", (0, 0, 0))
    camera_above()
    assert exposure_gain(bpy.context.scene, "light") == 1
    exposure, _ = drawn(tmp_path / "p.png")
    assert exposure == 0 and math.isfinite(exposure)


def test_the_picture_does_not_tell_where_it_was_made(tmp_path):
    cube("baked", (1, 1, 1))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "secret_place.blend"))
    drawn(tmp_path / "picture.png")
    assert b"secret_place" not in (tmp_path / "picture.png").read_bytes()
