"""Sentences that name the cause: nothing to bake, no light, only darkness."""

import math

import bpy
import numpy as np
import pytest
from detp.detp_addon.command.command import main
from scene_table import emptied
from small_scenes import colours, cube, grid, lamp, opened, saved

NAN = float("nan")


@pytest.fixture(autouse=True)
def _floor_and_lamp():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    grid("Floor")
    lamp()


def said(tmp_path, capsys, status, *more):
    path = saved(tmp_path / "scene.blend")
    capsys.readouterr()
    assert (
        main(["bake", str(path), "--photons", "5000", "--radius", "0.3", "-o", str(tmp_path / "out.blend"), *more])
        == status
    )
    printed = capsys.readouterr()
    if status == 0:
        return "\n".join(line for line in printed.out.splitlines() if line.startswith("Warning"))
    (line,) = printed.err.splitlines()
    return line.removeprefix(f"{path}: ")


def floor():
    return bpy.data.objects["Floor"]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda: setattr(floor(), "scale", (0, 0, 0)), "1 object scaled to nothing (Floor)"),
        (lambda: setattr(floor(), "scale", (1, 0, 1)), "1 object scaled to nothing (Floor)"),
        (lambda: setattr(floor(), "location", (NAN, 0, 0)), "1 object at a place that is not a number (Floor)"),
        (lambda: setattr(floor(), "hide_render", True), "1 object hidden from renders (Floor)"),
        (lambda: floor().data.clear_geometry(), "1 object without faces (Floor)"),
        (
            lambda: floor().data.vertices.foreach_set("co", [NAN] * 3 * len(floor().data.vertices)),
            "1 object with vertices that are not numbers (Floor)",
        ),
    ],
)
def test_what_leaves_no_face_is_named(tmp_path, capsys, spoil, words):
    spoil()
    assert said(tmp_path, capsys, 1) == f"There is nothing to bake: {words}."


def test_several_causes_are_told_apart(tmp_path, capsys):
    for name in ("A", "B", "C", "D"):
        cube(name).scale = (0, 0, 0)
    floor().hide_render = True
    words = said(tmp_path, capsys, 1)
    assert "1 object hidden from renders (Floor), 4 objects scaled to nothing (A, B, C, ...)" in words


def test_a_flat_object_has_faces(tmp_path, capsys):
    floor().scale = (1, 1, 0)
    said(tmp_path, capsys, 0)


@pytest.mark.parametrize("strength", [NAN, math.inf, -math.inf])
def test_a_lamp_whose_strength_is_not_a_number_is_named(tmp_path, capsys, strength):
    bpy.data.lights["Lamp"].energy = strength
    words = said(tmp_path, capsys, 1)
    assert words.startswith("Nothing in the scene gives light: lights whose strength is not a number are left out")
    assert "(Lamp)" in words


def test_a_lamp_at_no_place_and_one_hidden_and_one_of_no_strength(tmp_path, capsys):
    bpy.data.objects["Lamp"].location = (NAN, 0, 0)
    assert "lights whose place is not a number are left out: 1 light (Lamp)" in said(tmp_path, capsys, 1)
    bpy.data.objects["Lamp"].location = (0, 0, 1)
    bpy.data.objects["Lamp"].hide_render = True
    assert "1 light hidden from renders (Lamp)" in said(tmp_path, capsys, 1)
    bpy.data.objects["Lamp"].hide_render = False
    bpy.data.lights["Lamp"].energy = 0
    assert "1 light of no strength (Lamp)" in said(tmp_path, capsys, 1)


