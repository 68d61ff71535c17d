"""Animations of light: each key frame is its still bake, frames between are blends, and nothing else changes."""

import json
from dataclasses import replace

import bpy
import numpy as np
import pytest
from detp.core.errors import InvalidSettingError
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.detp_addon.animation.bake_animation import bake_animation
from detp.detp_addon.animation.frames import Frames
from detp.detp_addon.animation.moving import MOVING, is_moving
from detp.detp_addon.animation.playback import played_frames, stored_keys
from detp.detp_addon.command.command import main
from detp.detp_addon.panel import session
from detp.detp_addon.reading.read_scene import read_scene
from detp.detp_addon.request import BakeRequest
from glb import Glb
from made_scenes import node, with_nodes
from small_scenes import colours, cube, grid, lamp, opened, saved

KEYS = (1, 4, 6)
OPTIONS = {"photons": 2000, "fit": "VERTICES", "seed": 3}
QUICK = BakeRequest(BakeSettings(photons=2000), fit="vertices")
FRAMES = {"own_range": True, "first": 1, "last": 6, "every": 3}


def keyed(owner, path, values):
    for frame, value in values.items():
        setattr(owner, path, value)
        owner.keyframe_insert(path, frame=frame)


def moving_scene():
    """A floor, a box that moves over it, and a lamp that grows weaker."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    grid("Floor")
    keyed(cube("Box"), "location", {1: (-1, 0, 0.5), 6: (1, 0, 0.5)})
    lamp()
    keyed(bpy.data.lights["Lamp"], "energy", {1: 100.0, 6: 30.0})
    bpy.context.scene.frame_set(2)
    return bpy.context.scene


@pytest.fixture
def scene(addon):
    return moving_scene()


def bake(**options):
    return bpy.ops.detp.bake_animation(**{**OPTIONS, **FRAMES, **options})


def shown(name, frame, subframe=0.0, attribute="irradiance"):
    """The colours of an object as it plays."""
    bpy.context.scene.frame_set(frame, subframe=subframe)
    mesh = bpy.data.objects[name].evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    layer = mesh.attributes[attribute]
    assert (mesh.attributes.active_color_name, mesh.attributes.default_color_name) == (attribute, attribute)
    values = np.empty((len(layer.data), 4), np.float32)
    layer.data.foreach_get("color", values.ravel())
    return values[:, :3]


def state():
    """All that an animation could leave behind."""
    meshes = {mesh.name: (sorted(mesh.attributes.keys()), sorted(mesh.keys())) for mesh in bpy.data.meshes}
    modifiers = {obj.name: [each.name for each in obj.modifiers] for obj in bpy.data.objects}
    kinds = ("scenes", "objects", "meshes", "cameras", "images", "node_groups")
    counts = {kind: len(getattr(bpy.data, kind)) for kind in kinds}
    return meshes, modifiers, counts, bpy.context.scene.frame_current


def test_key_frames_are_every_so_many_and_the_last():
    assert Frames(1, 6, 3).keys == KEYS and Frames(-2, 2, 2).keys == (-2, 0, 2) and Frames(1, 3, 9).keys == (1, 3)
    for wrong in ((5, 5), (6, 1), (1, 9, 0)):
        with pytest.raises(InvalidSettingError):
            Frames(*wrong)


def test_key_frames_are_their_still_bakes_and_between_them_light_is_blended(scene, tmp_path):
    assert bake(whole=True) == {"FINISHED"} and scene.frame_current == 2
    played = {name: [shown(name, frame) for frame in KEYS] for name in ("Floor", "Box")}
    assert not np.allclose(played["Floor"][0], played["Floor"][2], rtol=0.05)
    for name, (first, middle, last) in played.items():
        assert np.allclose(shown(name, 2, 0.5), 0.5 * (first + middle), rtol=1e-5)
        assert np.allclose(shown(name, 5), 0.5 * (middle + last), rtol=1e-5)
        assert np.array_equal(shown(name, -3), first) and np.array_equal(shown(name, 60), last)
        assert np.array_equal(colours(name)[:, :3], first)
    opened(saved(tmp_path / "animated.blend"))
    for name, keys in played.items():
        for frame, light in zip(KEYS, keys, strict=True):
            assert np.array_equal(shown(name, frame), light)
    moving_scene()
    for number, frame in enumerate(KEYS):
        bpy.context.scene.frame_set(frame)
        bpy.ops.detp.bake(**OPTIONS)
        for name, keys in played.items():
            assert np.allclose(colours(name)[:, :3], keys[number], rtol=1e-5, atol=1e-7)


def test_frames_after_the_first_are_updates_of_it_with_the_light_of_whole_bakes(addon):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    grid("Floor")
    keyed(cube("Box", size=0.2), "location", {1: (-1.6, -1.6, 0.2), 6: (-1.0, -1.6, 0.2)})
    lamp()
    keys = {}
    for name, whole in (("updated", False), ("whole", True)):
        assert bake(attribute=name, whole=whole, quality="DRAFT", photons=0, fit="FACES", every=5) == {"FINISHED"}
        assert not any("as a whole" in warning for warning in session.latest().outcome.report.warnings)
        keys[name] = stored_keys(bpy.data.objects["Floor"].data, name).sum(axis=2)
    (first, updated), (still, whole) = keys["updated"], keys["whole"]
    assert np.array_equal(first, still) and not np.array_equal(updated, whole)
    assert np.allclose(updated, whole, rtol=0.03) and not np.allclose(first, whole, rtol=0.05)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (
            lambda: keyed(bpy.data.objects["Lamp"], "location", {1: (1, 0.5, 3), 6: (0, 0.5, 3)}),
            "the lights have changed",
        ),
        (lambda: None, "an update would take as long as a bake"),
    ],
)
def test_frames_that_are_no_updates_are_counted_and_a_sentence_says_why(change, reason, scene):
    change()
    bake()
    [said] = [warning for warning in session.latest().outcome.report.warnings if "as a whole" in warning]
    assert said.startswith("Of 3 frames ") and reason in said


def test_what_was_there_stays_and_one_button_removes_it(scene):
    box = bpy.data.objects["Box"]
    box.modifiers.new("Own", "SUBSURF")
    bpy.ops.detp.bake(**OPTIONS)
    before = state()
    bpy.ops.ed.undo_push(message="before")
    bake()
    assert [each.name for each in bpy.data.objects["Box"].modifiers][1:] == ["Own"]
    longer = state()
    bake(every=5)
    assert len(stored_keys(bpy.data.objects["Box"].data, "irradiance")) == 2
    assert "irradiance@2" not in bpy.data.objects["Box"].data.attributes and state()[2] == longer[2]
    bpy.ops.detp.bake(**OPTIONS)
    assert any("hides this bake" in warning for warning in session.latest().outcome.report.warnings)
    assert bpy.ops.detp.remove_animation() == {"FINISHED"}
    assert state() == before
    bake()
    twin = bpy.data.objects["Box"].copy()
    bpy.context.collection.objects.link(twin)
    assert bpy.ops.detp.remove_animation() == {"FINISHED"}
    bpy.data.objects.remove(twin)
    assert state() == before
    bake()
    bpy.ops.ed.undo_push(message="baked")
    bpy.ops.ed.undo()
    assert state() == before


def test_a_bake_that_is_given_up_leaves_everything_as_it_was(scene):
    before = state()
    layer = bpy.context.view_layer
    steps = bake_animation(scene, layer, QUICK, Frames(1, 6))
    while not next(steps).phase.startswith("Frame 2"):
        pass
    steps.close()
    assert state() == before
    taken = bpy.data.objects["Box"].data.attributes.new("irradiance@1", "FLOAT", "FACE")
    before = state()
    with pytest.raises(RuntimeError, match="'Box' already has an attribute named 'irradiance@1'"):
        bake()
    assert state() == before and taken.name == "irradiance@1"


def test_a_bake_that_is_stopped_keeps_the_frames_that_it_has(scene):
    steps = bake_animation(scene, bpy.context.view_layer, QUICK, Frames(1, 6, 2))
    report, wish = None, None
    while report is None:
        try:
            wish = steps.send(wish).phase.startswith("Frame 2") or None
        except StopIteration as end:
            report = end.value
    assert report.frames == (1, 3) and "at 2 frames from 1 to 3" in report.headline()
    assert played_frames(bpy.data.objects["Floor"].data, "irradiance") == Frames(1, 3, 2)


def test_only_what_moves_has_light_at_each_frame_where_that_is_asked(scene):
    child = cube("Child", (0, 1, 2), 0.2)
    child.parent = bpy.data.objects["Box"]
    marked = grid("Marked", (0, 0, -1))
    assert [is_moving(bpy.data.objects[name]) for name in ("Box", "Child", "Floor", "Marked")] == [1, 1, 0, 0]
    bpy.ops.object.select_all(action="DESELECT")
    marked.select_set(True)
    bpy.ops.detp.mark_moving(moving="YES")
    assert marked[MOVING] and is_moving(marked)
    bpy.ops.detp.mark_moving(moving="AUTO")
    assert not is_moving(marked)
    bake(moving_only=True)
    playing = {obj.name for obj in bpy.data.objects if obj.type == "MESH" and obj.modifiers}
    assert playing == {"Box", "Child"}
    assert colours("Floor")[:, :3].any() and "irradiance@0" not in bpy.data.objects["Floor"].data.attributes


def test_lamps_may_go_out_objects_hide_and_what_changes_its_faces_is_refused(scene):
    keyed(bpy.data.lights["Lamp"], "energy", {4: 0.0})
    array = cube("Row", (0, -1, 0.5), 0.3).modifiers.new("Array", "ARRAY")
    keyed(array, "count", {1: 2, 6: 5})
    keyed(bpy.data.objects["Box"], "hide_render", {1: False, 6: True})
    bake()
    assert any("faces of 'Row' change" in warning for warning in session.latest().outcome.report.warnings)
    assert "irradiance" not in bpy.data.objects["Row"].data.attributes
    first, out, last = stored_keys(bpy.data.objects["Floor"].data, "irradiance")
    assert first.any() and not out.any() and last.any()


def test_the_command_writes_a_texture_that_the_exported_mesh_points_into(tmp_path, capsys):
    moving_scene()
    source, baked, texture = saved(tmp_path / "scene.blend"), tmp_path / "out.blend", tmp_path / "light.exr"
    quick = ["--photons", "2000", "--fit", "vertices", "--frames", "1-6", "--every", "3", "--domain", "point"]
    assert main(["bake-animation", str(source), *quick, "--dry-run"]) == 0
    assert "for 3 frames" in capsys.readouterr().out and not baked.exists()
    arguments = ["bake-animation", str(source), "-o", str(baked), *quick, "--texture", str(texture)]
    assert main([*arguments, "--use-in-material", "--report", str(tmp_path / "report.json")]) == 0
    assert "at 3 frames from 1 to 6" in capsys.readouterr().out
    assert json.loads((tmp_path / "report.json").read_text())[0]["frames"] == list(KEYS)
    told = json.loads(texture.with_suffix(".json").read_text())
    opened(baked)
    image = bpy.data.images.load(str(texture))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.array(image.pixels[:], np.float32).reshape(told["height"], told["width"], 4)[::-1]
    for name, place in told["objects"].items():
        keys = stored_keys(bpy.data.objects[name].data, "irradiance")
        flat = pixels.reshape(len(KEYS), -1, 4)[:, place["first"] : place["first"] + place["count"], :3]
        assert np.array_equal(flat, keys)  # 32 bits, nothing lost
    glb = tmp_path / "out.glb"
    bpy.ops.export_scene.gltf(filepath=str(glb))
    read = Glb(glb)
    for mesh in read.json["meshes"]:
        [primitive] = mesh["primitives"]
        attributes = primitive["attributes"]
        [name] = [name for name, place in told["objects"].items() if place["mesh"] == mesh["name"]]
        u, v = read.array(attributes[f"TEXCOORD_{told['objects'][name]['texcoord']}"]).T
        row = np.floor(v * told["rows_per_frame"]).astype(int)
        light = pixels[row, np.floor(u * told["width"]).astype(int), :3]
        found = read.array(attributes["COLOR_0"])[:, :3] if "COLOR_0" in attributes else light
        assert np.allclose(found, light, atol=1e-5)  # 16 bits


@pytest.mark.parametrize("wrong", (["--frames", "6-1"], ["--frames", "x"], ["--frames", "1-6", "--every", "0"],
                                   ["--frames", "1-6", "--texture", "x.png"]))  # fmt: skip
def test_wrong_usage_is_said_without_blender(wrong, tmp_path, capsys):
    assert main(["bake-animation", str(tmp_path / "none.blend"), *wrong]) == 2
    assert capsys.readouterr().err


def test_frames_of_one_seed_differ_only_where_something_moves(scene):
    """So that noise does not flicker: without motion all key frames are the same, bit by bit."""
    bpy.data.objects["Box"].animation_data_clear()
    bpy.data.lights["Lamp"].animation_data_clear()
    request = replace(QUICK, domain="POINT")
    finished(bake_animation(scene, bpy.context.view_layer, request, Frames(1, 2)))
    one, other = stored_keys(bpy.data.objects["Floor"].data, "irradiance")
    assert np.array_equal(one, other)


def test_materials_and_skies_are_those_of_the_frame(scene):
    glow = bpy.data.materials.new("glow")
    tree = with_nodes(glow)
    shader = node(tree, "ShaderNodeEmission")
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    keyed(shader.inputs["Strength"], "default_value", {1: 1.0, 6: 3.0})
    bpy.data.objects["Box"].data.materials.append(glow)
    scene.world = bpy.data.worlds.new("world")
    tree = with_nodes(scene.world)
    sky = node(tree, "ShaderNodeBackground", Color=node(tree, "ShaderNodeTexCoord").outputs["Generated"])
    tree.links.new(sky.outputs[0], tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    keyed(sky.inputs["Strength"], "default_value", {1: 1.0, 6: 2.0})
    first, last = (read_scene(scene, bpy.context.view_layer, None, "CORNER", frame=frame).scene for frame in (1, 6))
    assert np.allclose(last.emission, 3.0 * first.emission) and first.emission.any()
    assert np.allclose(last.lights[-1].flux(last.bounds), 2.0 * first.lights[-1].flux(first.bounds), rtol=1e-3)


def test_a_scene_that_is_not_the_active_one_is_read_at_its_own_frame(scene):
    other = scene.copy()
    other.frame_current = 6
    export = read_scene(other, other.view_layers[0], None, "CORNER")
    assert export.scene.lights[0].flux(None).sum() == pytest.approx(3 * 30.0)
