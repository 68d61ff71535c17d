"""Nodes that bring baked light into one node tree, and their removal."""

from __future__ import annotations

import math
from functools import partial

import bpy

from ..reading.read_node_graph import feed_of, find_input
from .marked_nodes import NODE_MARK, before, marked, marked_nodes
from .surface_colours import Surface, UnknownSurfaceError, Value, diffuse_inputs, surface_of, value_of


def surface_outputs(tree: bpy.types.NodeTree) -> list[bpy.types.Node]:
    """The output nodes that an engine or the exporter of Blender looks at."""
    found = {tree.get_output_node(target) for target in ("ALL", "EEVEE", "CYCLES")}
    found |= {node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial" and node.is_active_output}
    return [node for node in found if node is not None and node.inputs["Surface"].is_linked]


def surface_inputs(tree: bpy.types.NodeTree) -> list[bpy.types.NodeSocket]:
    """The colour inputs of all diffuse shaders that these output nodes show, also of those inside node groups."""
    found = {}
    for output in surface_outputs(tree):
        for socket in diffuse_inputs(feed_of(output.inputs["Surface"], ())):
            found[socket.as_pointer()] = socket
    return list(found.values())


def make_unlit(tree, output, attribute: str, quantity: str) -> bool:
    """Show the camera what the light makes of the surface; False when that cannot be told, or it glows by itself."""

    surface_input = output.inputs["Surface"]
    try:
        surface = surface_of(feed_of(surface_input, ()), partial(_mixed, tree, "MIX"))
    except UnknownSurfaceError:
        surface = Surface(None)
    if quantity != "shaded" and (surface.colour is None or surface.glows):
        return False
    emission = marked(tree, "ShaderNodeEmission")
    emission.inputs["Strength"].default_value = 1.0 / math.pi if quantity == "irradiance" else 1.0
    # The exporter of Blender 4.2 finds an attribute only where it is multiplied by something.
    colour = (1.0, 1.0, 1.0, 1.0) if quantity == "shaded" else surface.colour
    light = _mixed(tree, "MULTIPLY", 1.0, _light(tree, attribute), colour)
    _put(light, emission.inputs["Color"])
    seen = marked(tree, "ShaderNodeMixShader", "Shader")
    _put(marked(tree, "ShaderNodeLightPath").outputs["Is Camera Ray"], find_input(seen, "Fac"))
    _put(value_of(surface_input), find_input(seen, "Shader"))
    _put(emission.outputs[0], find_input(seen, "Shader_001"))
    if surface.alpha != 1.0:
        open_part = marked(tree, "ShaderNodeMixShader", "Shader_001")
        _put(surface.alpha, find_input(open_part, "Fac"))
        _put(marked(tree, "ShaderNodeBsdfTransparent").outputs[0], find_input(open_part, "Shader"))
        _put(seen.outputs[0], find_input(open_part, "Shader_001"))
        seen = open_part
    _put(seen.outputs[0], surface_input)
    _arrange(tree, output)
    return True


def multiply(socket: bpy.types.NodeSocket, attribute: str) -> None:
    """Multiply what gives the colour of ``socket`` by the light."""
    tree = socket.id_data
    original = value_of(socket)
    product = _mixed(tree, "MULTIPLY", 1.0, _light(tree, attribute), original)
    product.node[NODE_MARK] = "B_Color"
    _put(product, socket)
    _arrange(tree, socket.node)


def make_plain(material: bpy.types.Material) -> bpy.types.NodeTree:
    """Nodes for a material that is shown by its plain settings, beside those that it may have and not use."""
    material.use_nodes = True
    tree = material.node_tree
    shader, output = marked(tree, "ShaderNodeBsdfPrincipled"), marked(tree, "ShaderNodeOutputMaterial")
    for name, value in (
        ("Base Color", tuple(material.diffuse_color)),
        ("Roughness", material.roughness),
        ("Specular IOR Level", 0.0),
    ):
        shader.inputs[name].default_value = value
    _put(shader.outputs[0], output.inputs["Surface"])
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeOutputMaterial":
            node.is_active_output = node == output
    return tree


def strip(tree: bpy.types.NodeTree) -> None:
    """Take the marked nodes out of a tree, and link again what was linked before."""
    if tree.library is not None:
        return
    for node in list(marked_nodes(tree)):
        original = before(node)
        if original is None:
            continue
        targets = [link.to_socket for output in node.outputs for link in output.links]
        for target in targets:
            _put(value_of(original), target)
    for node in list(marked_nodes(tree)):
        tree.nodes.remove(node)


def _light(tree: bpy.types.NodeTree, attribute: str) -> bpy.types.NodeSocket:
    node = marked(tree, "ShaderNodeVertexColor")
    node.layer_name = attribute
    return node.outputs["Color"]


def _mixed(tree, blend: str, factor: Value, first: Value, second: Value) -> bpy.types.NodeSocket:
    """The output of a new mix node. The exporter takes the first attribute that is multiplied, so light comes first."""
    node = marked(tree, "ShaderNodeMix")
    numbers = all(isinstance(value, float) for value in (first, second))
    node.data_type, kind = ("FLOAT", "Float") if numbers else ("RGBA", "Color")
    if not numbers:
        node.blend_type = blend
    for value, name in ((factor, "Factor_Float"), (first, f"A_{kind}"), (second, f"B_{kind}")):
        _put(value, find_input(node, name))
    return next(socket for socket in node.outputs if socket.identifier == f"Result_{kind}")


def _put(value: Value, socket: bpy.types.NodeSocket) -> None:
    """Link an output to an input, or set the input's value."""
    if isinstance(value, bpy.types.NodeSocket):
        socket.id_data.links.new(value, socket)
    else:
        socket.default_value = value


def _arrange(tree: bpy.types.NodeTree, beside: bpy.types.Node) -> None:
    """Put the new nodes under ``beside``, one under the other."""
    place = beside.location
    new = [node for node in marked_nodes(tree) if tuple(node.location) == (0.0, 0.0)]
    for row, node in enumerate(new):
        node.location = place[0] - 220.0, place[1] - 220.0 * (row + 1)
