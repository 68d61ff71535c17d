"""Plays baked light back: an attribute for each key frame, and a modifier that blends them into the colour layer.

The values of key frames are generic attributes, so no list of colours is cluttered and no export carries them. The
modifier is the first of its object, so that what follows carries one layer along, and it writes the layer that a still
bake has, so that viewports, materials and exports need nothing else. Removing it leaves the light of the first frame.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack

import bpy
import numpy as np

from ...core.errors import AttributeNameTakenError
from ..wording import some
from ..writing.baked_layers import put_mark
from ..writing.write_attributes import LONGEST_NAME, remove_attribute
from .frames import Frames

#: the custom property of a mesh: {attribute: {"first", "last", "every": frames}}; and of a node group: the attribute
PLAYBACK_MARK = "detp_animation"

#: what stands for the number of a key in the names of their attributes
_KEY = "{key}"


def key_name(attribute: str, key: int | str) -> str:
    """The name of the attribute with the light of a ``key`` frame, counted from 0.

    Raises AttributeNameTakenError when it would be too long.
    """
    name = f"{attribute}@{key}"
    if len(name.encode()) > LONGEST_NAME:
        raise AttributeNameTakenError(f"The attribute name '{attribute}' is too long for an animation: shorten it.")
    return name


def played_frames(mesh: bpy.types.Mesh, attribute: str) -> Frames | None:
    """The frames that an animation in ``attribute`` has, None when there is none."""
    found = mesh[PLAYBACK_MARK].to_dict().get(attribute) if hasattr(mesh.get(PLAYBACK_MARK), "to_dict") else None
    return Frames(*(int(found[name]) for name in ("first", "last", "every"))) if found else None


def animated_objects(objects: Iterable[bpy.types.Object], attribute: str) -> list[bpy.types.Object]:
    """Those of the ``objects`` that play an animation in ``attribute``."""
    return [obj for obj in objects if obj.type == "MESH" and played_frames(obj.data, attribute) is not None]


def stored_keys(mesh: bpy.types.Mesh, attribute: str) -> np.ndarray:
    """The rgb (K, M, 3) of all key frames of an animation, as stored."""
    layers = [mesh.attributes[key_name(attribute, key)] for key in range(len(played_frames(mesh, attribute).keys))]
    rgb = np.empty((len(layers), len(layers[0].data), 3), np.float32)
    for layer, values in zip(layers, rgb, strict=True):
        layer.data.foreach_get("vector", values.ravel())
    return rgb


def hidden_by_playback(objects: Iterable[bpy.types.Object], attribute: str) -> list[str]:
    """A sentence on objects whose animation hides a still bake."""
    names = [obj.name for obj in animated_objects(objects, attribute)]
    return [
        f"A baked animation plays in '{attribute}' on {some(names)} and hides this bake: remove it to see the bake."
    ] if names else []  # fmt: skip


def write_playback(
    objects: dict[bpy.types.Object, np.ndarray], attribute: str, frames: Frames, kind: tuple[str, str], undo: ExitStack
) -> None:
    """Store the rgb (K, M, 3) of the key frames of each object and let it play; closing ``undo`` takes all back.

    ``kind`` is the type and the domain of the layer ``attribute``. Raises AttributeNameTakenError.
    """
    group = _node_group(attribute, frames, *kind)
    undo.callback(bpy.data.node_groups.remove, group)
    for obj, values in objects.items():
        mesh, before = obj.data, obj.data[PLAYBACK_MARK].to_dict() if PLAYBACK_MARK in obj.data else None
        for key, rgb in enumerate(values):
            _write_key(obj, key_name(attribute, key), kind[1], rgb, undo)
        modifier = _modifier(obj, attribute)
        if modifier is None:
            modifier = obj.modifiers.new(f"Baked light: {attribute}", "NODES")
            obj.modifiers.move(len(obj.modifiers) - 1, 0)
            undo.callback(lambda obj=obj, name=modifier.name: obj.modifiers.remove(obj.modifiers[name]))
        else:
            undo.callback(setattr, modifier, "node_group", modifier.node_group)
        modifier.node_group = group
        undo.callback(put_mark, mesh, before, PLAYBACK_MARK)
        noted = {"first": frames.first, "last": frames.last, "every": frames.every}
        mesh[PLAYBACK_MARK] = (before or {}) | {attribute: noted}


def tidy_playback(objects: Iterable[bpy.types.Object], attribute: str) -> None:
    """Remove what a longer animation has left in the meshes of ``objects``, and node groups that nobody uses."""
    for obj in animated_objects(objects, attribute):
        _remove_keys(obj.data, attribute, len(played_frames(obj.data, attribute).keys))
    _remove_unused_groups()


def remove_playback(objects: Iterable[bpy.types.Object], attribute: str) -> int:
    """Remove the animation from ``objects``, which keep the light of its first frame; returns from how many."""
    chosen = animated_objects(objects, attribute)
    for obj in chosen:
        modifier = _modifier(obj, attribute)
        if modifier is not None:
            obj.modifiers.remove(modifier)
        _remove_keys(obj.data, attribute, 0)
        if PLAYBACK_MARK in obj.data:  # objects may share a mesh
            left = {name: value for name, value in obj.data[PLAYBACK_MARK].to_dict().items() if name != attribute}
            put_mark(obj.data, left or None, PLAYBACK_MARK)
        obj.data.update_tag()
    _remove_unused_groups()
    return len(chosen)


def is_playback(modifier: bpy.types.Modifier) -> bool:
    """Whether a modifier plays light back."""
    return modifier.type == "NODES" and modifier.node_group is not None and PLAYBACK_MARK in modifier.node_group


def _modifier(obj: bpy.types.Object, attribute: str) -> bpy.types.Modifier | None:
    return next(
        (each for each in obj.modifiers if is_playback(each) and each.node_group[PLAYBACK_MARK] == attribute), None
    )


def _write_key(obj: bpy.types.Object, name: str, domain: str, rgb: np.ndarray, undo: ExitStack) -> None:
    layers = obj.data.attributes
    layer = layers.get(name)
    if layer is None:
        layer = layers.new(name, "FLOAT_VECTOR", domain)
        undo.callback(remove_attribute, obj.data, layer.name)
    elif (layer.data_type, layer.domain) == ("FLOAT_VECTOR", domain):
        kept = np.empty(3 * len(layer.data), np.float32)
        layer.data.foreach_get("vector", kept)
        undo.callback(lambda: obj.data.attributes[name].data.foreach_set("vector", kept))
    if layer.name != name or (layer.data_type, layer.domain) != ("FLOAT_VECTOR", domain):
        raise AttributeNameTakenError(f"'{obj.name}' already has an attribute named '{name}': remove or rename it.")
    layer.data.foreach_set("vector", np.ascontiguousarray(rgb, np.float32).ravel())


def _remove_keys(mesh: bpy.types.Mesh, attribute: str, first: int) -> None:
    """Remove the key frames from the ``first`` on."""
    while (layer := mesh.attributes.get(key_name(attribute, first))) is not None:
        mesh.attributes.remove(layer)
        first += 1


def _remove_unused_groups() -> None:
    for group in [group for group in bpy.data.node_groups if PLAYBACK_MARK in group and not group.users]:
        bpy.data.node_groups.remove(group)


def _node_group(attribute: str, frames: Frames, kind: str, domain: str) -> bpy.types.NodeTree:
    """Nodes that write the light of the scene's frame into the layer ``attribute``, blended between two key frames.

    With frames f and K keys every n from a on, the row before is r = clamp(floor((f - a) / n), 0, K - 2), and the share
    of the key behind it (f - a - n r) / length, cut at 0 and 1, where only the last length may differ from n.
    """
    group = bpy.data.node_groups.new(f"Baked light: {attribute}", "GeometryNodeTree")
    group[PLAYBACK_MARK], group.is_modifier = attribute, True
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    nodes, keys = _Nodes(group), frames.keys
    last = len(keys) - 2.0
    since = nodes.math("SUBTRACT", nodes.new("GeometryNodeInputSceneTime").outputs["Frame"], frames.first)
    row = nodes.math("FLOOR", nodes.math("DIVIDE", since, frames.every))
    row = nodes.math("MINIMUM", nodes.math("MAXIMUM", row, 0.0), last)
    shorter = keys[-1] - keys[-2] - frames.every
    length = nodes.math("MULTIPLY_ADD", nodes.math("COMPARE", row, last, 0.5), shorter, frames.every)
    share = nodes.math("DIVIDE", nodes.math("SUBTRACT", since, nodes.math("MULTIPLY", row, frames.every)), length)
    mix = nodes.new("ShaderNodeMix", data_type="RGBA", clamp_factor=True)
    nodes.put(share, mix, "Factor_Float")
    nodes.put(nodes.key(attribute, row), mix, "A_Color")
    nodes.put(nodes.key(attribute, nodes.math("ADD", row, 1.0)), mix, "B_Color")
    store = nodes.new("GeometryNodeStoreNamedAttribute", data_type=kind, domain=domain)
    nodes.put(nodes.new("NodeGroupInput").outputs[0], store, "Geometry")
    nodes.put(attribute, store, "Name")
    group.links.new(
        next(socket for socket in mix.outputs if socket.identifier == "Result_Color"),
        next(socket for socket in store.inputs if socket.name == "Value" and socket.enabled),
    )
    group.links.new(store.outputs[0], nodes.new("NodeGroupOutput").inputs[0])
    return group


class _Nodes:
    """Makes the nodes of one tree, from left to right."""

    def __init__(self, tree: bpy.types.NodeTree):
        self._tree = tree

    def new(self, kind: str, **settings) -> bpy.types.Node:
        node = self._tree.nodes.new(kind)
        node.location = (180.0 * len(self._tree.nodes), 0.0)
        for name, value in settings.items():
            setattr(node, name, value)
        return node

    def put(self, value, node: bpy.types.Node, identifier: str) -> None:
        """Link an output to an input, or set it."""
        socket = next(each for each in node.inputs if each.identifier == identifier)
        if isinstance(value, bpy.types.NodeSocket):
            self._tree.links.new(value, socket)
        else:
            socket.default_value = value

    def math(self, operation: str, *values) -> bpy.types.NodeSocket:
        node = self.new("ShaderNodeMath", operation=operation)
        for value, identifier in zip(values, ("Value", "Value_001", "Value_002"), strict=False):
            self.put(value, node, identifier)
        return node.outputs[0]

    def key(self, attribute: str, row: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        """The light of the key frame of that ``row``."""
        number = self.new("FunctionNodeValueToString")
        self.put(row, number, "Value")
        self.put(0, number, "Decimals")
        name = self.new("FunctionNodeReplaceString")
        self.put(key_name(attribute, _KEY), name, "String")
        self.put(_KEY, name, "Find")
        self.put(number.outputs[0], name, "Replace")
        values = self.new("GeometryNodeInputNamedAttribute", data_type="FLOAT_COLOR")
        self.put(name.outputs[0], values, "Name")
        return next(socket for socket in values.outputs if socket.enabled and socket.type == "RGBA")
