"""Puts baked light into the materials of the meshes that have it, and takes it out again.

Unlit: what the camera sees is the colour times the light, and no lamp adds to it; everything else (reflections,
shadows, the next bake) meets the material as it was. Base colour: the diffuse colours are multiplied by the light, and
lamps light them still. In both forms Blender's glTF exporter finds the attribute and writes it to COLOR_0.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial

import bpy
import numpy as np

from ...core.errors import NotBakedError
from ..reading.read_node_graph import feed_of, find_input, node_tree
from ..report import counted
from ..writing.baked_layers import WHITE, light_of, take_mark_of
from ..writing.write_attributes import MeshColours, element_count, obstacle, write_layers
from .marked_nodes import MARK, NODES, PLAIN, before, marked, marked_nodes
from .surface_colours import Surface, UnknownSurfaceError, Value, diffuse_inputs, surface_of, value_of

#: how light can be used; "auto" takes base colour for ambient occlusion, which lamps are to light, else unlit
WAYS = ("auto", "unlit", "base-color")

_PAINT = ("ShaderNodeVertexColor", "ShaderNodeAttribute")


@dataclass
class Use:
    """What was done: the materials made ``unlit``, multiplied in their ``base`` colour, and ``notes`` for the user."""

    unlit: list[str] = field(default_factory=list)
    base: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def sentence(self) -> str:
        """One line for people."""
        parts = []
        if self.unlit:
            parts.append(f"unlit in {counted(len(self.unlit), 'material')}")
        if self.base:
            parts.append(f"in the base colour of {counted(len(self.base), 'material')}")
        return f"The light is used {' and '.join(parts)}." if parts else "No material could use the light."


def use_in_materials(objects: Iterable[bpy.types.Object], attribute: str, way: str = "auto") -> Use:
    """Use the light of ``attribute`` in the materials of all ``objects`` whose meshes have it; ``way`` is one of WAYS.

    A material that uses light already is made anew. Raises NotBakedError when no object has the attribute.
    """
    baked = [obj for obj in objects if obj.type == "MESH" and attribute in obj.data.color_attributes]
    if not baked:
        raise NotBakedError(
            f"No mesh of the scene has the colour attribute '{attribute}': bake it, or choose its name."
        )
    materials, bare = {}, []
    for obj in baked:
        slots = [slot.material for slot in obj.material_slots if slot.material is not None]
        for material in slots:
            materials.setdefault(material, light_of(obj.data, attribute)["quantity"])
        if not slots:
            bare.append(obj.name)
    use, refused, painted = Use(), {}, []
    for material, quantity in materials.items():
        used, reason = _use(material, attribute, quantity, way)
        if reason:
            refused.setdefault(reason, []).append(material.name)
        else:
            (use.unlit if used == "unlit" else use.base).append(material.name)
            if quantity != "shaded" and _has_paint(material):
                painted.append(material.name)
    use.notes += [f"{counted(len(names), 'material')} {reason}: {_some(names)}." for reason, names in refused.items()]
    if painted:
        use.notes.append(
            f"A glTF file has room for the light or the paint of a material, not for both: {_some(painted)}. "
            f"Bake 'shaded' to have both in one."
        )
    if bare:
        use.notes.append(
            f"{counted(len(bare), 'object')} without material: {_some(bare)}. A glTF file has their light, cut at 1."
        )
    domain = baked[0].data.color_attributes[attribute].domain
    use.notes += _whiten(set(use.unlit + use.base), attribute, domain)
    return use


def remove_from_materials(objects: Iterable[bpy.types.Object]) -> int:
    """Make the materials of ``objects`` what they were before; returns how many had used light."""
    found = set(materials_with_light(objects))
    for material in found:
        _restore(material)
    for mesh in bpy.data.meshes:
        if mesh.library is None and not any(material is not None and MARK in material for material in mesh.materials):
            for name in [layer.name for layer in mesh.color_attributes]:
                if light_of(mesh, name)["quantity"] == WHITE:
                    take_mark_of(mesh, name)
                    mesh.attributes.remove(mesh.attributes[name])
    return len(found)


def materials_with_light(objects: Iterable[bpy.types.Object]) -> Iterator[bpy.types.Material]:
    """The materials of ``objects`` that use baked light."""
    seen = set()
    for obj in objects:
        for slot in obj.material_slots if obj.type == "MESH" else ():
            if slot.material is not None and MARK in slot.material and slot.material not in seen:
                seen.add(slot.material)
                yield slot.material


def _restore(material: bpy.types.Material) -> None:
    for tree in list(_trees(material)):
        _strip(tree)
    if material.get(MARK) == PLAIN:
        material.use_nodes = False
    if MARK in material:
        del material[MARK]


def _trees(material: bpy.types.Material) -> Iterator[bpy.types.NodeTree]:
    """The node tree of a material and all those inside it."""
    waiting, seen = [material.node_tree], set()
    while waiting:
        tree = waiting.pop()
        if tree is None or tree in seen:
            continue
        seen.add(tree)
        yield tree
        waiting += [node.node_tree for node in tree.nodes if node.bl_idname == "ShaderNodeGroup"]


def _use(material: bpy.types.Material, attribute: str, quantity: str, way: str) -> tuple[str, str]:
    """Use light in one material: how it was used, or why it was not."""
    if material.library is not None or material.override_library is not None:
        return "", "linked from a library, where light cannot be put in; make local to use it"
    if way == "auto":
        way = "base-color" if quantity == "ambient-occlusion" else "unlit"
    _restore(material)
    material[MARK] = NODES
    tree = node_tree(material) or _plain_nodes(material)
    if way == "unlit" or quantity == "shaded":
        outputs = _outputs(tree)
        if outputs and all(_unlit(tree, output, attribute, quantity) for output in outputs):
            return "unlit", ""
        _strip(tree)
    sockets = _inputs(tree)
    local = [socket for socket in sockets if socket.id_data.library is None and quantity != "shaded"]
    for socket in local:
        _multiplied(socket, attribute)
    if local:
        return "base-color", ""
    _restore(material)
    if sockets:
        return "", "with shaders inside linked or closed node groups, where light cannot be put in"
    return "", "without a surface that shows baked light (they shine, mirror, or are clear), left as they were"


def _outputs(tree: bpy.types.NodeTree) -> list[bpy.types.Node]:
    """The output nodes that an engine or the exporter of Blender looks at."""
    found = {tree.get_output_node(target) for target in ("ALL", "EEVEE", "CYCLES")}
    found |= {node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial" and node.is_active_output}
    return [node for node in found if node is not None and node.inputs["Surface"].is_linked]


def _inputs(tree: bpy.types.NodeTree) -> list[bpy.types.NodeSocket]:
    found = {}
    for output in _outputs(tree):
        for socket in diffuse_inputs(feed_of(output.inputs["Surface"], ())):
            found[socket.as_pointer()] = socket
    return list(found.values())


def _unlit(tree, output, attribute: str, quantity: str) -> bool:
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


def _multiplied(socket: bpy.types.NodeSocket, attribute: str) -> None:
    """Multiply what gives the colour of ``socket`` by the light."""
    tree = socket.id_data
    original = value_of(socket)
    product = _mixed(tree, "MULTIPLY", 1.0, _light(tree, attribute), original)
    product.node[MARK] = "B_Color"
    _put(product, socket)
    _arrange(tree, socket.node)


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


def _plain_nodes(material: bpy.types.Material) -> bpy.types.NodeTree:
    """Nodes for a material that is shown by its plain settings, beside those that it may have and not use."""
    material.use_nodes = True
    material[MARK] = PLAIN
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


def _strip(tree: bpy.types.NodeTree) -> None:
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


def _arrange(tree: bpy.types.NodeTree, beside: bpy.types.Node) -> None:
    """Put the new nodes under ``beside``, one under the other."""
    place = beside.location
    new = [node for node in marked_nodes(tree) if tuple(node.location) == (0.0, 0.0)]
    for row, node in enumerate(new):
        node.location = place[0] - 220.0, place[1] - 220.0 * (row + 1)


def _has_paint(material: bpy.types.Material) -> bool:
    """Whether nodes of the material itself ask for colours of the mesh."""
    return any(node.bl_idname in _PAINT and MARK not in node for tree in _trees(material) for node in tree.nodes)


def _whiten(materials: set[str], attribute: str, domain: str) -> list[str]:
    """Give white light to other meshes with the same materials, which would be black without any; notes on it."""
    lit, dark, seen = [], [], set()
    for obj in bpy.data.objects:
        if obj.type != "MESH" or obj.data in seen or attribute in obj.data.color_attributes:
            continue
        if not any(slot.material is not None and slot.material.name in materials for slot in obj.material_slots):
            continue
        seen.add(obj.data)
        (dark if obstacle(obj, attribute, domain) else lit).append(obj)
    with ExitStack() as undo:
        for obj in lit:
            white = np.ones((element_count(obj.data, domain), 3))
            write_layers(MeshColours(obj, {attribute: white}, {"quantity": WHITE}), domain, None, undo)
        undo.pop_all()
    notes = []
    if lit:
        notes.append(
            f"{counted(len(lit), 'object')} with the same materials but without baked light got white light, so that "
            f"they are not black: {_some([obj.name for obj in lit])}."
        )
    if dark:
        notes.append(
            f"{counted(len(dark), 'object')} with the same materials can hold no light and turn black: "
            f"{_some([obj.name for obj in dark])}."
        )
    return notes


def _some(names: Sequence[str]) -> str:
    return ", ".join(f"'{name}'" for name in names[:3]) + (", ..." if len(names) > 3 else "")
