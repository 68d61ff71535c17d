"""Turns shader nodes into what they do to light: reflect it, give it off, let it through, mirror and refract it."""

from __future__ import annotations

import numpy as np

from .glass_bodies import straightened
from .highlights import let_out_at_once, reflected_above
from .read_node_graph import Feed, chosen_item, feed_of, find_input
from .read_values import Values, described
from .remembered import Remembered
from .response import Response

#: what a surface without material reflects
DEFAULT_ALBEDO = 0.8


#: what metals reflect at grazing angles unless another tint is chosen
_EDGE_TINT = (0.695, 0.726, 0.77)


class Shaders:
    """Reads the response of shader sockets from the ``values`` of their inputs.

    ``left_out`` is called with each feature that is met and not modelled. Attributes: whether a shader was met that may
    mirror or refract (``specular``), or let light pass straight (``passes``).
    """

    def __init__(self, values: Values, left_out):
        self.values = values
        self.left_out = left_out
        self.specular = self.passes = False
        self._known = Remembered(in_a_loop=Response.of())

    def response(self, feed: Feed) -> Response:
        """What the shader that ``feed`` leads to does to light; black without one."""
        if feed.node is None and feed.socket.type == "SHADER":
            return Response.of()
        return self._known.of((*feed.key, feed.passed), lambda: self._evaluated(feed))

    def _evaluated(self, feed: Feed) -> Response:
        if feed.socket.type != "SHADER":
            # A colour or a number in the place of a shader is given off.
            return Response.of(emission=self.values.colour(feed))
        if feed.node.bl_idname in NOT_IN_CYCLES:
            return Response.of()
        rule = SHADER_RULES.get(feed.node.bl_idname)
        response = None if rule is None else rule(self, feed.node, feed.groups)
        if response is None:
            self.values.places.unknown(described(feed.node))
            return Response.of(albedo=DEFAULT_ALBEDO)
        if _drives(feed.node, "Normal"):
            self.left_out("bump and normal maps of {}")
        return response

    def input(self, node, identifier: str, groups) -> Response:
        """The response of the shader linked to an input."""
        return self.response(feed_of(find_input(node, identifier), groups))

    def used(self, node, identifier: str, groups) -> bool:
        """Whether a numeric input is there and may be other than zero."""
        if find_input(node, identifier) is None:
            return False
        fixed = self.values.fixed(node, identifier, groups)
        return fixed is None or bool(fixed.any())


def _drives(node, identifier: str) -> bool:
    socket = find_input(node, identifier)
    return socket is not None and socket.is_linked


def _principled(shaders: Shaders, node, groups) -> Response:
    def value(name):
        return shaders.values.input(node, name, groups)

    base, metallic, alpha = value("Base Color"), np.clip(value("Metallic"), 0, 1), np.clip(value("Alpha"), 0, 1)
    clear = np.clip(value("Transmission Weight"), 0, 1) * (1 - metallic)
    emission = value("Emission Color") * value("Emission Strength")
    _note_principled(shaders, node, groups, bool((metallic + clear).min() < 1))
    thin = find_input(node, "Thin Wall") is not None and bool(value("Thin Wall").any())
    # A light ray enters and leaves a solid, and each passage tints it by the root of the base colour.
    tint = np.maximum(base, 0) if thin else np.sqrt(np.maximum(base, 0))
    roughness = value("Roughness")
    kept = _kept_by_facets(shaders, node, roughness) if (metallic + clear).any() else 1.0
    diffuse, above = base * (1 - metallic - clear), np.zeros(3)
    if bool((metallic + clear).min() < 1):
        above = reflected_above(value("IOR"), value("Specular IOR Level"), value("Specular Tint"), roughness)
        above = above * np.clip(1 - base, 0, 1) * (1 - metallic - clear)
    opaque = Response.of(diffuse, emission, mirror=base * metallic * kept, roughness=roughness, highlight=above)
    glass = Response.of(gloss=clear * kept, clear=clear * tint * kept, roughness=roughness, ior=value("IOR"))
    shaders.passes |= _opens(shaders, node, groups)
    whole = opaque.plus(straightened(glass, sheet=True) if thin else glass)
    shaders.specular |= shaders.used(node, "Metallic", groups) or shaders.used(node, "Transmission Weight", groups)
    return whole.scaled(alpha).plus(Response.of(transmittance=1 - alpha))


def _opens(shaders: Shaders, node, groups) -> bool:
    """Whether a Principled shader's alpha may be below one."""
    fixed = shaders.values.fixed(node, "Alpha", groups)
    return fixed is None or bool((fixed < 1.0).any())


def _note_principled(shaders: Shaders, node, groups, partly_diffuse: bool) -> None:
    notes = {
        "Subsurface Weight": "subsurface scattering of {}, which counts as diffuse",
        "Coat Weight": "coat of {}",
        "Sheen Weight": "sheen of {}",
        "Diffuse Roughness": "roughness of the diffuse part of {}",
        "Anisotropic": "direction of the brush marks on {}",
        "Thin Film Thickness": "thin films on {}",
    }
    if partly_diffuse:
        notes |= {"Specular IOR Level": "highlights on the diffuse part of {}, which count as diffuse"}
    for name, sentence in notes.items():
        if shaders.used(node, name, groups):
            shaders.left_out(sentence)


def _diffuse(shaders: Shaders, node, groups) -> Response:
    if shaders.used(node, "Roughness", groups):
        shaders.left_out("roughness of the diffuse part of {}")
    return Response.of(albedo=shaders.values.input(node, "Color", groups))


def _as_diffuse(identifier: str, feature: str):
    def rule(shaders: Shaders, node, groups) -> Response:
        shaders.left_out(feature)
        return Response.of(albedo=shaders.values.input(node, identifier, groups))

    return rule


