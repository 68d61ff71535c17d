"""Rules for nodes that turn values into others: mixes, ramps, curves, arithmetic, splitting and joining."""

from __future__ import annotations

import numpy as np

from .colour_mixing import BLENDS, to_hsv, to_rgb
from .read_values import LUMINANCE, Values

#: steps of the tables that stand for ramps and curves
_TABLE = np.linspace(0.0, 1.0, 257)

#: arithmetic on up to three numbers
_MATH = {
    "ADD": lambda a, b, c: a + b,
    "SUBTRACT": lambda a, b, c: a - b,
    "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: np.where(b == 0, 0, a / np.where(b == 0, 1, b)),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: _power(a, b),
    "SQRT": lambda a, b, c: np.sqrt(np.maximum(a, 0)),
    "ABSOLUTE": lambda a, b, c: np.abs(a),
    "MINIMUM": lambda a, b, c: np.minimum(a, b),
    "MAXIMUM": lambda a, b, c: np.maximum(a, b),
    "LESS_THAN": lambda a, b, c: (a < b) * 1.0,
    "GREATER_THAN": lambda a, b, c: (a > b) * 1.0,
    "ROUND": lambda a, b, c: np.floor(a + 0.5),
    "FLOOR": lambda a, b, c: np.floor(a),
    "CEIL": lambda a, b, c: np.ceil(a),
    "FRACT": lambda a, b, c: a - np.floor(a),
    "SINE": lambda a, b, c: np.sin(a),
    "COSINE": lambda a, b, c: np.cos(a),
}

_VECTOR_MATH = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: np.where(b == 0, 0, a / np.where(b == 0, 1, b)),
    "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum,
}


def _power(a, b):
    # A negative base has a value for whole exponents only; the others count as 0, as in Cycles.
    real = (a >= 0) | (b == np.round(b))
    with np.errstate(all="ignore"):
        return np.nan_to_num(np.where(real, np.power(np.where(real, a, 1.0), b), 0.0), posinf=0.0, neginf=0.0)


def _math(values: Values, node, output, groups):
    rule = _MATH.get(node.operation)
    if rule is None:
        return None
    result = rule(*(values.input(node, name, groups) for name in ("Value", "Value_001", "Value_002")))
    return np.clip(result, 0, 1) if node.use_clamp else result


def _vector_math(values: Values, node, output, groups):
    first = values.input(node, "Vector", groups)
    if node.operation == "SCALE":
        return first * values.input(node, "Scale", groups)
    rule = _VECTOR_MATH.get(node.operation)
    return rule(first, values.input(node, "Vector_001", groups)) if rule else None


def _clamp(values: Values, node, output, groups):
    value, low, high = (values.input(node, name, groups) for name in ("Value", "Min", "Max"))
    if node.clamp_type == "RANGE":
        low, high = np.minimum(low, high), np.maximum(low, high)
    return np.minimum(np.maximum(value, low), high)


def _map_range(values: Values, node, output, groups):
    if node.data_type != "FLOAT" or node.interpolation_type != "LINEAR":
        return None
    value, *ends = (values.input(node, name, groups) for name in ("Value", "From Min", "From Max", "To Min", "To Max"))
    start, stop, low, high = ends
    share = np.where(stop == start, 0, (value - start) / np.where(stop == start, 1, stop - start))
    result = low + share * (high - low)
    return np.clip(result, np.minimum(low, high), np.maximum(low, high)) if node.clamp else result


def _mix(values: Values, node, output, groups):
    kind = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(node.data_type)
    if kind is None:
        return None
    uneven = kind == "Vector" and node.factor_mode == "NON_UNIFORM"
    factor = values.input(node, "Factor_Vector" if uneven else "Factor_Float", groups)
    factor = np.clip(factor, 0, 1) if node.clamp_factor else factor
    blend = BLENDS.get(node.blend_type if kind == "Color" else "MIX")
    if blend is None:
        return None
    result = _blended(values, node, groups, blend, (f"A_{kind}", f"B_{kind}"), factor)
    return np.clip(result, 0, 1) if kind == "Color" and node.clamp_result else result


def _mix_rgb(values: Values, node, output, groups):
    blend = BLENDS.get(node.blend_type)
    if blend is None:
        return None
    factor = np.clip(values.input(node, "Fac", groups), 0, 1)
    result = _blended(values, node, groups, blend, ("Color1", "Color2"), factor)
    return np.clip(result, 0, 1) if node.use_clamp else result


