"""Tries of a newcomer: find it, bake the default cube and the samples, stop, choose, move, save, export."""

import tempfile
import time
from pathlib import Path

import bpy
import numpy as np
import window_driver as user
from bpy_extras.view3d_utils import location_3d_to_region_2d
from glb import Glb
from mathutils import Vector
from watching import (
    LIT,
    MANY,
    baked,
    baking,
    finished_bake,
    light_of,
    open_file,
    open_scene,
    outcome,
    over,
    picture,
    session,
    shading,
    start_a_bake,
    using,
    whole_bake,
)

ROOT = Path(__file__).resolve().parents[2]

#: pixels between two clicks on the sidebar's tabs
TAB = 20

#: the sample's shining mesh
LAMP = "Light"


def try_find():
    """The tab, by N and a click; the search for menu entries; the entry in the render properties, by their search."""
    yield from open_file()
    yield from user.key("N")
    yield 0.5
    sidebar = user.panels()
    for y in range(sidebar.y + sidebar.height - 20, sidebar.y, -TAB):
        yield from user.click(sidebar.x + sidebar.width - 10, y)
        if sidebar.active_panel_category == "Light Bake":
            break
    assert sidebar.active_panel_category == "Light Bake"
    yield from picture("tab")
    yield from user.key("F3")
    yield 0.3
    yield from user.write("vertex light", picture("search"))
    yield from user.wait_for(lambda: session().latest() is not None, 5)
    yield from finished_bake()
    yield from user.key("Z", ctrl=True)
    yield from user.wait_for(lambda: baked() == 0, 5)
    bpy.context.scene.render.engine = "CYCLES"
    user.area("PROPERTIES").spaces[0].context = "RENDER"
    yield from user.key("F", "PROPERTIES", ctrl=True)
    yield from user.write("vertex light")
    below = user.panels("PROPERTIES")  # the search folds what is above, and slows each step of the pointer down
    yield from user.find("detp.bake", below.y + below.height // 2, "PROPERTIES")
    yield from picture("render_properties")


def try_default_cube():
    """One click, and the cube is lit; the time is told, not asserted, since machines differ."""
    yield from open_file()
    yield from user.show_sidebar("Light Bake")
    x, y = yield from user.find("detp.bake")
    yield from user.click(x, y)
    start = time.monotonic()
    yield from user.wait_for(lambda: session().latest() is not None and over(), 20)
    print(f"The default cube took {time.monotonic() - start:.1f} s after the click", flush=True)
    yield from finished_bake()
    light = light_of("Cube")
    assert light.min() > 0 and light.max() > 2 * light.min(), light
    yield from picture("default_cube")


def try_samples():
    """Each opens in its camera, with a button that works."""
    for path in sorted((ROOT / "sample_blends").glob("*.blend")):
        yield from open_file(path)
        assert user.area().spaces[0].region_3d.view_perspective == "CAMERA", path
        yield from user.show_sidebar("Light Bake")
        assert bpy.ops.detp.bake.poll() and baked() == 0, path
        yield from picture(f"sample_{path.stem}")


def try_nothing_to_bake():
    """A grey button with its reason; and a sentence where there is no light."""
    yield from open_file()
    yield from user.show_sidebar("Light Bake")
    for obj in bpy.context.view_layer.objects:
        obj.select_set(False)
    yield from user.choose("detp.targets", "s")
    assert bpy.context.scene.detp.targets == "SELECTED"
    yield from user.press("detp.bake")
    yield 0.5
    assert session().latest() is None
    yield from picture("nothing_selected")
    yield from user.choose("detp.targets", "v")
    bpy.data.objects.remove(bpy.data.objects["Light"])
    bpy.context.scene.world = None
    yield from user.press("detp.bake")
    yield from user.wait_for(lambda: session().latest() is not None and over(), 5)
    yield 0.5
    assert outcome().status == "FAILED" and "light" in outcome().message, outcome()
    assert baked() == 0
    yield from picture("no_light")


def try_progress():
    """The bar only grows, the time left is known from the start, and a bake of a given time keeps to it roughly."""
    yield from open_scene()
    settings, seen, left = bpy.context.scene.detp, [], []
    settings.quality, settings.seconds = "TIME", 8.0
    yield from user.press("detp.bake")
    yield from user.wait_for(lambda: session().latest() is not None, 5)
    while not over():
        seen.append(session().latest().fraction)
        left.append(session().latest().remaining)
        yield 0.1
    assert seen == sorted(seen) and len(set(seen)) > 4, seen
    assert left[0] is not None and left[0] <= settings.seconds, left
    yield from finished_bake()
    assert outcome().report.seconds["total"] > 0.5 * settings.seconds


def try_stop_and_keep():
    """The light so far is kept; one Ctrl-Z takes it back."""
    yield from open_scene()
    height = yield from start_a_bake()
    yield from user.press("detp.stop", height + 10, across=0.3)
    yield from finished_bake()
    assert any("stopped" in warning for warning in outcome().report.warnings)
    assert outcome().report.photons < MANY and baked() > 0
    yield from picture("kept")
    yield from user.key("Z", ctrl=True)
    yield from user.wait_for(lambda: baked() == 0, 5)


def try_worse_light():
    """Stop and Keep asks before worse light replaces better: after Esc the bake goes on, Enter keeps what there is."""
    yield from open_scene()
    yield from whole_bake()
    for mesh in (mesh for mesh in bpy.data.meshes if "detp_bakes" in mesh):
        mesh["detp_bakes"]["light"]["irradiance"]["error"] = 1e-6  # as if it had been baked for hours
    height = yield from start_a_bake()
    for answer in ("ESC", "RET"):
        assert session().latest().worse
        yield from user.press("detp.stop", height + 10, across=0.3)
        yield 0.5
        assert baking()
        yield from picture("worse_light")
        yield from user.key(answer)
        yield 0.5
        assert baking() or answer == "RET"
    yield from finished_bake()
    assert any("stopped" in warning for warning in outcome().report.warnings)


def try_settings():
    """Quality, objects and attribute, chosen by clicks, are those of the bake."""
    yield from open_scene()
    settings = bpy.context.scene.detp
    yield from user.choose("detp.quality", "d")
    yield from user.choose("detp.targets", "s")
    yield from user.enter("detp.attribute", "lamps")
    assert (settings.quality, settings.targets, settings.attribute) == ("DRAFT", "SELECTED", "lamps")
    yield from select("Short block")
    yield from user.press("detp.bake")
    yield from finished_bake()
    assert baked() == 1 and light_of("Short block").any()
    assert "irradiance" not in bpy.data.objects["Short block"].data.attributes
    yield from picture("settings")


def try_move_and_bake_again():
    """The light follows; no layer is left over."""
    yield from open_scene()
    yield from whole_bake()
    before, layers = light_of("Floor"), names_of_layers()
    yield from picture("before_the_move")
    yield from select("Tall block")
    yield from user.press_key("G")
    yield 0.1
    yield from user.press_key("X")
    yield from user.write("0.1")
    yield from whole_bake()
    assert names_of_layers() == layers
    changed = np.abs(light_of("Floor") - before).max(axis=1) > 0.1 * before.max()
    assert 0.01 < changed.mean() < 0.9, changed.mean()
    yield from picture("after_the_move")


def try_save_and_reopen():
    """A saved file has its light, and a button that shows it."""
    yield from open_scene()
    yield from whole_bake()
    count, light = baked(), light_of("Floor")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "baked.blend")
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        yield from open_file(path)
    yield from user.show_sidebar("Light Bake")
    assert baked() == count and np.array_equal(light_of("Floor"), light)
    if shading() == LIT:
        yield from user.press("detp.show")
        yield from user.wait_for(lambda: shading() != LIT, 5)
    yield from user.press("detp.show")
    yield from user.wait_for(lambda: shading() == LIT, 5)
    yield from picture("reopened")


