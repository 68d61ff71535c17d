"""Several scenes and view layers in one file: those that are asked for are baked, the others are named."""

import json

import bpy
import numpy as np
import pytest
from detp.core.errors import SceneNotFoundError
from detp.detp_addon.chosen_views import ViewChoice, chosen_views, not_baked
from detp.detp_addon.command.command import main
from detp.detp_addon.preview import render_preview as preview
from made_scenes import fresh, lamp, linked, quad, world
from small_scenes import colours, opened, saved

QUICK = ["--error", "50%", "--indirect", "off", "--quiet"]


@pytest.fixture(autouse=True)
def layers():
    """The scene Day with a sun of 3 W/m2 and two view layers, Night with one of 1 W/m2 that both scenes' meshes
    see, and Notes, which has nothing to bake."""
    day = fresh()
    day.name, day.view_layers[0].name = "Day", "Rooms"
    world((0, 0, 0))
    quad("floor")
    lamp("SUN", "sun", energy=3.0)
    group = bpy.data.collections.new("shade")
    day.collection.children.link(group)
    quad("shade", size=6.0, location=(-2, -2, 1), collection=group)
    shaded = day.view_layers.new("Shaded")
    day.view_layers["Rooms"].layer_collection.children["shade"].exclude = True
    night = bpy.data.scenes.new("Night")
    moon = bpy.data.lights.new("moon", "SUN")
    moon.energy = 1.0
    linked("moon", moon, collection=night.collection)
    quad("ground", collection=night.collection)
    bpy.data.scenes.new("Notes")
    return day, shaded, night


def light(name):
    values = colours(name)[:, :3]
    assert np.ptp(values) < 1e-6
    return values[0, 0]


def baked(tmp_path, *arguments):
    path, report = saved(tmp_path / "scene.blend"), tmp_path / "report.json"
    assert main(["bake", str(path), *QUICK, *arguments, "--report", str(report)]) == 0
    opened(tmp_path / "scene_baked.blend")
    return json.loads(report.read_text())


def has_light(name):
    return "irradiance" in bpy.data.objects[name].data.attributes


def test_the_active_ones_are_baked_and_the_others_named(tmp_path):
    (entry,) = baked(tmp_path)
    assert light("floor") == pytest.approx(3 / np.pi) and not has_light("ground") and not has_light("shade")
    assert (entry["blender_scene"], entry["view_layer"]) == ("Day", "Rooms")
    (sentence,) = [warning for warning in entry["warnings"] if "Day" in warning]
    assert "'Rooms'" in sentence and "'Night'" in sentence and "'Shaded'" in sentence and "Notes" not in sentence


def test_a_view_layer_by_name(tmp_path):
    baked(tmp_path, "--view-layer", "Shaded")
    assert light("floor") == 0 and has_light("shade")


def test_a_scene_by_name(tmp_path):
    (entry,) = baked(tmp_path, "--scene", "Night")
    assert light("ground") == pytest.approx(1 / np.pi) and not has_light("floor")
    assert bpy.context.scene.name == "Day"
    assert any("'Day'" in warning for warning in entry["warnings"])


def test_all_scenes(tmp_path, monkeypatch):
    monkeypatch.setattr(preview, "WIDTH", 64)
    monkeypatch.setattr(preview, "HEIGHT", 36)
    first, second = baked(tmp_path, "--all-scenes", "--preview", str(tmp_path / "p.png"))
    assert light("floor") == pytest.approx(3 / np.pi) and light("ground") == pytest.approx(1 / np.pi)
    assert (first["blender_scene"], second["blender_scene"]) == ("Day", "Night")
    assert any("'Shaded'" in warning for warning in first["warnings"])
    assert not any("Night" in warning for entry in (first, second) for warning in entry["warnings"])
    assert {path.name for path in tmp_path.glob("*.png")} == {"p_Day.png", "p_Night.png"}


def test_objects_of_several_scenes_are_named_and_others_found_where_they_are(tmp_path, layers):
    layers[2].collection.objects.link(bpy.data.objects["floor"])
    first, _ = baked(tmp_path, "--all-scenes")
    assert any("'floor'" in warning and "last scene" in warning for warning in first["warnings"])
    assert light("floor") == pytest.approx(1 / np.pi)
    first, second = baked(tmp_path, "--all-scenes", "--objects", "ground", "floor")
    assert (first["objects"], second["objects"]) == (1, 2)


def test_a_background_set_is_a_part_of_the_scene(tmp_path, layers):
    """It is not named as left out; and of its objects it is said whose light they have in the end."""
    bpy.context.scene.background_set = layers[2]
    (only,) = baked(tmp_path)
    assert not any("Night" in warning for warning in only["warnings"])
    first, _ = baked(tmp_path, "--all-scenes")
    assert any("'ground'" in warning and "last scene" in warning for warning in first["warnings"])


def test_a_scene_that_cannot_be_baked_does_not_stop_the_others(tmp_path):
    bare = bpy.data.scenes.new("Bare")
    linked("edge", bpy.data.meshes.new("edge"), collection=bare.collection)
    first, _ = baked(tmp_path, "--all-scenes")
    assert any("'Bare' was not baked" in warning for warning in first["warnings"])


@pytest.mark.parametrize("arguments, words", [
    (["--scene", "night"], "No scene is named 'night' in the file: did you mean 'Night'?"),
    (["--view-layer", "Room"], "No view layer is named 'Room' in the scene 'Day': did you mean 'Rooms'?"),
])  # fmt: skip
def test_names_that_do_not_exist_are_said(tmp_path, capsys, arguments, words):
    path = saved(tmp_path / "scene.blend")
    assert main(["bake", str(path), *QUICK, *arguments]) == 1
    assert capsys.readouterr().err == f"{path}: {words}\n"
    assert not (tmp_path / "scene_baked.blend").exists()


def test_every_scene_and_one_by_name_exclude_each_other(capsys):
    assert main(["bake", "any.blend", "--all-scenes", "--scene", "Day"]) == 2
    assert "--all-scenes" in capsys.readouterr().err


def test_the_layer_of_a_scene_that_no_window_shows_is_the_first_that_renders(layers):
    day, shaded, night = layers
    assert chosen_views(ViewChoice(scene="Day")) == [(day, day.view_layers["Rooms"])]
    bpy.context.window.scene = night
    day.view_layers["Rooms"].use = False
    assert chosen_views(ViewChoice(scene="Day")) == [(day, shaded)]
    with pytest.raises(SceneNotFoundError):
        chosen_views(ViewChoice(view_layer="Rooms"))


def test_one_scene_with_one_view_layer_needs_no_word(layers):
    day, shaded, night = layers
    day.view_layers.remove(shaded)
    bpy.data.scenes.remove(night)
    assert not_baked(day, day.view_layers[0]) == []
