"""Blend modes, hue and saturation as Blender's colour nodes compute them; NumPy only."""

from __future__ import annotations

import numpy as np


def _overlay(a, b, f):
    low = a * (1 - f + 2 * f * b)
    high = 1 - (1 - f + 2 * f * (1 - b)) * (1 - a)
    return np.where(a < 0.5, low, high)


def _soft_light(a, b, f):
    screen = 1 - (1 - b) * (1 - a)
    return (1 - f) * a + f * ((1 - a) * b * a + a * screen)


def _dodge(a, b, f):
    rest = 1 - f * b
    return np.where(a == 0, 0, np.where(rest <= 0, 1, np.minimum(a / np.where(rest <= 0, 1, rest), 1)))


def _burn(a, b, f):
    rest = 1 - f + f * b
    return np.where(rest <= 0, 0, np.clip(1 - (1 - a) / np.where(rest <= 0, 1, rest), 0, 1))


def _of_parts(taken: tuple[int, ...], grey_keeps: bool):
    """A mix that takes those of hue, saturation and value from b; ``grey_keeps``: unless b is grey."""

    def mixed(a, b, f):
        a, b, f = np.broadcast_arrays(a, b, f)
        first, second = to_hsv(a), to_hsv(b)
        if grey_keeps:
            changed = first.copy()
            changed[:, taken] = second[:, taken]
            return np.where(second[:, 1:2] != 0, (1 - f) * a + f * to_rgb(changed), a)
        changed = first.copy()
        changed[:, taken] = ((1 - f) * first + f * second)[:, taken]
        return np.where((first[:, 1:2] != 0) | (taken == (2,)), to_rgb(changed), a)

    return mixed


#: blend mode -> colour of a and b mixed by the factor f
BLENDS = {
    "MIX": lambda a, b, f: (1 - f) * a + f * b,
    "ADD": lambda a, b, f: a + f * b,
    "SUBTRACT": lambda a, b, f: a - f * b,
    "MULTIPLY": lambda a, b, f: a * (1 - f + f * b),
    "SCREEN": lambda a, b, f: 1 - (1 - f + f * (1 - b)) * (1 - a),
    "OVERLAY": _overlay,
    "DIVIDE": lambda a, b, f: np.where(b == 0, a, (1 - f) * a + f * a / np.where(b == 0, 1, b)),
    "DIFFERENCE": lambda a, b, f: (1 - f) * a + f * np.abs(a - b),
    "EXCLUSION": lambda a, b, f: np.maximum((1 - f) * a + f * (a + b - 2 * a * b), 0),
    "DARKEN": lambda a, b, f: (1 - f) * a + f * np.minimum(a, b),
    "LIGHTEN": lambda a, b, f: (1 - f) * a + f * np.maximum(a, b),
    "LINEAR_LIGHT": lambda a, b, f: a + f * (2 * b - 1),
    "SOFT_LIGHT": _soft_light,
    "DODGE": _dodge,
    "BURN": _burn,
    "HUE": _of_parts((0,), True),
    "COLOR": _of_parts((0, 1), True),
    "SATURATION": _of_parts((1,), False),
    "VALUE": _of_parts((2,), False),
}


def to_hsv(rgb: np.ndarray) -> np.ndarray:
    """Hue, saturation and value (m, 3) of linear RGB (m, 3)."""
    value = rgb.max(axis=1)
    span = value - rgb.min(axis=1)
    safe = np.where(span == 0, 1, span)
    r, g, b = rgb.T
    hue = np.where(value == r, (g - b) / safe, np.where(value == g, 2 + (b - r) / safe, 4 + (r - g) / safe))
    saturation = np.where(value == 0, 0, span / np.where(value == 0, 1, value))
    return np.stack([np.where(span == 0, 0, hue / 6) % 1.0, saturation, value], axis=1)


def to_rgb(hsv: np.ndarray) -> np.ndarray:
    """Linear RGB (m, 3) of hue, saturation and value (m, 3)."""
    sixths = 6.0 * (hsv[:, 0] % 1.0)
    ramps = np.stack([np.abs(sixths - 3) - 1, 2 - np.abs(sixths - 2), 2 - np.abs(sixths - 4)], axis=1)
    return ((np.clip(ramps, 0, 1) - 1) * hsv[:, 1:2] + 1) * hsv[:, 2:]


def to_hsl(rgb: np.ndarray) -> np.ndarray:
    """Hue, saturation and lightness (m, 3) of linear RGB (m, 3)."""
    most, least = rgb.max(axis=1), rgb.min(axis=1)
    lightness, span = np.minimum(0.5 * (most + least), 1.0), most - least
    whole = np.where(lightness > 0.5, 2.0 - most - least, most + least)
    saturation = np.where((span == 0) | (whole == 0), 0, span / np.where(whole == 0, 1, whole))
    return np.stack([to_hsv(rgb)[:, 0], saturation, lightness], axis=1)


def from_hsl(hsl: np.ndarray) -> np.ndarray:
    """Linear RGB (m, 3) of hue, saturation and lightness (m, 3)."""
    pure = to_rgb(np.concatenate([hsl[:, :1], np.ones((len(hsl), 2))], axis=1))
    chroma = (1 - np.abs(2 * hsl[:, 2:] - 1)) * hsl[:, 1:2]
    return (pure - 0.5) * chroma + hsl[:, 2:]
