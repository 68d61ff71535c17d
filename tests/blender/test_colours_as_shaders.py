"""Colours and numbers linked where a shader belongs are given off, as in Cycles: in materials, worlds and lamps."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from beside_cycles import beside_cycles, worst  # noqa: E402
from made_scenes import constant, diffuse, image, lamp, map_to_unit_square, node, quad, read, with_nodes  # noqa: E402

COLOUR = np.array([0.5, 0.25, 0.1])


def rgb(tree, colour=COLOUR):
    return constant(tree, colour)


def number(tree):
    return constant(tree, 2.0)


def mixed(tree):
    clear = tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0]
    return node(tree, "ShaderNodeMixShader", Fac=0.25, Shader=rgb(tree), Shader_001=clear).outputs[0]


def added(tree):
    glow = node(tree, "ShaderNodeEmission", Color=(*COLOUR, 1), Strength=1.0).outputs[0]
    return node(tree, "ShaderNodeAddShader", Shader=rgb(tree), Shader_001=glow).outputs[0]


def grouped(kind, how):
    """A group whose output, of a ``kind``, is the colour that its input is set to, or one of its own."""

    def build(tree):
        group = bpy.data.node_groups.new("group", "ShaderNodeTree")
        group.interface.new_socket("Result", in_out="OUTPUT", socket_type=kind)
        group.interface.new_socket("Colour", in_out="INPUT", socket_type="NodeSocketColor")
        output = group.nodes.new("NodeGroupOutput")
        if how == "passed on":
            group.links.new(group.nodes.new("NodeGroupInput").outputs[0], output.inputs[0])
        else:
            output.inputs[0].default_value = (*COLOUR, 1)
        holder = tree.nodes.new("ShaderNodeGroup")
        holder.node_tree = group
        holder.inputs[0].default_value = (*COLOUR, 1)
        return holder.outputs[0]

    return build


#: what to link, and the radiance that Cycles gives it: looked at beside an Emission shader of the same colour
FEEDS = {
    "colour": (rgb, COLOUR),
    "number": (number, 2.0),
    "vector": (lambda tree: node(tree, "ShaderNodeCombineXYZ", X=0.5, Y=0.25, Z=0.1).outputs[0], COLOUR),
    "mixed": (mixed, 0.75 * COLOUR),
    "added": (added, 2 * COLOUR),
    "through a shader socket": (grouped("NodeSocketShader", "passed on"), COLOUR),
    "through a colour socket": (grouped("NodeSocketColor", "passed on"), COLOUR),
    "set in the group": (grouped("NodeSocketColor", "set"), COLOUR),
    "black": (lambda tree: rgb(tree, (0, 0, 0)), 0.0),
}


pytestmark = pytest.mark.usefixtures("dark_scene")


def fed(owner, output, build):
    tree = with_nodes(owner)
    tree.links.new(build(tree), tree.nodes.new(output).inputs["Surface"])
    return owner


@pytest.mark.parametrize("name", FEEDS)
def test_materials(name):
    build, radiance = FEEDS[name]
    quad().data.materials.append(fed(bpy.data.materials.new("glow"), "ShaderNodeOutputMaterial", build))
    scene = read().scene
    assert np.allclose(scene.emission, radiance) and not scene.albedo.any()


@pytest.mark.parametrize("name", FEEDS)
def test_worlds(scene, name):
    build, radiance = FEEDS[name]
    scene.world = fed(bpy.data.worlds.new("glow"), "ShaderNodeOutputWorld", build)
    quad()
    lights = read().scene.lights
    assert np.allclose(lights[0].radiance if lights else 0.0, radiance)


@pytest.mark.parametrize("name", FEEDS)
def test_lamps(name):
    build, radiance = FEEDS[name]
    made = lamp("POINT", energy=10.0)
    fed(made.data, "ShaderNodeOutputLight", build)
    quad()
    lights = read().scene.lights
    assert np.allclose(lights[0].power if lights else 0.0, 10.0 * np.asarray(radiance))


def test_an_image_shines():
    pixels = np.ones((8, 8, 4))
    pixels[:, :4, :3] = (0.5, 0.0, 0.25)
    obj = quad()
    map_to_unit_square(obj)
    picture = image(pixels, colour_space="Non-Color")
    obj.data.materials.append(
        fed(bpy.data.materials.new("poster"), "ShaderNodeOutputMaterial",
            lambda tree: node(tree, "ShaderNodeTexImage", {"image": picture}).outputs["Color"])
    )  # fmt: skip
    scene = read().scene
    assert np.allclose(scene.emission.mean(axis=0), (0.75, 0.5, 0.625), atol=2e-3) and not scene.albedo.any()


def test_a_floor_between_black_and_glowing_walls_agrees_with_cycles(scene):
    """E / pi at the corners of a floor whose walls, one black and one of a colour, are made so: as Cycles bakes it."""
    floor = quad("floor")
    floor.data.materials.append(diffuse((0.8, 0.8, 0.8)))
    for x, colour in ((-0.2, COLOUR), (1.2, (0, 0, 0))):
        wall = quad("wall", size=2.0, location=(x, -0.5, 0))
        wall.rotation_euler = (0, -np.pi / 2, 0)
        wall.data.materials.append(
            fed(
                bpy.data.materials.new("wall"),
                "ShaderNodeOutputMaterial",
                lambda tree, colour=colour: rgb(tree, colour),
            )
        )
    ours, theirs, noise = beside_cycles(floor)
    # Of 12 values with six seeds a side one lies beyond six such errors by chance in a thousand tests.
    assert worst(ours, theirs, noise) < 6
    assert theirs.max() > 20 * noise.max()
