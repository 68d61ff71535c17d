"""A node group may hold the output node that Cycles uses."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from beside_cycles import emitted  # noqa: E402
from made_scenes import lamp, linked, mesh, node, quad, read, with_nodes  # noqa: E402

pytestmark = pytest.mark.usefixtures("scene")

RED, GREEN, BLUE = np.eye(3)


def shown(tree, colour, output="ShaderNodeOutputMaterial"):
    """An output node that shows the ``colour``; nothing is linked to it without one."""
    if colour is None:
        return tree.nodes.new(output)
    return node(tree, output, Surface=node(tree, "ShaderNodeEmission", Color=(*colour, 1)).outputs[0])


def group(tree, *parts):
    """A group node around what the ``parts`` make inside."""
    inside = bpy.data.node_groups.new("group", "ShaderNodeTree")
    for part in parts:
        part(inside)
    holder = tree.nodes.new("ShaderNodeGroup")
    holder.node_tree = inside
    return holder


def of(colour):
    return lambda tree: shown(tree, colour)


def within(*parts):
    return lambda tree: group(tree, *parts)


def switched_off(part):
    def muted(tree):
        part(tree).mute = True

    return muted


#: parts of a material
MADE = {
    "in a group": [within(of(RED))],
    "outside and then inside": [of(RED), within(of(GREEN))],
    "inside and then outside": [within(of(GREEN)), of(RED)],
    "nothing linked outside": [of(None), within(of(GREEN))],
    "nothing linked inside": [within(of(None)), of(RED)],
    "a muted group": [switched_off(within(of(GREEN)))],
    "a muted group beside another": [switched_off(within(of(GREEN))), within(of(BLUE))],
    "two groups": [within(of(GREEN)), within(of(BLUE))],
    "a group in a group": [within(within(of(BLUE)))],
    "both of a group and the group in it": [within(within(of(BLUE)), of(RED))],
    "another way around": [within(of(RED), within(of(BLUE)))],
}


def test_the_output_of_cycles_is_found_at_any_depth():
    corners = [(3 * k + x, y, 0) for k in range(len(MADE)) for x, y in ((0, 0), (1, 0), (0, 1))]
    strip = linked("strip", mesh(corners, np.arange(len(corners)).reshape(-1, 3).tolist()))
    for number, (name, parts) in enumerate(MADE.items()):
        strip.data.materials.append(bpy.data.materials.new(name))
        strip.data.polygons[number].material_index = number
        tree = with_nodes(strip.data.materials[number])
        for part in parts:
            part(tree)
    ours = dict(zip(MADE, read().scene.emission, strict=True))
    theirs = dict(zip(MADE, emitted(strip), strict=True))
    assert sum(light.any() for light in theirs.values()) > 8
    assert {name for name in MADE if not np.allclose(ours[name], theirs[name], atol=1e-3)} == set()


def test_lamps_and_worlds_and_displacement_in_groups(scene):
    flat = quad()
    flat.data.materials.append(bpy.data.materials.new("moved"))

    def displaced(tree):
        height = node(tree, "ShaderNodeDisplacement", Height=1.0).outputs[0]
        node(tree, "ShaderNodeOutputMaterial", Displacement=height)

    group(with_nodes(flat.data.materials[0]), displaced)
    shining = lamp("POINT", "shining", location=(0, 0, 1), energy=10.0)
    group(with_nodes(shining.data), lambda tree: shown(tree, RED, "ShaderNodeOutputLight"))
    group(with_nodes(scene.world), lambda tree: shown(tree, BLUE, "ShaderNodeOutputWorld"))
    found = read()
    assert found.left_out == ("displacement of 1 material (moved)",)
    assert [light.power.round(3).tolist() for light in found.scene.lights[:1]] == [[10, 0, 0]]
    np.testing.assert_allclose(found.scene.lights[1].radiance, BLUE)
