"""Materials: plain, textured, shining, and with node trees that nobody would build."""

from __future__ import annotations

import bpy
from fuzz.chance import REFUSALS, Chance, put
from fuzz.images import odd_image
from fuzz.node_graphs import emptied_tree, random_graph, shader_ladder, value_ladder

SHADERS = (
    *("BsdfPrincipled", "BsdfPrincipled", "BsdfDiffuse", "BsdfDiffuse", "Emission", "BsdfTransparent", "BsdfGlass"),
    *("BsdfMetallic", "BsdfAnisotropic", "BsdfTranslucent", "BsdfToon", "BsdfSheen", "BsdfRefraction"),
    *("SubsurfaceScattering", "Holdout", "VolumeAbsorption", "EeveeSpecular", "BsdfHair"),
)


def odd_material(chance: Chance) -> bpy.types.Material | None:
    """A material, or none for an empty slot."""
    if chance.likely(0.1):
        return None
    material = bpy.data.materials.new(chance.one_of("material", "Stoff", "m" * 60))
    put(material, "diffuse_color", chance.numbers(4, 0, 1))
    if chance.likely(0.1):
        if bpy.app.version < (5, 0):
            material.use_nodes = False
        return material
    tree = emptied_tree(material)
    if chance.likely(0.03):
        return material
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    build = chance.one_of(*([_single] * 6), *([_textured] * 3), *([random_graph] * 4), _ladder, _undefined)
    build(chance, tree, output)
    if chance.likely(0.05):
        second = tree.nodes.new("ShaderNodeOutputMaterial")
        put(second, "target", chance.one_of("CYCLES", "EEVEE"))
        put(second, "is_active_output", True)
    if chance.likely(0.05):
        _driven(chance, tree)
    return material


def _single(chance: Chance, tree, output):
    """One shader with its inputs set to anything."""
    node = tree.nodes.new(f"ShaderNode{chance.one_of(*SHADERS)}")
    for socket in node.inputs:
        if hasattr(socket, "default_value") and chance.likely(0.3):
            size = len(socket.default_value) if hasattr(socket.default_value, "__len__") else 1
            values = chance.numbers(size, 0, chance.one_of(1, 1, 3))
            put(socket, "default_value", values[0] if size == 1 else values)
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return node


def _textured(chance: Chance, tree, output) -> None:
    """A shader with a picture in one or more inputs."""
    shader = _single(chance, tree, output)
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = odd_image(chance)
    put(texture, "extension", chance.one_of("REPEAT", "EXTEND", "CLIP", "MIRROR"))
    put(texture, "projection", chance.one_of("FLAT", "FLAT", "FLAT", "BOX", "SPHERE", "TUBE"))
    for index in chance.some_of(range(len(shader.inputs)), 3):
        tree.links.new(texture.outputs[chance.one_of("Color", "Alpha")], shader.inputs[index])
    if chance.likely(0.5):
        mapping = tree.nodes.new("ShaderNodeMapping")
        put(mapping, "vector_type", chance.one_of("POINT", "TEXTURE", "VECTOR", "NORMAL"))
        for name in ("Location", "Rotation", "Scale"):
            if name in mapping.inputs:
                put(mapping.inputs[name], "default_value", chance.numbers(3, -2, 2))
        source = tree.nodes.new("ShaderNodeTexCoord")
        tree.links.new(chance.one_of(*source.outputs), mapping.inputs[0])
        tree.links.new(mapping.outputs[0], texture.inputs[0])


def _ladder(chance: Chance, tree, output) -> None:
    chance.one_of(shader_ladder, value_ladder)(chance, tree, output)


def _undefined(chance: Chance, tree, output) -> None:
    """A node whose type goes away, as when its add-on is not there."""

    class FuzzShaderNode(bpy.types.ShaderNodeCustomGroup):
        bl_idname = "FuzzShaderNode"
        bl_label = "Lost"

    bpy.utils.register_class(FuzzShaderNode)
    inner = bpy.data.node_groups.new("lost", "ShaderNodeTree")
    inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    node = tree.nodes.new("FuzzShaderNode")
    node.node_tree = inner
    if node.outputs:
        tree.links.new(node.outputs[0], output.inputs["Surface"])
    bpy.utils.unregister_class(FuzzShaderNode)


def _driven(chance: Chance, tree) -> None:
    """A value that a driver sets, to anything or by an expression that fails."""
    sockets = [socket for node in tree.nodes for socket in node.inputs if socket.type == "VALUE"]
    if not sockets:
        return
    try:
        driver = chance.one_of(*sockets).driver_add("default_value").driver
        driver.expression = chance.one_of("1/0", "frame * 1e38 * 10", "sqrt(-1)", "no_such_name", "0.5", "")
    except REFUSALS:
        return