def _translucent(shaders: Shaders, node, groups) -> Response:
    return Response.of(spread=shaders.values.input(node, "Color", groups))


def _glossy(shaders: Shaders, node, groups) -> Response:
    return _metal(shaders, node, groups, shaders.values.input(node, "Color", groups))


def _metallic(shaders: Shaders, node, groups) -> Response:
    if getattr(node, "fresnel_type", "") != "PHYSICAL_CONDUCTOR":
        if shaders.values.linked(node, "Edge Tint", groups) or _sets(node, "Edge Tint", _EDGE_TINT):
            shaders.left_out("edge tint of {}")
        return _metal(shaders, node, groups, shaders.values.input(node, "Base Color", groups))
    ior, extinction = (shaders.values.input(node, name, groups) for name in ("IOR", "Extinction"))
    return _metal(shaders, node, groups, ((ior - 1) ** 2 + extinction**2) / ((ior + 1) ** 2 + extinction**2))


def _sets(node, identifier: str, usual: tuple) -> bool:
    """Whether a colour input is there and set to another than its usual value."""
    socket = find_input(node, identifier)
    return socket is not None and not np.allclose(socket.default_value[:3], usual, atol=1e-3)


def _metal(shaders: Shaders, node, groups, colour) -> Response:
    shaders.specular = True
    notes = {"Anisotropy": "direction of the brush marks on {}", "Thin Film Thickness": "thin films on {}"}
    for name, sentence in notes.items():
        if shaders.used(node, name, groups):
            shaders.left_out(sentence)
    roughness = shaders.values.input(node, "Roughness", groups)
    return Response.of(mirror=colour * _kept_by_facets(shaders, node, roughness), roughness=roughness)


def _kept_by_facets(shaders: Shaders, node, roughness):
    """Share (m or 1, 1) of light that a white metal or clear glass of that ``roughness`` sends on.

    Cycles follows light from facet to facet in Multiscatter GGX alone; elsewhere what the next facet blocks is lost.
    """
    if node.distribution == "MULTI_GGX":
        return 1.0
    if node.distribution != "GGX" and roughness.any():
        shaders.left_out("microfacets of {} other than GGX, which stand for them")
    return let_out_at_once(roughness)


def _glass(shaders: Shaders, node, groups) -> Response:
    # Refraction without reflection exists in Blender only; together they are the glass that it is used to build.
    shaders.specular = True
    if shaders.used(node, "Thin Film Thickness", groups):
        shaders.left_out("thin films on {}")
    colour, roughness, ior = (shaders.values.input(node, name, groups) for name in ("Color", "Roughness", "IOR"))
    handled = colour * _kept_by_facets(shaders, node, roughness)
    return Response.of(gloss=handled, clear=handled, roughness=roughness, ior=ior)


def _transparent(shaders: Shaders, node, groups) -> Response:
    shaders.passes = True
    return Response.of(transmittance=shaders.values.input(node, "Color", groups))


def _emission(shaders: Shaders, node, groups) -> Response:
    colour, strength = (shaders.values.input(node, name, groups) for name in ("Color", "Strength"))
    return Response.of(emission=colour * strength)


def _mix(shaders: Shaders, node, groups) -> Response:
    factor = np.clip(shaders.values.input(node, "Fac", groups), 0, 1)
    return shaders.values.mixed(
        factor,
        lambda: shaders.input(node, "Shader", groups),
        lambda: shaders.input(node, "Shader_001", groups),
        lambda first, second: first.scaled(1 - factor).plus(second.scaled(factor)),
    )


def _add(shaders: Shaders, node, groups) -> Response:
    return shaders.input(node, "Shader", groups).plus(shaders.input(node, "Shader_001", groups))


def _menu_switch(shaders: Shaders, node, groups) -> Response | None:
    item = chosen_item(node, groups)
    return shaders.input(node, item, groups) if item is not None else None


def _black(shaders: Shaders, node, groups) -> Response:
    return Response.of()


SHADER_RULES = {
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeBsdfDiffuse": _diffuse,
    "ShaderNodeBsdfToon": _as_diffuse("Color", "toon shading of {}, which counts as diffuse"),
    "ShaderNodeBsdfSheen": _as_diffuse("Color", "sheen of {}, which counts as diffuse"),
    "ShaderNodeSubsurfaceScattering": _as_diffuse("Color", "subsurface scattering of {}, which counts as diffuse"),
    "ShaderNodeBsdfGlossy": _glossy,
    "ShaderNodeBsdfAnisotropic": _glossy,
    "ShaderNodeBsdfMetallic": _metallic,
    "ShaderNodeBsdfGlass": _glass,
    "ShaderNodeBsdfRefraction": _glass,
    "ShaderNodeBsdfTranslucent": _translucent,
    "ShaderNodeBsdfTransparent": _transparent,
    "ShaderNodeEmission": _emission,
    "ShaderNodeBackground": _emission,
    "ShaderNodeMixShader": _mix,
    "ShaderNodeAddShader": _add,
    "ShaderNodeHoldout": _black,
    "GeometryNodeMenuSwitch": _menu_switch,
}

#: shaders that Cycles does not know: it shows nothing in their place
NOT_IN_CYCLES = frozenset({"ShaderNodeEeveeSpecular"})

#: inputs without effect on diffuse light, or details of what is named as a whole
HARMLESS_INPUTS = frozenset(
    {
        *("Weight", "Rotation", "Tangent", "Anisotropic Rotation", "Thin Film IOR"),
        *(f"Subsurface {part}" for part in ("Radius", "Scale", "IOR", "Anisotropy")),
        *("Coat Roughness", "Coat IOR", "Coat Tint", "Coat Normal", "Sheen Roughness", "Sheen Tint"),
    }
)
