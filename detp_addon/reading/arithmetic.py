"""Arithmetic on numbers and vectors as Blender's math nodes compute it; NumPy only."""

from __future__ import annotations

import numpy as np

#: the smallest difference that a comparison of single numbers tells
_EPSILON = float(np.finfo(np.float32).eps)


def _power(a, b):
    # A negative base has a value for whole exponents only; the others count as 0, as in Cycles.
    real = (a >= 0) | (b == np.round(b))
    with np.errstate(all="ignore"):
        return np.nan_to_num(np.where(real, np.power(np.where(real, a, 1.0), b), 0.0), posinf=0.0, neginf=0.0)


def _divided(a, b):
    return np.where(b == 0, 0, a / np.where(b == 0, 1, b))


def _logarithm(a, b):
    positive = (a > 0) & (b > 0)
    return np.where(positive, _divided(np.log(np.where(positive, a, 1.0)), np.log(np.where(positive, b, 1.0))), 0.0)


def _wrapped(a, high, low):
    span = high - low
    return np.where(span == 0, low, a - span * np.floor(_divided(a - low, span)))


def _ping_pong(a, b):
    share = _divided(a - b, 2 * b)
    return np.where(b == 0, 0, np.abs((share - np.floor(share)) * 2 * b - b))


def _smooth_minimum(a, b, c):
    reach = _divided(np.maximum(c - np.abs(a - b), 0), c)
    return np.minimum(a, b) - reach**3 * c / 6


#: what numbers and vectors have in common, of up to three of them
_COMMON = {
    "ADD": lambda a, b, c: a + b,
    "SUBTRACT": lambda a, b, c: a - b,
    "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: _divided(a, b),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: _power(a, b),
    "MINIMUM": lambda a, b, c: np.minimum(a, b),
    "MAXIMUM": lambda a, b, c: np.maximum(a, b),
    "SIGN": lambda a, b, c: np.sign(a),
    "FLOOR": lambda a, b, c: np.floor(a),
    "CEIL": lambda a, b, c: np.ceil(a),
    "ROUND": lambda a, b, c: np.floor(a + 0.5),
    "MODULO": lambda a, b, c: np.where(b == 0, 0, np.fmod(a, np.where(b == 0, 1, b))),
    "WRAP": _wrapped,
    "SNAP": lambda a, b, c: np.floor(_divided(a, b)) * b,
    "SINE": lambda a, b, c: np.sin(a),
    "COSINE": lambda a, b, c: np.cos(a),
    "TANGENT": lambda a, b, c: np.tan(a),
    "ABSOLUTE": lambda a, b, c: np.abs(a),
}

#: arithmetic on up to three numbers
MATH = {
    **_COMMON,
    "SQRT": lambda a, b, c: np.sqrt(np.maximum(a, 0)),
    "INVERSE_SQRT": lambda a, b, c: np.where(a > 0, 1 / np.sqrt(np.where(a > 0, a, 1)), 0),
    "LOGARITHM": lambda a, b, c: _logarithm(a, b),
    "EXPONENT": lambda a, b, c: np.exp(a),
    "LESS_THAN": lambda a, b, c: (a < b) * 1.0,
    "GREATER_THAN": lambda a, b, c: (a > b) * 1.0,
    "COMPARE": lambda a, b, c: ((a == b) | (np.abs(a - b) <= np.maximum(c, _EPSILON))) * 1.0,
    "SMOOTH_MIN": _smooth_minimum,
    "SMOOTH_MAX": lambda a, b, c: -_smooth_minimum(-a, -b, c),
    "TRUNC": lambda a, b, c: np.trunc(a),
    "FRACT": lambda a, b, c: a - np.floor(a),
    "FLOORED_MODULO": lambda a, b, c: np.where(b == 0, 0, a - np.floor(_divided(a, b)) * b),
    "PINGPONG": lambda a, b, c: _ping_pong(a, b),
    "ARCSINE": lambda a, b, c: np.arcsin(np.clip(a, -1, 1)),
    "ARCCOSINE": lambda a, b, c: np.arccos(np.clip(a, -1, 1)),
    "ARCTANGENT": lambda a, b, c: np.arctan(a),
    "ARCTAN2": lambda a, b, c: np.arctan2(a, b),
    "SINH": lambda a, b, c: np.sinh(a),
    "COSH": lambda a, b, c: np.cosh(a),
    "TANH": lambda a, b, c: np.tanh(a),
    "RADIANS": lambda a, b, c: np.radians(a),
    "DEGREES": lambda a, b, c: np.degrees(a),
}


def dot(a, b):
    """Dot products (m, 1) of vectors (m or 1, 3)."""
    return (a * b).sum(axis=1, keepdims=True)


def length(a):
    """Lengths (m, 1) of vectors (m, 3)."""
    return np.sqrt(dot(a, a))


def unit(a):
    """Vectors (m, 3) at unit length, zero where they have none."""
    return _divided(a, length(a))


def _cross(a, b):
    return np.cross(*np.broadcast_arrays(a, b))


def refracted(a, b, ratio):
    """The vectors ``a`` (m, 3) refracted at surfaces along ``b`` (m, 3), zero where all is reflected."""
    along = dot(unit(b), a)
    left = 1 - ratio**2 * (1 - along**2)
    return np.where(left < 0, 0, ratio * a - (ratio * along + np.sqrt(np.maximum(left, 0))) * unit(b))


#: arithmetic on up to three vectors; what gives numbers has (m, 1)
VECTOR_MATH = {
    **_COMMON,
    "CROSS_PRODUCT": lambda a, b, c: _cross(a, b),
    "PROJECT": lambda a, b, c: _divided(dot(a, b), dot(b, b)) * b,
    "REFLECT": lambda a, b, c: a - 2 * unit(b) * dot(a, unit(b)),
    "FACEFORWARD": lambda a, b, c: np.where(dot(c, b) < 0, a, -a),
    "NORMALIZE": lambda a, b, c: unit(a),
    "FRACTION": lambda a, b, c: a - np.floor(a),
    "DOT_PRODUCT": lambda a, b, c: dot(a, b),
    "DISTANCE": lambda a, b, c: length(a - b),
    "LENGTH": lambda a, b, c: length(a),
}


def smooth(kind: str, share):
    """The ``share`` of the way as a map of ranges goes it, which is of that ``kind``."""
    share = np.clip(share, 0, 1)
    if kind == "SMOOTHSTEP":
        return (3 - 2 * share) * share**2
    return share**3 * (share * (share * 6 - 15) + 10)


def turned(vector, axis, angle):
    """Vectors (m, 3) turned about ``axis`` (m or 1, 3), none where it is zero, by ``angle`` (m or 1, 1) radians."""
    axis, cosine, sine = unit(axis), np.cos(angle), np.sin(angle)
    found = vector * cosine + _cross(axis, vector) * sine + axis * dot(axis, vector) * (1 - cosine)
    return np.where(length(axis) > 0, found, vector)
