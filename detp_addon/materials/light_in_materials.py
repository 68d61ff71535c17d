"""Puts baked light into the materials of the meshes that have it, and takes it out again.

Unlit: what the camera sees is the colour times the light, and no lamp adds to it; everything else (reflections,
shadows, the next bake) meets the material as it was. Base colour: the diffuse colours are multiplied by the light, and
lamps light them still. In both forms Blender's glTF exporter finds the attribute and writes it to COLOR_0.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import bpy

from ...core.errors import NotBakedError
from ..reading.read_node_graph import node_tree, trees_within
from ..wording import counted, some
from ..writing.baked_layers import WHITE, light_of, remove_layer
from .gltf_notes import gltf_notes, has_paint
from .light_nodes import make_plain, make_unlit, multiply, strip, surface_inputs, surface_outputs
from .marked_nodes import NODE_MARK
from .mesh_layers import drop_looks, materials_of, modifiers_materials, whiten

#: how light can be used; "auto" takes base colour for ambient occlusion, which lamps are to light, else unlit
WAYS = ("auto", "unlit", "base-color")


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
    baked = [obj for obj in objects if obj.type == "MESH" and _has_light(obj.data, attribute)]
    if not baked:
        raise NotBakedError(
            f"No mesh of the scene has the colour attribute '{attribute}': bake it, or choose its name."
        )
    materials = {}
    for obj in baked:
        for material in materials_of(obj):
            materials.setdefault(material, light_of(obj.data, attribute)["quantity"])
    use, refused, painted = Use(), {}, []
    for material, quantity in materials.items():
        used, reason = _use(material, attribute, quantity, way)
        if reason:
            refused.setdefault(reason, []).append(material.name)
        else:
            (use.unlit if used == "unlit" else use.base).append(material.name)
            if quantity != "shaded" and has_paint(material):
                painted.append(material.name)
    use.notes += [f"{counted(len(names), 'material')} {reason}: {some(names)}." for reason, names in refused.items()]
    others = modifiers_materials(baked)
    if others:
        use.notes.append(
            f"Geometry nodes give {counted(len(others), 'object')} materials that do not use the light: "
            f"{some(others)}. Have them in material slots too."
        )
    domain = baked[0].data.color_attributes[attribute].domain
    use.notes += whiten(set(use.unlit + use.base), attribute, domain)
    drop_looks(baked, attribute)
    use.notes += gltf_notes(baked, painted)
    return use


def refresh_materials(objects: Iterable[bpy.types.Object], attribute: str) -> list[str]:
    """Make materials of ``objects`` anew that use ``attribute`` as another quantity than it holds now; notes on it."""
    stale = {}
    for obj in objects:
        quantity = light_of(obj.data, attribute)["quantity"]
        for material in materials_with_light([obj]):
            if material[NODE_MARK]["attribute"] == attribute and material[NODE_MARK]["quantity"] != quantity:
                stale[material] = quantity
    for material, quantity in stale.items():
        _use(material, attribute, quantity, material[NODE_MARK]["way"])
    names = [material.name for material in stale]
    return [f"Materials that use the light were made anew for what it is now: {some(names)}."] if names else []


def remove_from_materials(objects: Iterable[bpy.types.Object]) -> int:
    """Make the materials of ``objects`` what they were before; returns how many had used light."""
    found = set(materials_with_light(objects))
    for material in found:
        _restore(material)
    for mesh in bpy.data.meshes:
        if mesh.library is None and not any(
            material is not None and NODE_MARK in material for material in mesh.materials
        ):
            for name in [layer.name for layer in mesh.color_attributes]:
                if light_of(mesh, name)["quantity"] == WHITE:
                    remove_layer(mesh, name)
    return len(found)


def materials_with_light(objects: Iterable[bpy.types.Object]) -> Iterator[bpy.types.Material]:
    """The materials of ``objects`` that use baked light."""
    seen = set()
    for obj in objects:
        for material in materials_of(obj) if obj.type == "MESH" else ():
            if NODE_MARK in material and material not in seen:
                seen.add(material)
                yield material


def _has_light(mesh: bpy.types.Mesh, attribute: str) -> bool:
    return attribute in mesh.color_attributes and light_of(mesh, attribute)["quantity"] != WHITE


def _restore(material: bpy.types.Material) -> None:
    for tree in list(trees_within(material.node_tree)):
        strip(tree)
    if NODE_MARK in material:
        if material[NODE_MARK]["plain"]:
            material.use_nodes = False
        del material[NODE_MARK]


def _use(material: bpy.types.Material, attribute: str, quantity: str, way: str) -> tuple[str, str]:
    """Use light in one material: how it was used, or why it was not."""
    if material.library is not None or material.override_library is not None:
        return "", "linked from a library, where light cannot be put in; make local to use it"
    _restore(material)
    tree = node_tree(material)
    material[NODE_MARK] = {"attribute": attribute, "quantity": quantity, "way": way, "plain": tree is None}
    if way == "auto":
        way = "base-color" if quantity == "ambient-occlusion" else "unlit"
    tree = tree or make_plain(material)
    if way == "unlit" or quantity == "shaded":
        outputs = surface_outputs(tree)
        if outputs and all(make_unlit(tree, output, attribute, quantity) for output in outputs):
            return "unlit", ""
        strip(tree)
    sockets = surface_inputs(tree)
    local = [socket for socket in sockets if socket.id_data.library is None and quantity != "shaded"]
    for socket in local:
        multiply(socket, attribute)
    if local:
        return "base-color", ""
    _restore(material)
    if sockets:
        return "", "with shaders inside linked or closed node groups, where light cannot be put in"
    return "", "without a surface that shows baked light (they shine, mirror, or are clear), left as they were"
