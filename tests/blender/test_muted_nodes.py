"""Muted nodes, empty reroutes and sockets of other types on the way hand on what they do in this Blender's Cycles."""

from itertools import product

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from beside_cycles import emitted  # noqa: E402
from made_scenes import constant, lamp, linked, material, mesh, node, quad, read, with_nodes  # noqa: E402

COLOUR = (0.9, 0.5, 0.2, 1)


pytestmark = pytest.mark.usefixtures("scene")


def rgb(tree):
    return constant(tree, COLOUR[:3])


def set_number(tree):
    return constant(tree, 1.7)


def muted(made, output=0):
    made.mute = True
    return made.outputs[output]


def through(tree, kind, source, result="NodeSocketColor"):
    """What ``source`` becomes through the input of a group, of that ``kind``, and its output."""
    group = bpy.data.node_groups.new("group", "ShaderNodeTree")
    group.interface.new_socket("Result", in_out="OUTPUT", socket_type=result)
    group.interface.new_socket("Given", in_out="INPUT", socket_type=kind)
    group.links.new(group.nodes.new("NodeGroupInput").outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    holder = tree.nodes.new("ShaderNodeGroup")
    holder.node_tree = group
    tree.links.new(source, holder.inputs[0])
    return holder


def gradient(tree):
    """A gradient whose coordinates come from a group's input to which nothing is linked."""
    group = bpy.data.node_groups.new("group", "ShaderNodeTree")
    group.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Vector", in_out="INPUT", socket_type="NodeSocketVector")
    pattern = node(group, "ShaderNodeTexGradient", Vector=group.nodes.new("NodeGroupInput").outputs[0])
    group.links.new(pattern.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    holder = tree.nodes.new("ShaderNodeGroup")
    holder.node_tree = group
    return holder.outputs[0]


def muted_inside(tree):
    holder = through(tree, "NodeSocketColor", rgb(tree))
    holder.node_tree.nodes["Group Output"].mute = True
    return holder.outputs[0]


#: what decides the colour of an Emission shader that itself is set to blue
FEEDS = {
    "muted, linked": lambda tree: muted(node(tree, "ShaderNodeInvert", Color=rgb(tree))),
    "muted, with a value": lambda tree: muted(node(tree, "ShaderNodeInvert", Color=COLOUR)),
    "muted, of another type": lambda tree: muted(node(tree, "ShaderNodeSeparateColor", Color=rgb(tree))),
    "muted, without a way through": lambda tree: muted(tree.nodes.new("ShaderNodeRGB")),
    "muted group": lambda tree: muted(through(tree, "NodeSocketColor", rgb(tree))),
    "muted behind a muted one": lambda tree: muted(
        node(tree, "ShaderNodeInvert", Color=muted(tree.nodes.new("ShaderNodeTexNoise")))
    ),
    "muted output of a group": muted_inside,
    "empty reroute": lambda tree: tree.nodes.new("NodeReroute").outputs[0],
    "through a number": lambda tree: through(tree, "NodeSocketFloat", rgb(tree)).outputs[0],
    "through a whole number": lambda tree: through(tree, "NodeSocketInt", rgb(tree)).outputs[0],
    "coordinates of a group": gradient,
}


#: what gives a value that is no whole number
SOURCES = {
    "a set number": set_number,
    "a number": lambda tree: node(tree, "ShaderNodeMath", Value=1.2, Value_001=0.5).outputs[0],
    "a set colour": rgb,
    "a colour": lambda tree: node(tree, "ShaderNodeGamma", Color=(1.2, 2.6, 3.9, 1)).outputs[0],
    "a vector": lambda tree: node(tree, "ShaderNodeCombineXYZ", X=1.2, Y=2.6, Z=3.9).outputs[0],
}
SOCKETS = [f"NodeSocket{kind}" for kind in ("Float", "Int", "Color", "Vector")]


def converted(tree, source, kinds):
    """A number that comes from a ``source`` through sockets of groups of these ``kinds``."""
    last = SOURCES[source](tree)
    for kind in kinds:
        last = through(tree, kind, last, kind).outputs[0]
    return node(tree, "ShaderNodeMath", Value=last, Value_001=0.0).outputs[0]


CHAINS = {
    (source, *kinds): lambda tree, source=source, kinds=kinds: converted(tree, source, kinds)
    for source in SOURCES
    for kinds in product(SOCKETS, repeat=2)
}


@pytest.mark.parametrize("feeds", [FEEDS, CHAINS], ids=["nodes", "sockets"])
def test_what_is_on_the_way_hands_on_what_it_does_in_cycles(feeds):
    places = [(x, y, 0) for x in range(len(feeds) + 1) for y in (0, 1)]
    strip = linked("strip", mesh(places, [(2 * k, 2 * k + 2, 2 * k + 3) for k in range(len(feeds))]))
    for number, build in enumerate(feeds.values()):

        def glowing(tree, build=build):
            glow = node(tree, "ShaderNodeEmission", Color=(0, 0, 1, 1), Strength=1.0)
            tree.links.new(build(tree), glow.inputs["Color"])
            return glow

        strip.data.materials.append(material(glowing))
        strip.data.polygons[number].material_index = number
    found = read()
    assert not found.left_out and not found.warnings
    ours = dict(zip(feeds, found.scene.emission, strict=True))
    theirs = dict(zip(feeds, emitted(strip), strict=True))
    # Cycles bakes the corners, whose mean is that of a gradient and near that of steps.
    assert {key for key in feeds if not np.allclose(ours[key], theirs[key], atol=5e-3)} == set()


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="Blender does not mute outputs since 5.0")
def test_muted_outputs_show_nothing(scene):
    def muted_output(owner, shader, output):
        tree = with_nodes(owner)
        made = node(tree, output, Surface=tree.nodes.new(shader).outputs[0])
        made.mute = True

    flat = quad()
    flat.data.materials.append(bpy.data.materials.new("off"))
    muted_output(flat.data.materials[0], "ShaderNodeBsdfDiffuse", "ShaderNodeOutputMaterial")
    muted_output(scene.world, "ShaderNodeBackground", "ShaderNodeOutputWorld")
    for number, name in enumerate(("off", "on")):
        shining = lamp("POINT", name, location=(0, 0, 1 + number), energy=10.0)
    muted_output(bpy.data.lights["off"], "ShaderNodeEmission", "ShaderNodeOutputLight")
    found = read().scene
    assert not found.albedo.any()
    assert [light.position[2] for light in found.lights] == [shining.location.z]