def _blended(values: Values, node, groups, blend, names: tuple[str, str], factor: np.ndarray) -> np.ndarray:
    first, second = (lambda name=name: values.input(node, name, groups) for name in names)
    if blend is not BLENDS["MIX"]:
        return blend(first(), second(), factor)
    return values.mixed(factor, first, second, lambda a, b: blend(a, b, factor))


def _ramp(values: Values, node, output, groups):
    table = np.array([tuple(node.color_ramp.evaluate(place)) for place in _TABLE])
    columns = (3,) if output.identifier == "Alpha" else (0, 1, 2)
    return _looked_up(table, values.input(node, "Fac", groups)[:, 0], columns)


def _curves(values: Values, node, output, groups):
    node.mapping.initialize()
    first, second, third, combined = (
        np.array([node.mapping.evaluate(curve, place) for place in _TABLE]) for curve in node.mapping.curves
    )
    colour = values.input(node, "Color", groups)
    curved = [
        np.interp(np.interp(colour[:, channel], _TABLE, combined), _TABLE, curve)
        for channel, curve in enumerate((first, second, third))
    ]
    factor = values.input(node, "Fac", groups)
    return (1 - factor) * colour + factor * np.stack(curved, axis=1)


def _looked_up(table: np.ndarray, places: np.ndarray, columns: tuple[int, ...]) -> np.ndarray:
    return np.stack([np.interp(places, _TABLE, table[:, column]) for column in columns], axis=1)


def _invert(values: Values, node, output, groups):
    factor, colour = values.input(node, "Fac", groups), values.input(node, "Color", groups)
    return (1 - factor) * colour + factor * (1 - colour)


def _gamma(values: Values, node, output, groups):
    colour, gamma = values.input(node, "Color", groups), values.input(node, "Gamma", groups)
    return np.where(colour > 0, np.power(np.maximum(colour, 1e-30), gamma), colour)


def _bright_contrast(values: Values, node, output, groups):
    colour, bright, contrast = (values.input(node, name, groups) for name in ("Color", "Bright", "Contrast"))
    return np.maximum((1 + contrast) * colour + bright - 0.5 * contrast, 0)


def _hue_saturation(values: Values, node, output, groups):
    colour = values.input(node, "Color", groups)
    hue, saturation, value, factor = (
        values.input(node, name, groups) for name in ("Hue", "Saturation", "Value", "Fac")
    )
    hsv = to_hsv(colour)
    shifted = np.concatenate(
        np.broadcast_arrays(hsv[:, :1] + hue + 0.5, np.clip(hsv[:, 1:2] * saturation, 0, 1), hsv[:, 2:] * value), axis=1
    )
    return (1 - factor) * colour + factor * np.maximum(to_rgb(shifted), 0)


def _separate(values: Values, node, output, groups):
    socket = node.inputs[0]
    parts = values.input(node, socket.identifier, groups)
    mode = getattr(node, "mode", "RGB")
    if mode not in ("RGB", "HSV"):
        return None
    parts = to_hsv(parts) if mode == "HSV" else parts
    index = [other.identifier for other in node.outputs].index(output.identifier)
    return parts[:, index : index + 1]


def _combine(values: Values, node, output, groups):
    mode = getattr(node, "mode", "RGB")
    if mode not in ("RGB", "HSV"):
        return None
    parts = [values.input(node, socket.identifier, groups) for socket in node.inputs[:3]]
    joined = np.concatenate(np.broadcast_arrays(*parts), axis=1)
    return to_rgb(joined) if mode == "HSV" else joined


def _grey(values: Values, node, output, groups):
    return values.input(node, "Color", groups) @ LUMINANCE[:, None]


COLOUR_RULES = {
    "ShaderNodeMath": _math,
    "ShaderNodeVectorMath": _vector_math,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeMix": _mix,
    "ShaderNodeMixRGB": _mix_rgb,
    "ShaderNodeValToRGB": _ramp,
    "ShaderNodeRGBCurve": _curves,
    "ShaderNodeInvert": _invert,
    "ShaderNodeGamma": _gamma,
    "ShaderNodeBrightContrast": _bright_contrast,
    "ShaderNodeHueSaturation": _hue_saturation,
    "ShaderNodeRGBToBW": _grey,
    "ShaderNodeSeparateColor": _separate,
    "ShaderNodeSeparateXYZ": _separate,
    "ShaderNodeCombineColor": _combine,
    "ShaderNodeCombineXYZ": _combine,
}
