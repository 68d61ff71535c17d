"""Finds what feeds a node's input: through reroutes, muted nodes and node groups."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import bpy

from ..materials.marked_nodes import before

#: types of sockets whose values turn into each other
_NUMERIC = ("VALUE", "INT", "BOOLEAN", "RGBA", "VECTOR")

#: Blender itself resolves groups, reroutes and muted nodes since then, and Cycles did before, by other rules: values
#: were converted at every socket, what had no link was zero, and coordinates set in a group's input were not taken.
_RESOLVED = bpy.app.version >= (5, 0)


@dataclass(frozen=True)
class Feed:
    """Where the value of an input comes from.

    socket  the output that gives it; or, where nothing is linked, the input whose own value counts
    node    the node of that output, None when nothing is linked
    groups  the group nodes around ``node``, outermost first
    passed  types of sockets that the value is converted to on its way, first met first
    empty   whether that place has no value, which counts as zero: such as a group without an output
    given   whether the value comes from elsewhere than the input that was asked for
    """

    socket: bpy.types.NodeSocket
    node: bpy.types.Node | None
    groups: tuple[bpy.types.Node, ...]
    passed: tuple[str, ...] = ()
    empty: bool = False
    given: bool = False

    @property
    def key(self) -> tuple[int, ...]:
        """The same for feeds from the same place."""
        return (self.socket.as_pointer(), *(group.as_pointer() for group in self.groups))


def node_tree(owner) -> bpy.types.NodeTree | None:
    """The node tree that a material, world or light is made by, None when it uses its plain settings."""
    # Materials and worlds always use nodes from 5.0 on, lights from 5.2 on, and then it is deprecated to ask.
    always_since = (5, 2) if isinstance(owner, bpy.types.Light) else (5, 0)
    if bpy.app.version < always_since and not owner.use_nodes:
        return None
    return owner.node_tree


def trees_within(tree: bpy.types.NodeTree | None) -> Iterator[bpy.types.NodeTree]:
    """A node tree, if there is one, and those of all groups inside it, each once."""
    waiting, seen = [tree], set()
    while waiting:
        tree = waiting.pop()
        if tree is None or tree in seen:
            continue
        seen.add(tree)
        yield tree
        waiting += [node.node_tree for node in tree.nodes if node.type == "GROUP"]


def output_feed(tree, name: str = "Surface") -> Feed | None:
    """What feeds the input ``name`` of the output node that Cycles uses, None when nothing does.

    Groups may hold that node. Since Blender resolves groups, outer ones and the tree itself come first, linked or not;
    before, inner ones that are linked did.
    """
    for output, groups in _outputs(tree, (), set()):
        # A script can give a material the output node of a lamp, which has no such input.
        socket = output.inputs.get(name)
        feed = feed_of(socket, groups) if socket is not None else None
        if feed is not None and (feed.node is not None or (feed.socket.type != "SHADER" and feed.socket != socket)):
            return feed
        if _RESOLVED:
            return None
    return None


def _outputs(tree, groups, seen: set) -> Iterator[tuple[bpy.types.Node, tuple[bpy.types.Node, ...]]]:
    """The output nodes that are for Cycles and not muted, with the group nodes around each, as Cycles asks for them."""
    seen.add(tree)
    own = tree.get_output_node("CYCLES")
    own = [(own, groups)] if own is not None and not own.mute else []
    yield from own if _RESOLVED else ()
    for node in tree.nodes:
        inner = node.node_tree if node.bl_idname == "ShaderNodeGroup" and not node.mute else None
        if inner is not None and inner not in seen:
            yield from _outputs(inner, (*groups, node), seen)
    yield from () if _RESOLVED else own


def find_input(node, identifier: str):
    """The input socket of that identifier, or None where this version of Blender has none."""
    return next((socket for socket in node.inputs if socket.identifier == identifier), None)


def chosen_item(node, groups: tuple[bpy.types.Node, ...]) -> str | None:
    """The identifier of the input that a Menu Switch inside ``groups`` hands on, None where nodes choose it."""
    feed = feed_of(node.inputs[0], groups)
    items = [item.name for item in node.enum_items]
    chosen = feed.socket.default_value if feed.node is None else None
    return node.inputs[1 + items.index(chosen)].identifier if chosen in items else None


def feed_of(socket, groups: tuple[bpy.types.Node, ...]) -> Feed:
    """What feeds the input ``socket`` of a node inside ``groups``; a ring of links that lead nowhere feeds nothing.

    Nodes that bring baked light into a material are looked through.
    """
    asked, held, met, types, empty = socket, None, set(), [], False
    while True:
        passed = _conversions(types, None)
        feed = Feed(socket, None, groups, passed, empty, _RESOLVED and socket != asked)
        # The last input on the way that has a value of its own.
        held = held if empty and _RESOLVED else feed
        if feed.key in met:
            return held
        met.add(feed.key)
        link = link_to(socket)
        if link is None:
            return held
        node, source = link.from_node, link.from_socket
        empty = False
        if node.bl_idname == "NodeReroute":
            socket, empty = node.inputs[0], True
        elif (original := before(node)) is not None:
            socket = original
        elif node.mute:
            through = next((inner for inner in node.internal_links if inner.to_socket == source), None)
            if through is None:
                return held
            socket, empty = through.from_socket, True
        elif node.bl_idname == "NodeGroupInput" and groups and (outside := find_input(groups[-1], source.identifier)):
            socket = outside
            groups = groups[:-1]
        elif node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            inside = _group_result(node, source.identifier)
            if inside is None:
                return Feed(source, None, groups, passed, True, _RESOLVED)
            socket = inside
            groups = (*groups, node)
        else:
            return Feed(source, node, groups, _conversions(types, node), given=True)
        if source.type in _NUMERIC and not (_RESOLVED and node.bl_idname == "NodeReroute"):
            types.append(source.type)


def _conversions(types: list[str], node: bpy.types.Node | None) -> tuple[str, ...]:
    """Of the ``types`` of sockets on the way to the output of a ``node``, last met first, those that convert its value.

    First met first. Where Blender resolves groups, a set colour stays.
    """
    kept = _RESOLVED and node is not None and node.bl_idname == "ShaderNodeRGB"
    return () if kept else tuple(reversed(types))


def link_to(socket: bpy.types.NodeSocket) -> bpy.types.NodeLink | None:
    """The link that counts of those to the input ``socket`` of a node, if any does."""
    # Asking a socket for its links takes as long as the tree has links.
    links = socket.links if socket.is_linked else ()
    return next((link for link in links if link.is_valid and not link.is_muted), None)


def _group_result(group, identifier: str):
    """The input, inside the group, that its output ``identifier`` shows; None when there is none, or it is muted."""
    outputs = [node for node in group.node_tree.nodes if node.bl_idname == "NodeGroupOutput"]
    output = next((node for node in outputs if node.is_active_output), None)
    return find_input(output, identifier) if output is not None and not output.mute else None
