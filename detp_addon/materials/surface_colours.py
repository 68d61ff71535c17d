"""Finds the colour, the alpha and the glow of a material's surface, as sockets and values to build nodes from."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import bpy

from ..reading.read_node_graph import Feed, feed_of, find_input, link_to

#: a colour or a number: the output that gives it, or its value
Value = bpy.types.NodeSocket | tuple[float, ...] | float

#: the colour of the shaders whose diffuse reflection shows light
DIFFUSE = {
    "ShaderNodeBsdfPrincipled": "Base Color",
    "ShaderNodeBsdfDiffuse": "Color",
    "ShaderNodeBsdfToon": "Color",
    "ShaderNodeBsdfSheen": "Color",
    "ShaderNodeSubsurfaceScattering": "Color",
    "ShaderNodeBsdfTranslucent": "Color",
}

#: and of those that mirror, which show no baked light, but stand for their surface where a mix needs a colour
_MIRRORS = {
    "ShaderNodeBsdfGlossy": "Color",
    "ShaderNodeBsdfAnisotropic": "Color",
    "ShaderNodeBsdfMetallic": "Base Color",
}

_EMISSION = ("ShaderNodeEmission", "ShaderNodeBackground")


@dataclass(frozen=True)
class Surface:
    """What a shader shows: its ``colour``, None where it reflects nothing, its ``alpha``, and whether it ``glows``."""

    colour: Value | None
    alpha: Value = 1.0
    glows: bool = False


class UnknownSurfaceError(Exception):
    """The colour of a shader cannot be told, or not be reached from outside."""


#: mixes two values by a factor in new nodes: (factor, first, second) -> value
Mixer = Callable[[Value, Value, Value], Value]


def surface_of(feed: Feed, mixed: Mixer) -> Surface:
    """What the shader that ``feed`` leads to shows. Raises UnknownSurfaceError."""
    node = feed.node
    if node is None:
        return Surface(None)
    if feed.groups:
        raise UnknownSurfaceError
    kind = node.bl_idname
    if kind in _EMISSION:
        return Surface(None, glows=_other_than(node, "Strength", 0.0))
    if kind == "ShaderNodeBsdfTransparent":
        return Surface(None, 0.0)
    if kind == "ShaderNodeMixShader":
        return _mixed(node, mixed)
    if kind == "ShaderNodeAddShader":
        return _added(node, mixed)
    colour = {**DIFFUSE, **_MIRRORS}.get(kind)
    if colour is None:
        raise UnknownSurfaceError
    if kind != "ShaderNodeBsdfPrincipled":
        return Surface(value_of(find_input(node, colour)))
    if _other_than(node, "Transmission Weight", 0.0):
        raise UnknownSurfaceError
    glows = _other_than(node, "Emission Strength", 0.0) and _other_than(node, "Emission Color", (0.0, 0.0, 0.0, 1.0))
    return Surface(value_of(find_input(node, colour)), value_of(find_input(node, "Alpha")), glows)


def diffuse_inputs(feed: Feed, seen: set | None = None) -> Iterator[bpy.types.NodeSocket]:
    """The colour inputs of all diffuse shaders that ``feed`` leads to, also of those inside node groups."""
    seen = set() if seen is None else seen
    if feed.node is None or feed.key in seen:
        return
    seen.add(feed.key)
    name = DIFFUSE.get(feed.node.bl_idname)
    if name is not None:
        yield find_input(feed.node, name)
    for socket in feed.node.inputs:
        if socket.type == "SHADER":
            yield from diffuse_inputs(feed_of(socket, feed.groups), seen)


def value_of(socket: bpy.types.NodeSocket) -> Value:
    """The output that is linked to an input of a node, or the value that is set there."""
    link = link_to(socket)
    if link is not None:
        return link.from_socket
    value = socket.default_value
    return value if isinstance(value, (int, float)) else tuple(value)


def _other_than(node, identifier: str, value) -> bool:
    found = value_of(find_input(node, identifier))
    return found != value and not (isinstance(found, tuple) and found[:3] == value[:3])


def _sides(node, mixed: Mixer) -> tuple[Surface, Surface]:
    return tuple(surface_of(feed_of(find_input(node, name), ()), mixed) for name in ("Shader", "Shader_001"))


def _mixed(node, mixed: Mixer) -> Surface:
    first, second = _sides(node, mixed)
    factor = value_of(find_input(node, "Fac"))
    if factor in (0.0, 1.0):
        return second if factor else first
    glows = first.glows or second.glows
    for one, other, side in ((first, second, 1.0), (second, first, 0.0)):
        if one.colour is None and one.alpha == 0.0 and other.alpha == 1.0:
            return Surface(other.colour, factor if side else mixed(factor, 1.0, 0.0), glows)
    if first.alpha != 1.0 or second.alpha != 1.0:
        raise UnknownSurfaceError
    if first.colour is None or second.colour is None:
        return Surface(first.colour or second.colour, glows=glows)
    return Surface(mixed(factor, first.colour, second.colour), glows=glows)


def _added(node, mixed: Mixer) -> Surface:
    first, second = _sides(node, mixed)
    if first.colour is not None and second.colour is not None:
        raise UnknownSurfaceError
    one = first if first.colour is not None else second
    return Surface(one.colour, one.alpha, first.glows or second.glows)
