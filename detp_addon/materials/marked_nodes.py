"""The nodes that bring baked light into materials carry a mark: they are found again, and no bake reads them."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

#: the custom property of such a node: the identifier of the input that has what was there before, or ""; and of a
#: material with such nodes: {"attribute", "quantity", "way": what it uses and how, "plain": whether it had no nodes}
NODE_MARK = "detp_light"

_MIXES = ("ShaderNodeMix", "ShaderNodeMixShader")


def marked(tree: bpy.types.NodeTree, kind: str, before: str = "") -> bpy.types.Node:
    """A new node in ``tree`` with the mark, whose input ``before`` will have what was there before."""
    node = tree.nodes.new(kind)
    node[NODE_MARK] = before
    node.label = "Baked Light"
    node.select = False
    return node


def marked_nodes(tree: bpy.types.NodeTree) -> Iterator[bpy.types.Node]:
    """All nodes of ``tree`` with the mark."""
    return (node for node in tree.nodes if NODE_MARK in node)


def before(node: bpy.types.Node) -> bpy.types.NodeSocket | None:
    """The input of a marked node that has what was there before it; None of other nodes."""
    identifier = node.get(NODE_MARK) if node.bl_idname in _MIXES else None
    return next((socket for socket in node.inputs if socket.identifier == identifier), None) if identifier else None