def try_use_and_export():
    """The light goes into the materials by one click, a default export carries it, and one Ctrl-Z takes it out."""
    yield from open_scene()
    yield from whole_bake()
    yield from user.press("detp.use_in_material")
    yield 0.5
    assert using(), "no material uses the light"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "baked.glb")
        bpy.ops.export_scene.gltf(filepath=str(path))
        exported = Glb(path)
    for obj in (obj for obj in bpy.context.scene.objects if obj.type == "MESH" and obj.name != LAMP):
        _, values = exported.corners(obj.name, "COLOR_0")
        assert np.isin(np.round(values[:, :3], 5), np.round(light_of(obj.name), 5)).all(), obj.name
    yield 3.0  # Blender compiles shaders meanwhile
    yield from picture("used")
    yield from user.key("Z", ctrl=True)
    yield from user.wait_for(lambda: not using() and baked() > 0, 5)


def names_of_layers():
    return {mesh.name: sorted(layer.name for layer in mesh.color_attributes) for mesh in bpy.data.meshes}


def select(name):
    """Click an object in the 3D View."""
    view = user.area()
    region = next(region for region in view.regions if region.type == "WINDOW")
    obj = bpy.data.objects[name]
    middle = obj.matrix_world @ Vector(np.mean(obj.bound_box, axis=0))
    x, y = location_3d_to_region_2d(region, view.spaces[0].region_3d, middle)
    yield from user.click(region.x + x, region.y + y)
    assert [each.name for each in bpy.context.selected_objects] == [name]
