"""Rules for nodes that turn values into others: mixes, ramps, curves, arithmetic, splitting and joining."""

from __future__ import annotations

import numpy as np

from .arithmetic import MATH, VECTOR_MATH, dot, refracted, smooth, turned, unit
from .colour_mixing import BLENDS, from_hsl, to_hsl, to_hsv, to_rgb
from .read_values import Values
from .working_space import luminance

#: steps of the tables that stand for ramps and curves
_TABLE = np.linspace(0.0, 1.0, 257)


def _math(values: Values, node, output, groups):
    rule = MATH.get(node.operation)
    if rule is None:
        return None
    result = rule(*(values.input(node, name, groups) for name in ("Value", "Value_001", "Value_002")))
    return np.clip(result, 0, 1) if node.use_clamp else result


def _vector_math(values: Values, node, output, groups):
    first, second, third = (values.input(node, name, groups) for name in ("Vector", "Vector_001", "Vector_002"))
    if node.operation == "SCALE":
        return first * values.input(node, "Scale", groups)
    if node.operation == "REFRACT":
        return refracted(first, second, values.input(node, "Scale", groups))
    rule = VECTOR_MATH.get(node.operation)
    return rule(first, second, third) if rule else None


def _vector_rotate(values: Values, node, output, groups):
    vector, centre = (values.input(node, name, groups) for name in ("Vector", "Center"))
    sign = -1.0 if node.invert else 1.0
    if node.rotation_type == "EULER_XYZ":
        angles = values.input(node, "Rotation", groups)
        around = list(zip(np.eye(3), (0, 1, 2), strict=True))
        found = vector - centre
        for axis, number in around[::-1] if node.invert else around:
            found = turned(found, axis[None], sign * angles[:, number : number + 1])
        return found + centre
    if node.rotation_type == "AXIS_ANGLE":
        axis = values.input(node, "Axis", groups)
    else:
        axis = np.eye(3)["XYZ".index(node.rotation_type[0])][None]
    return turned(vector - centre, axis, sign * values.input(node, "Angle", groups)) + centre


def _normal(values: Values, node, output, groups):
    direction = np.array(node.outputs["Normal"].default_value, np.float64)[None]
    return (
        direction if output.identifier == "Normal" else dot(unit(direction), unit(values.input(node, "Normal", groups)))
    )


def _clamp(values: Values, node, output, groups):
    value, low, high = (values.input(node, name, groups) for name in ("Value", "Min", "Max"))
    if node.clamp_type == "RANGE":
        low, high = np.minimum(low, high), np.maximum(low, high)
    return np.minimum(np.maximum(value, low), high)


def _map_range(values: Values, node, output, groups):
    vectors = node.data_type == "FLOAT_VECTOR"
    names = ("From Min", "From Max", "To Min", "To Max", "Steps")
    if vectors:
        names = tuple(f"{name.replace(' ', '_')}_FLOAT3" for name in names)
    value = values.input(node, "Vector" if vectors else "Value", groups)
    start, stop, low, high, steps = (values.input(node, name, groups) for name in names)
    share = np.where(stop == start, 0, (value - start) / np.where(stop == start, 1, stop - start))
    if node.interpolation_type.startswith("SMOOTH"):
        return low + smooth(node.interpolation_type, share) * (high - low)
    if node.interpolation_type == "STEPPED":
        share = np.where(steps > 0, np.floor(share * (steps + 1)) / np.where(steps > 0, steps, 1), 0)
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
    *each, combined = (_curve(node.mapping, curve) for curve in node.mapping.curves)
    colour = values.input(node, "Color", groups)
    curved = [curve(combined(colour[:, channel])) for channel, curve in enumerate(each)]
    factor = values.input(node, "Fac", groups)
    return (1 - factor) * colour + factor * np.stack(curved, axis=1)


def _vector_curves(values: Values, node, output, groups):
    node.mapping.initialize()
    vector, factor = values.input(node, "Vector", groups), values.input(node, "Fac", groups)
    curved = [_curve(node.mapping, curve)(vector[:, axis]) for axis, curve in enumerate(node.mapping.curves)]
    return (1 - factor) * vector + factor * np.stack(curved, axis=1)


def _float_curve(values: Values, node, output, groups):
    node.mapping.initialize()
    value, factor = values.input(node, "Value", groups), values.input(node, "Factor", groups)
    return (1 - factor) * value + factor * _curve(node.mapping, node.mapping.curves[0])(value)


def _curve(mapping, curve):
    """A function of numbers (m,) that follows a curve, and goes on behind its ends as that says."""
    places = np.linspace(curve.points[0].location[0], curve.points[-1].location[0], len(_TABLE))
    heights = np.array([mapping.evaluate(curve, place) for place in places])

    def of(numbers: np.ndarray) -> np.ndarray:
        found = np.interp(numbers, places, heights)
        if mapping.extend != "EXTRAPOLATED":
            return found
        for end, inner in ((0, 1), (-1, -2)):
            slope = (heights[end] - heights[inner]) / max(abs(places[end] - places[inner]), 1e-9) * (1 if end else -1)
            beyond = np.maximum(numbers - places[end], 0) if end else np.minimum(numbers - places[end], 0)
            found = found + slope * beyond
        return found

    return of


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
    return np.maximum((1 - factor) * colour + factor * to_rgb(shifted), 0)


#: how colours are taken apart and put together
_TAKEN_APART = {"RGB": lambda rgb: rgb, "HSV": to_hsv, "HSL": to_hsl}
_PUT_TOGETHER = {"RGB": lambda rgb: rgb, "HSV": to_rgb, "HSL": from_hsl}


def _mode(node) -> str:
    # Older nodes have it in their type.
    return "HSV" if node.bl_idname.endswith("HSV") else getattr(node, "mode", "RGB")


def _separate(values: Values, node, output, groups):
    parts = _TAKEN_APART[_mode(node)](values.input(node, node.inputs[0].identifier, groups))
    index = [other.identifier for other in node.outputs].index(output.identifier)
    return parts[:, index : index + 1]


def _combine(values: Values, node, output, groups):
    parts = [values.input(node, socket.identifier, groups) for socket in node.inputs[:3]]
    return _PUT_TOGETHER[_mode(node)](np.concatenate(np.broadcast_arrays(*parts), axis=1))


def _grey(values: Values, node, output, groups):
    return luminance(values.input(node, "Color", groups))


COLOUR_RULES = {
    "ShaderNodeMath": _math,
    "ShaderNodeVectorMath": _vector_math,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeMix": _mix,
    "ShaderNodeMixRGB": _mix_rgb,
    "ShaderNodeValToRGB": _ramp,
    "ShaderNodeRGBCurve": _curves,
    "ShaderNodeVectorCurve": _vector_curves,
    "ShaderNodeFloatCurve": _float_curve,
    "ShaderNodeVectorRotate": _vector_rotate,
    "ShaderNodeNormal": _normal,
    "ShaderNodeInvert": _invert,
    "ShaderNodeGamma": _gamma,
    "ShaderNodeBrightContrast": _bright_contrast,
    "ShaderNodeHueSaturation": _hue_saturation,
    "ShaderNodeRGBToBW": _grey,
    "ShaderNodeSeparateColor": _separate,
    "ShaderNodeSeparateXYZ": _separate,
    "ShaderNodeSeparateRGB": _separate,
    "ShaderNodeSeparateHSV": _separate,
    "ShaderNodeCombineColor": _combine,
    "ShaderNodeCombineXYZ": _combine,
    "ShaderNodeCombineRGB": _combine,
    "ShaderNodeCombineHSV": _combine,
}
