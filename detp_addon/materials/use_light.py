"""Puts baked light into the materials of the meshes that have it, and takes it out again.

Unlit: what the camera sees is the colour times the light, and no lamp adds to it; everything else (reflections,
shadows, the next bake) meets the material as it was. Base colour: the diffuse colours are multiplied by the light, and
lamps light them still. In both forms Blender's glTF exporter finds the attribute and writes it to COLOR_0.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...core.errors import NotBakedError
from ..reading.read_node_graph import node_tree
from ..report import counted
from ..writing.baked_layers import LOOK, WHITE, light_of, look_of, remove_layer
from ..writing.write_attributes import MeshColours, element_count, obstacle, write_layers
from .light_nodes import make_plain, make_unlit, multiply, strip, surface_inputs, surface_outputs
from .marked_nodes import MARK

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
    baked = [obj for obj in objects if obj.type == "MESH" and _has_light(obj.data, attribute)]
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
    _drop_looks(baked, attribute)
    use.notes += _spoilt_exports(baked)
    return use


def refresh_materials(objects: Iterable[bpy.types.Object], attribute: str) -> list[str]:
    """Make materials of ``objects`` anew that use ``attribute`` as another quantity than it holds now; notes on it."""
    stale = {}
    for obj in objects:
        quantity = light_of(obj.data, attribute)["quantity"]
        for material in materials_with_light([obj]):
            if material[MARK]["attribute"] == attribute and material[MARK]["quantity"] != quantity:
                stale[material] = quantity
    for material, quantity in stale.items():
        _use(material, attribute, quantity, material[MARK]["way"])
    names = [material.name for material in stale]
    return [f"Materials that use the light were made anew for what it is now: {_some(names)}."] if names else []


def remove_from_materials(objects: Iterable[bpy.types.Object]) -> int:
    """Make the materials of ``objects`` what they were before; returns how many had used light."""
    found = set(materials_with_light(objects))
    for material in found:
        _restore(material)
    for mesh in bpy.data.meshes:
        if mesh.library is None and not any(material is not None and MARK in material for material in mesh.materials):
            for name in [layer.name for layer in mesh.color_attributes]:
                if light_of(mesh, name)["quantity"] == WHITE:
                    remove_layer(mesh, name)
    return len(found)


def materials_with_light(objects: Iterable[bpy.types.Object]) -> Iterator[bpy.types.Material]:
    """The materials of ``objects`` that use baked light."""
    seen = set()
    for obj in objects:
        for slot in obj.material_slots if obj.type == "MESH" else ():
            if slot.material is not None and MARK in slot.material and slot.material not in seen:
                seen.add(slot.material)
                yield slot.material


def _has_light(mesh: bpy.types.Mesh, attribute: str) -> bool:
    return attribute in mesh.color_attributes and light_of(mesh, attribute)["quantity"] != WHITE


def _restore(material: bpy.types.Material) -> None:
    for tree in list(_trees(material)):
        strip(tree)
    if MARK in material:
        if material[MARK]["plain"]:
            material.use_nodes = False
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
    _restore(material)
    tree = node_tree(material)
    material[MARK] = {"attribute": attribute, "quantity": quantity, "way": way, "plain": tree is None}
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


def _drop_looks(objects: Sequence[bpy.types.Object], attribute: str) -> None:
    """Materials show the look by themselves, and a layer less goes into exports."""
    look = look_of(attribute)
    for obj in objects:
        mesh, layers = obj.data, obj.data.attributes
        if (
            mesh.library is None
            and not mesh.is_editmode
            and look in layers
            and light_of(mesh, look)["quantity"] == LOOK
        ):
            shown = [
                attribute if name == look else name for name in (layers.active_color_name, layers.default_color_name)
            ]
            remove_layer(mesh, look)
            layers.active_color_name, layers.default_color_name = shown


def _spoilt_exports(objects: Sequence[bpy.types.Object]) -> list[str]:
    """A note where this Blender's glTF exporter turns light white: 5.2.2 does on meshes with another colour layer."""
    if not (5, 2, 0) <= bpy.app.version <= (5, 2, 2):
        return []
    names = [obj.name for obj in objects if len(obj.data.color_attributes) > 1 and obj.material_slots]
    if not names:
        return []
    return [
        f"The glTF exporter of Blender 5.2.0 to 5.2.2 turns the light white on {counted(len(names), 'object')} with "
        f"more than one colour layer ({_some(names)}): switch off its 'Export All Vertex Colors', or take a later one."
    ]


def _some(names: Sequence[str]) -> str:
    return ", ".join(f"'{name}'" for name in names[:3]) + (", ..." if len(names) > 3 else "")
