"""Files that work in ACEScg or Rec. 2020: colours of images, attributes and glowing bodies are as in Cycles."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

import scene_table  # noqa: E402
from beside_cycles import emitted  # noqa: E402
from detp.detp_addon.reading.working_space import from_rec709, luminance  # noqa: E402
from made_scenes import image  # noqa: E402
from test_every_node import unlike_cycles  # noqa: E402


def of_image(colour_space, is_float):
    def build(tree):
        node = tree.nodes.new("ShaderNodeTexImage")
        pixels = np.tile(np.float32((0.8, 0.4, 0.2, 1.0)), (4, 4, 1))
        node.image = image(pixels, colour_space, colour_space, is_float)
        return node.outputs["Color"]

    return build


def of_node(kind, **inputs):
    def build(tree):
        node = tree.nodes.new(f"ShaderNode{kind}")
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        return node.outputs[0]

    return build


SHADERS = {
    "bytes": of_image("sRGB", False),
    "data": of_image("Non-Color", False),
    "linear bytes": of_image("Linear Rec.709", False),
    "floats": of_image("Linear Rec.709", True),
    "glow": of_node("Blackbody", Temperature=2500.0),
    "ember": of_node("Blackbody", Temperature=900.0),
    "grey": of_node("RGBToBW", Color=(0.7, 0.2, 0.4, 1)),
    "colour": of_node("Gamma", Color=(0.7, 0.2, 0.4, 1), Gamma=1.0),
}


@pytest.mark.parametrize("space", ["Linear Rec.709", "ACEScg", "Linear Rec.2020"])
def test_colours_are_those_of_cycles(monkeypatch, space):
    if space != "Linear Rec.709" and not hasattr(bpy.data, "colorspace"):
        pytest.skip("this Blender works in Rec. 709 alone")

    def new_file():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        if hasattr(bpy.data, "colorspace"):
            bpy.ops.wm.set_working_color_space(convert_colors=False, working_space=space)

    monkeypatch.setattr(scene_table, "new_file", new_file)
    shaders = {name: lambda tree, build=build: scene_table.shining(tree, build) for name, build in SHADERS.items()}
    assert unlike_cycles(shaders) == {}
    assert luminance(from_rec709(np.ones((1, 3)))) == pytest.approx(1.0, abs=1e-3)


def showing(build):
    return lambda tree: scene_table.shining(tree, build)


@pytest.mark.parametrize("is_float", [False, True])
def test_images_in_any_colour_space_are_as_in_cycles_or_named(is_float):
    spaces = bpy.types.ColorManagedInputColorspaceSettings.bl_rna.properties["name"].enum_items.keys()
    spaces = [name for name in spaces if name != "Working Space"]
    assert len(spaces) > 20
    zoo = scene_table.Zoo.of([showing(of_image(name, is_float)) for name in spaces])
    result, _ = zoo.read()
    ours, theirs = result.scene.emission.reshape(-1, len(spaces), 3)[0], emitted(zoo.obj)
    unlike = {
        name
        for name, mine, other in zip(spaces, ours, theirs, strict=True)
        if not np.allclose(mine, other, rtol=5e-3, atol=2e-3)
    }
    named = {name for name in spaces if any(f"the space {name} are" in words for words in result.warnings)}
    assert unlike <= named and not {"sRGB", "Linear Rec.709", "Non-Color"} & named
    assert not is_float or not named
