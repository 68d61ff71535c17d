"""Shader node trees: plain ones, random ones with loops and groups, and ones that are deep."""

from __future__ import annotations

from contextlib import suppress

import bpy
from fuzz.chance import REFUSALS, Chance, put, shuffle
from fuzz.images import odd_image

#: nodes that random graphs are mostly made of; the rest may be any shader node that Blender has
COMMON = (
    *("BsdfPrincipled", "BsdfDiffuse", "Emission", "MixShader", "AddShader", "BsdfTransparent", "BsdfGlass"),
    *("TexImage", "TexNoise", "Mix", "Math", "VectorMath", "ValToRGB", "RGBCurve", "MapRange", "Value", "RGB"),
    *("TexCoord", "Mapping", "UVMap", "VertexColor", "Attribute", "LightPath", "Fresnel", "Gamma", "HueSaturation"),
    *("SeparateColor", "CombineColor", "SeparateXYZ", "CombineXYZ", "Invert", "BrightContrast", "Clamp", "Blackbody"),
)


def emptied_tree(owner) -> bpy.types.NodeTree:
    """The node tree of a material, world or light, without nodes."""
    always_since = (5, 2) if isinstance(owner, bpy.types.Light) else (5, 0)
    if bpy.app.version < always_since:
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree


def random_graph(chance: Chance, tree, output, depth: int = 0) -> None:
    """Fill ``tree`` with random nodes that feed ``output``; some links lead back and make loops."""
    nodes = [_random_node(chance, tree, depth) for _ in range(chance.count(1, 12))]
    nodes = [node for node in nodes if node is not None]
    for place, node in enumerate(nodes):
        for index in range(len(node.inputs)):
            _fill(chance, tree, node, index, nodes if chance.likely(0.1) else nodes[:place])
    for index, socket in enumerate(list(output.inputs)):
        shaders = socket.type == "SHADER" and chance.likely(0.9)
        if chance.likely(0.95 if socket.name in ("Surface", "Shader") or depth else 0.1):
            _link(chance, tree, nodes, shaders, output, index)
    if chance.likely(0.1):
        put(chance.one_of(*tree.nodes), "mute", True)
    if tree.links and chance.likely(0.05):
        put(chance.one_of(*tree.links), "is_muted", True)


def _random_node(chance: Chance, tree, depth: int):
    if chance.likely(0.12):
        return _group(chance, tree, depth)
    if chance.likely(0.05):
        return tree.nodes.new("NodeReroute")
    known = [name for name in dir(bpy.types) if name.startswith("ShaderNode")]
    name = f"ShaderNode{chance.one_of(*COMMON)}" if chance.likely(0.8) else chance.one_of(*known)
    if name == "ShaderNodeScript":
        return None  # Cycles would compile it
    try:
        node = tree.nodes.new(name)
    except REFUSALS:
        return None
    shuffle(node, chance, 0.3, without=("mute", "location", "location_absolute", "width", "height", "color", "hide"))
    if hasattr(node, "image"):
        node.image = odd_image(chance)
    if hasattr(node, "color_ramp"):
        for element in node.color_ramp.elements:
            put(element, "position", chance.number(0, 1))
            put(element, "color", chance.numbers(4, 0, 1))
    for name, choices in (("uv_map", ("", "UVMap", "no such")), ("attribute_name", ("", "Col", "weight", "no such"))):
        put(node, name, chance.one_of(*choices))
    put(node, "layer_name", chance.one_of("", "Col", "UVMap", "no such"))
    return node


def _fill(chance: Chance, tree, node, index: int, sources: list) -> None:
    """Link an input to one of the nodes ``sources``, or set its value, or leave it."""
    socket = node.inputs[index]
    if hasattr(socket, "default_value") and chance.likely(0.3):
        size = len(socket.default_value) if hasattr(socket.default_value, "__len__") else 1
        values = chance.numbers(size, 0, 1.5)
        put(socket, "default_value", values[0] if size == 1 else values)
    if sources and chance.likely(0.9 if socket.type == "SHADER" else 0.35):
        _link(chance, tree, sources, (socket.type == "SHADER") != chance.likely(0.05), node, index)


def _link(chance: Chance, tree, sources: list, shader: bool, node, index: int) -> None:
    """Link an input to any output of the nodes ``sources``, if possible to one that is a ``shader``, or that is none.

    Sockets are looked up each time, because a link may let Blender make those of groups anew.
    """
    outputs = [out for source in sources for out in source.outputs]
    fitting = [out for out in outputs if (out.type == "SHADER") == shader] or outputs
    if fitting and index < len(node.inputs):
        with suppress(*REFUSALS):
            tree.links.new(chance.one_of(*fitting), node.inputs[index])


def _group(chance: Chance, tree, depth: int):
    node = tree.nodes.new("ShaderNodeGroup")
    if depth >= 2 or chance.likely(0.1):
        return node  # a group of nothing
    inner = bpy.data.node_groups.new("group", "ShaderNodeTree")
    kinds = ("NodeSocketShader", "NodeSocketColor", "NodeSocketFloat", "NodeSocketVector")
    for side in ("INPUT", "OUTPUT"):
        for place in range(chance.count(0, 3)):
            inner.interface.new_socket(f"{side} {place}", in_out=side, socket_type=chance.one_of(*kinds))
    if chance.likely(0.9):
        output = inner.nodes.new("NodeGroupOutput")
        inside = inner.nodes.new("NodeGroupInput")
        random_graph(chance, inner, output, depth + 1)
        for other in chance.some_of([node for node in inner.nodes if node != inside], 4):
            for index in range(len(other.inputs)):
                if chance.likely(0.5):
                    _link(chance, inner, [inside], other.inputs[index].type == "SHADER", other, index)
    node.node_tree = inner
    return node


def shader_ladder(chance: Chance, tree, output) -> None:
    """Shaders added to themselves over and over: every path from top to bottom is one of two to the power of rungs."""
    source = tree.nodes.new(chance.one_of("ShaderNodeBsdfDiffuse", "ShaderNodeEmission")).outputs[0]
    for _ in range(chance.one_of(3, 40, 300)):
        rung = tree.nodes.new(chance.one_of("ShaderNodeMixShader", "ShaderNodeAddShader"))
        for socket in rung.inputs[-2:]:
            tree.links.new(source, socket)
        source = rung.outputs[0]
    tree.links.new(source, output.inputs[0])


def value_ladder(chance: Chance, tree, output) -> None:
    """A long chain of arithmetic behind a colour."""
    source = tree.nodes.new("ShaderNodeValue").outputs[0]
    for _ in range(chance.one_of(3, 100, 300)):
        rung = tree.nodes.new("ShaderNodeMath")
        put(rung, "operation", chance.one_of("ADD", "MULTIPLY", "SINE", "DIVIDE"))
        for socket in rung.inputs[:2]:
            tree.links.new(source, socket)
        source = rung.outputs[0]
    shader = tree.nodes.new(chance.one_of("ShaderNodeBsdfDiffuse", "ShaderNodeEmission"))
    tree.links.new(source, shader.inputs[0])
    tree.links.new(shader.outputs[0], output.inputs[0])
