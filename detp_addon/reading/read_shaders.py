"""Turns shader nodes into what they do to diffuse light: reflect it, give it off, let it through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .read_node_graph import Feed, feed_of, find_input
from .read_values import Values, described
from .remembered import Remembered

#: what a surface without material reflects
DEFAULT_ALBEDO = 0.8


@dataclass(frozen=True)
class Response:
    """What a shader does to light, each (m or 1, 3), RGB.

    albedo         share reflected diffusely
    emission       radiance given off, W/(m^2 sr)
    transmittance  share that goes straight on
    """

    albedo: np.ndarray
    emission: np.ndarray
    transmittance: np.ndarray

    @classmethod
    def of(cls, albedo=0.0, emission=0.0, transmittance=0.0) -> Response:
        """A response from arrays (m, 3) or single numbers for all channels."""
        return cls(*(np.atleast_2d(value) * np.ones((1, 3)) for value in (albedo, emission, transmittance)))

    def scaled(self, share: np.ndarray) -> Response:
        """This response by a ``share`` (m or 1, 1) of the surface."""
        return Response(self.albedo * share, self.emission * share, self.transmittance * share)

    def plus(self, other: Response) -> Response:
        """Both responses together."""
        return Response(
            self.albedo + other.albedo, self.emission + other.emission, self.transmittance + other.transmittance
        )


class Shaders:
    """Reads the response of shader sockets from the ``values`` of their inputs.

    ``left_out`` is called with each feature that is met and not modelled.
    """

    def __init__(self, values: Values, left_out):
        self.values = values
        self.left_out = left_out
        self._known = Remembered(in_a_loop=Response.of())

    def response(self, feed: Feed) -> Response:
        """What the shader that ``feed`` leads to does to light; black without one."""
        if feed.node is None:
            return Response.of()
        return self._known.of(feed.key, lambda: self._evaluated(feed))

    def _evaluated(self, feed: Feed) -> Response:
        rule = SHADER_RULES.get(feed.node.bl_idname)
        if rule is None:
            self.values.places.unknown(described(feed.node))
            return Response.of(albedo=DEFAULT_ALBEDO)
        if _drives(feed.node, "Normal"):
            self.left_out("bump and normal maps of {}")
        return rule(self, feed.node, feed.groups)

    def input(self, node, identifier: str, groups) -> Response:
        """The response of the shader linked to an input."""
        return self.response(feed_of(find_input(node, identifier), groups))

    def used(self, node, identifier: str, groups) -> bool:
        """Whether a numeric input is there and may be other than zero."""
        socket = find_input(node, identifier)
        return socket is not None and (self.values.linked(node, identifier, groups) or socket.default_value != 0.0)


def _drives(node, identifier: str) -> bool:
    socket = find_input(node, identifier)
    return socket is not None and socket.is_linked


def _principled(shaders: Shaders, node, groups) -> Response:
    def value(name):
        return shaders.values.input(node, name, groups)

    base, metallic, alpha = value("Base Color"), np.clip(value("Metallic"), 0, 1), np.clip(value("Alpha"), 0, 1)
    clear = np.clip(value("Transmission Weight"), 0, 1) * (1 - metallic)
    emission = value("Emission Color") * value("Emission Strength")
    _note_principled(shaders, node, groups)
    thin = find_input(node, "Thin Wall")
    # A light ray enters and leaves a solid, and each passage tints it by the root of the base colour.
    tint = np.maximum(base, 0) if thin is not None and thin.default_value else np.sqrt(np.maximum(base, 0))
    opaque = Response(*np.broadcast_arrays(base * (1 - clear), emission, tint * clear))
    return opaque.scaled(alpha).plus(Response.of(transmittance=1 - alpha))


def _note_principled(shaders: Shaders, node, groups) -> None:
    notes = {
        "Metallic": "metallic reflection of {}, which counts as diffuse",
        "Transmission Weight": "refraction of {}, through which light goes straight on",
        "Specular IOR Level": "specular reflection of {}",
        "Subsurface Weight": "subsurface scattering of {}, which counts as diffuse",
        "Coat Weight": "coat of {}",
        "Sheen Weight": "sheen of {}",
    }
    for name, sentence in notes.items():
        if shaders.used(node, name, groups):
            shaders.left_out(sentence)


def _diffuse(shaders: Shaders, node, groups) -> Response:
    return Response.of(albedo=shaders.values.input(node, "Color", groups))


def _as_diffuse(identifier: str, feature: str):
    def rule(shaders: Shaders, node, groups) -> Response:
        shaders.left_out(feature)
        return Response.of(albedo=shaders.values.input(node, identifier, groups))

    return rule


def _as_passage(feature: str):
    def rule(shaders: Shaders, node, groups) -> Response:
        shaders.left_out(feature)
        return Response.of(transmittance=shaders.values.input(node, "Color", groups))

    return rule


def _transparent(shaders: Shaders, node, groups) -> Response:
    return Response.of(transmittance=shaders.values.input(node, "Color", groups))


def _emission(shaders: Shaders, node, groups) -> Response:
    colour, strength = (shaders.values.input(node, name, groups) for name in ("Color", "Strength"))
    return Response.of(emission=colour * strength)


def _mix(shaders: Shaders, node, groups) -> Response:
    factor = np.clip(shaders.values.input(node, "Fac", groups), 0, 1)
    first, second = (shaders.input(node, name, groups) for name in ("Shader", "Shader_001"))
    return first.scaled(1 - factor).plus(second.scaled(factor))


def _add(shaders: Shaders, node, groups) -> Response:
    return shaders.input(node, "Shader", groups).plus(shaders.input(node, "Shader_001", groups))


def _black(shaders: Shaders, node, groups) -> Response:
    return Response.of()


_GLOSSY = "glossy reflection of {}, which counts as diffuse"
_GLASS = "refraction of {}, through which light goes straight on"

SHADER_RULES = {
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeBsdfDiffuse": _diffuse,
    "ShaderNodeBsdfToon": _as_diffuse("Color", "toon shading of {}, which counts as diffuse"),
    "ShaderNodeBsdfSheen": _as_diffuse("Color", "sheen of {}, which counts as diffuse"),
    "ShaderNodeSubsurfaceScattering": _as_diffuse("Color", "subsurface scattering of {}, which counts as diffuse"),
    "ShaderNodeBsdfGlossy": _as_diffuse("Color", _GLOSSY),
    "ShaderNodeBsdfAnisotropic": _as_diffuse("Color", _GLOSSY),
    "ShaderNodeBsdfMetallic": _as_diffuse("Base Color", _GLOSSY),
    "ShaderNodeBsdfGlass": _as_passage(_GLASS),
    "ShaderNodeBsdfRefraction": _as_passage(_GLASS),
    "ShaderNodeBsdfTranslucent": _as_passage("translucency of {}, through which light goes straight on"),
    "ShaderNodeBsdfTransparent": _transparent,
    "ShaderNodeEmission": _emission,
    "ShaderNodeBackground": _emission,
    "ShaderNodeMixShader": _mix,
    "ShaderNodeAddShader": _add,
    "ShaderNodeHoldout": _black,
}
