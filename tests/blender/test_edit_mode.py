"""Objects in Edit Mode: a render shows them, so they shade and reflect; the command bakes them too."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

import bmesh  # noqa: E402
from detp.core.errors import EditModeError  # noqa: E402
from detp.detp_addon.command.command import main  # noqa: E402
from made_scenes import (  # noqa: E402
    diffuse,
    image,
    lamp,
    linked,
    map_to_unit_square,
    material,
    node,
    quad,
    read,
    world,
)
from small_scenes import colours, opened, saved  # noqa: E402

QUICK = ["--photons", "2000", "--error", "50%", "--quiet"]


pytestmark = pytest.mark.usefixtures("scene")


def edit(obj):
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")


def same_scene(first, second):
    return all(
        np.array_equal(getattr(first.scene, name), getattr(second.scene, name))
        for name in ("vertices", "triangles", "albedo", "emission", "transmittance")
    )


def test_a_mesh_in_edit_mode_is_read_as_out_of_it():
    quad("floor", location=(0, 0, -1))
    obj = quad("edited", size=2.0)
    map_to_unit_square(obj)
    picture = image(np.random.default_rng(1).random((8, 8, 4)))
    textured = material(
        lambda tree: node(tree, "ShaderNodeBsdfDiffuse",
                          Color=node(tree, "ShaderNodeTexImage", {"image": picture}).outputs["Color"])
    )  # fmt: skip
    for made in (diffuse((1, 0, 0)), textured):
        obj.data.materials.append(made)
    obj.data.polygons[0].material_index = 1
    repeat = obj.modifiers.new("array", "ARRAY")
    repeat.count, repeat.show_in_editmode = 3, True
    before = read()
    edit(obj)
    assert same_scene(before, read())


@pytest.mark.parametrize("kind", ["BYTE_COLOR", "FLOAT_COLOR"])
def test_paint_is_read_in_edit_mode(kind):
    quad("floor", location=(0, 0, -1))
    obj = quad("edited")
    layer = obj.data.color_attributes.new("Col", kind, "CORNER")
    layer.data.foreach_set("color", np.random.default_rng(1).random(16, np.float32))
    obj.data.attributes.default_color_name = "Col"
    obj.data.materials.append(
        material(lambda tree: node(tree, "ShaderNodeBsdfDiffuse",
                                   Color=node(tree, "ShaderNodeVertexColor", {"layer_name": ""}).outputs[0]))
    )  # fmt: skip
    before = read()
    [warning] = before.warnings
    assert warning.startswith("patterns on large faces") and 0 < before.scene.albedo[-1].max() < 1
    edit(obj)
    assert same_scene(before, read())


def test_edits_that_were_not_left_yet_are_read():
    quad("floor", location=(0, 0, -1))
    obj = quad("edited")
    edit(obj)
    for vertex in bmesh.from_edit_mesh(obj.data).verts:
        vertex.co.z = 5.0
    assert set(read().scene.vertices[:, 2]) == {-1.0, 5.0}


def test_the_other_users_of_an_edited_mesh_are_there_too():
    quad("floor", location=(0, 0, -1))
    obj = quad("edited")
    linked("twin", obj.data, (3, 0, 0))
    edit(obj)
    result = read()
    assert len(result.scene.triangles) == 6
    assert [target.object_name for target in result.targets] == ["floor"]
    assert any("Edit Mode" in warning and "2 objects" in warning for warning in result.warnings)


def test_when_all_that_could_be_baked_is_in_edit_mode_that_is_said():
    edit(quad("lonely"))
    with pytest.raises(EditModeError, match="'lonely'"):
        read()


def test_the_command_bakes_in_object_mode(tmp_path, capsys):
    """Direct light alone: below a shade of 6 m the floor gets nothing, above it E / pi = 3 / pi."""
    world((0, 0, 0))
    quad("floor", size=2.0)
    shade = quad("shade", size=6.0, location=(-2, -2, 1))
    lamp("SUN", energy=3.0, angle=0.0)
    edit(shade)
    path = saved(tmp_path / "scene.blend")
    assert main(["bake", str(path), *QUICK[:-1]]) == 0
    assert "saved in Edit Mode of 1 object (shade)" in capsys.readouterr().out
    opened(tmp_path / "scene_baked.blend")
    assert bpy.data.objects["shade"].mode == "OBJECT"
    assert (colours("floor")[:, :3] == 0).all()
    np.testing.assert_allclose(colours("shade")[:, :3], 3 / np.pi, rtol=1e-5)


def test_the_command_bakes_what_was_open_beside_the_active_object_and_in_other_scenes(tmp_path):
    obj = quad("alone")
    edit(obj)
    other = bpy.data.scenes.new("other")
    bpy.context.window.scene = other
    other.world = bpy.data.worlds[0]
    linked("second", obj.data)
    path = saved(tmp_path / "scene.blend")
    assert main(["bake", str(path), *QUICK]) == 0
    opened(tmp_path / "scene_baked.blend")
    np.testing.assert_allclose(colours("second")[:, :3], 0.5, rtol=1e-5)


@pytest.mark.parametrize("kind", ["curve", "text"])
def test_curves_in_edit_mode_are_there(kind):
    quad("floor", location=(0, 0, -1))
    data = bpy.data.curves.new(kind, {"curve": "CURVE", "text": "FONT"}[kind])
    if kind == "curve":
        data.dimensions, data.bevel_depth = "3D", 0.1
        data.splines.new("POLY").points.add(1)
        data.splines[0].points[1].co = (1, 0, 0, 1)
    else:
        data.body = "text"
    obj = linked(kind, data)
    before = read()
    edit(obj)
    assert same_scene(before, read())