def test_nodes_whose_work_is_not_known_are_named_where_the_light_is_missing(tmp_path, capsys):
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    material = bpy.data.materials.new("glow")
    nodes, links = emptied(material).nodes, material.node_tree.links
    shader = nodes.new("ShaderNodeEmission")
    shader.inputs["Strength"].default_value = 0
    links.new(nodes.new("ShaderNodeLightPath").outputs["Ray Length"], shader.inputs["Strength"])
    links.new(shader.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    cube("Glow", (0, 0, 1)).data.materials.append(material)
    words = said(tmp_path, capsys, 1)
    assert words == (
        "Nothing in the scene gives light: a plain value takes the place of Light Path in 1 material (glow)."
    )


def test_what_shines_but_is_hidden_from_diffuse_light_is_named_where_the_light_is_missing(tmp_path, capsys):
    bpy.data.objects["Lamp"].visible_diffuse = False
    assert said(tmp_path, capsys, 1) == (
        "Nothing in the scene gives light: 1 object (Lamp), hidden from diffuse light."
    )


def driven(block, path, expression, index=-1):
    driver = block.driver_add(path, index).driver
    driver.type, driver.expression = "SCRIPTED", expression


def test_scripts_that_were_not_run_are_named_where_the_light_is_missing(tmp_path, capsys):
    driven(bpy.data.lights["Lamp"], "energy", "__import__('math').pi")
    bpy.data.lights["Lamp"].energy = 0
    words = said(tmp_path, capsys, 1)
    assert "scripts in the file were not run (Driver '__import__('math').pi')" in words and "allow them" in words


def test_scripts_that_were_not_run_are_named_where_it_is_dark(tmp_path, capsys):
    driven(bpy.data.objects["Lamp"], "location", "__import__('math').pi", 2)
    bpy.data.objects["Lamp"].location[2] = -3
    assert "All that was baked is dark: scripts in the file were not run" in said(tmp_path, capsys, 0)


def test_a_lamp_behind_the_floor_is_still_told_as_such(tmp_path, capsys):
    bpy.data.objects["Lamp"].location[2] = -3
    assert "normals that point away" in said(tmp_path, capsys, 0)


@pytest.mark.parametrize(
    ("height", "where"), [(0.0, "in the plane of a face"), (-1e-5, "0.01 mm behind a face"), (-1e-2, "10 mm behind")]
)
def test_a_lamp_that_has_sunk_into_a_face_is_named(tmp_path, capsys, height, where):
    bpy.data.objects["Lamp"].location = (0.1, 0.05, height)
    words = said(tmp_path, capsys, 0)
    assert f"All that was baked is dark: the light 'Lamp' lies {where}" in words and "normals" not in words


@pytest.mark.parametrize(("height", "stray"), [(1e-5, None), (3.0, 1e5)])
def test_a_lamp_just_above_a_face_and_one_beside_a_stray_object_light_it(tmp_path, capsys, height, stray):
    """E / pi is P h / 4 pi^2 r^3, as Blender lights with a power P of 100 W."""
    bpy.data.objects["Lamp"].location = (0.1, 0.05, height)
    bpy.data.lights["Lamp"].shadow_soft_size = 0
    if stray:
        cube("Stray", location=(stray, 0, 0))
    assert "dark" not in said(tmp_path, capsys, 0, "--fit", "vertices")
    opened(tmp_path / "out.blend")
    places = np.array([corner.co for corner in floor().data.vertices])
    distances = np.linalg.norm(places - (0.1, 0.05, height), axis=1)
    rows = [loop.vertex_index for loop in floor().data.loops]
    expected = 100 / (4 * np.pi**2) * height / distances**3
    np.testing.assert_allclose(colours("Floor")[:, 0], expected[rows], rtol=0.01)


def test_an_object_astray_is_named_if_it_makes_all_dark(tmp_path, capsys):
    cube("Stray", location=(1e9, 0, 0))
    words = said(tmp_path, capsys, 0)
    if "dark" in words or "No light met" in words:
        assert "'Stray' reaches 1000000 km away" in words


def test_faces_that_point_away_from_all_light_are_named(tmp_path, capsys):
    """A box turned inside out on a lit floor; one that is dark on both sides, in it, is none of those."""
    cube("Inside out", (0, 0, 0.7), 1.0)
    bpy.context.object.data.flip_normals()
    cube("Hidden", (0, 0, 0.7), 0.3)
    cube("Half", (1.2, 1.2, 0.5), 0.5)
    bpy.context.object.data.polygons[5].flip()
    words = said(tmp_path, capsys, 0)
    assert "1 object dark on the side that their faces point to, and lit from behind (Inside out)" in words
    assert "1 object with some faces that are dark in front and lit from behind (Half)" in words


def test_usual_scenes_have_no_word_of_turned_faces(tmp_path, capsys):
    cube("Box", (0, 0, 0.5), 1.0)
    assert "lit from behind" not in said(tmp_path, capsys, 0)
