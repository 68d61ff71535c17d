"""Images and checkers whose mean does not tell the mean of what nodes make of them: on their way is one that is not
straight, or colours and alpha of one image go together."""

from __future__ import annotations

from .read_images import veils
from .read_node_graph import Feed, feed_of

#: operations by which means of texels stay means, those of two images not looked at
_STRAIGHT = {"ADD", "SUBTRACT", "MULTIPLY", "MULTIPLY_ADD", "DIVIDE", "RADIANS", "DEGREES", "SCALE", "DOT_PRODUCT"}

#: nodes whose means over patches hide what differs within
_PATTERNS = {"ShaderNodeTexImage", "ShaderNodeTexChecker"}

#: nodes that bend what they are given, and ways to mix colours that do
_BENT = {
    *("ShaderNodeValToRGB", "ShaderNodeMapRange", "ShaderNodeFloatCurve", "ShaderNodeRGBCurve", "ShaderNodeGamma"),
    *("ShaderNodeClamp", "ShaderNodeBrightContrast", "ShaderNodeHueSaturation"),
}
_BENT_BLENDS = {"DARKEN", "LIGHTEN", "DODGE", "BURN", "OVERLAY", "SOFT_LIGHT", "DIFFERENCE"}


def bends_patterns(feed: Feed) -> bool:
    """Whether on the way from where ``feed`` leads an image or a checker meets a threshold, a ramp or the like."""
    waiting, fed, patterns = [feed] * (feed.node is not None), {}, []
    while waiting:
        here = waiting.pop()
        if _alpha_apart(here.node):
            return True
        if here.node.bl_idname in _PATTERNS:
            patterns.append(here)
        for socket in here.node.inputs:
            source = feed_of(socket, here.groups)
            if source.node is None:
                continue
            if source.key not in fed:
                fed[source.key] = []
                waiting.append(source)
            fed[source.key].append(here)
    met = set()
    while patterns:
        for above in fed.get(patterns.pop().key, ()):
            if _bent(above.node):
                return True
            if above.key not in met:
                met.add(above.key)
                patterns.append(above)
    return False


def _alpha_apart(node) -> bool:
    """Whether alpha and colours of an image are both used, and each by itself; otherwise one is the other's weight."""
    if node.bl_idname != "ShaderNodeTexImage" or not all(output.is_linked for output in node.outputs):
        return False
    return node.image is not None and not veils(node.image)


def _bent(node) -> bool:
    if node.bl_idname in ("ShaderNodeMath", "ShaderNodeVectorMath"):
        return node.operation not in _STRAIGHT or getattr(node, "use_clamp", False)
    return node.bl_idname in _BENT or getattr(node, "blend_type", "MIX") in _BENT_BLENDS
