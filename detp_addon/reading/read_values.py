"""Evaluates the colours and numbers that shader nodes make, for many places of a surface at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np

from .read_node_graph import Feed, feed_of, find_input
from .remembered import Remembered
from .working_space import luminance

#: coordinates of which nothing is known: an image is then taken as its mean
UNKNOWN = np.full((1, 3), np.nan)


Mixed = TypeVar("Mixed")


class Places(Protocol):
    """Where nodes are evaluated: m places on a surface, or (m = 1) nowhere in particular.

    real            whether the values are those of the scene, and not stand-ins
    back            whether the surface is met from behind
    cosine          of the angle to its normal at which it is met
    material_index  the pass index of its material
    half            what stands for a number that is one at half of each place, and zero at the other
    """

    real: bool
    back: bool
    cosine: float
    material_index: float
    half: float

    def ray(self, output: str) -> float | None:
        """What a Light Path node tells of the rays that come there; None when it varies."""
        ...

    def given(self, kind: str, name: str = "") -> np.ndarray:
        """What the mesh or its object gives there (m, c), see read_attributes.py and placed_values.py."""
        ...

    def coarser_than(self, coordinates: np.ndarray, size: float) -> np.ndarray | bool:
        """Whether (m or 1, 1) places lie farther apart than ``size`` in those ``coordinates`` (m, 3)."""
        ...

    def image(self, node, coordinates: np.ndarray, alpha: bool) -> np.ndarray:
        """Colour (m, 3), or ``alpha`` (m, 1), of an image texture node."""
        ...

    def unknown(self, feature: str) -> None:
        """A node was met whose work is not known; it counts as its stand-in."""
        ...

    def about(self, feature: str) -> None:
        """A value varies, and what it mostly is stands for it."""
        ...


class Values:
    """The values of node sockets at some ``places``: numbers as (m or 1, 1), colours and vectors as (m or 1, 3).

    ``rules`` maps a node's type to a function (values, node, output, groups) that gives the output's value, or None
    when it cannot; the input that it feeds then keeps the value set in its own socket.
    """

    def __init__(self, places: Places, rules: dict):
        self.places = places
        self._rules = rules
        self._known = Remembered(in_a_loop=None)

    def input(self, node, identifier: str, groups: tuple) -> np.ndarray:
        """The value of an input, converted to the input's type."""
        socket = find_input(node, identifier)
        feed = feed_of(socket, groups)
        value = self._value(feed)
        return constant(socket) if value is None else _arrived(value, feed, socket.type)

    def colour(self, feed: Feed) -> np.ndarray:
        """What ``feed`` gives as a colour, black when that is not known."""
        value = self._value(feed)
        return np.zeros((1, 3)) if value is None else _arrived(value, feed, "RGBA")

    def mixed(self, factor: np.ndarray, first: Callable[[], Mixed], second: Callable[[], Mixed], mix) -> Mixed:
        """``mix(first(), second())``, or the one of them that a ``factor`` of 0 or 1 leaves: the other is not seen."""
        if self.places.real and not factor.any():
            return first()
        if self.places.real and (factor == 1).all():
            return second()
        return mix(first(), second())

    def linked(self, node, identifier: str, groups: tuple) -> bool:
        """Whether the input's value comes from elsewhere."""
        socket = find_input(node, identifier)
        return socket is not None and feed_of(socket, groups).given

    def fixed(self, node, identifier: str, groups: tuple) -> np.ndarray | None:
        """The value of an input that no node decides; None where one does."""
        feed = feed_of(find_input(node, identifier), groups)
        return None if feed.node is not None else self.input(node, identifier, groups)

    def _value(self, feed: Feed) -> np.ndarray | None:
        if feed.node is None:
            return np.zeros((1, 1)) if feed.empty else constant(feed.socket)
        return self._known.of(feed.key, lambda: self._evaluated(feed))

    def _evaluated(self, feed: Feed) -> np.ndarray | None:
        rule = self._rules.get(feed.node.bl_idname)
        value = rule(self, feed.node, feed.socket, feed.groups) if rule else None
        if value is None:
            self.places.unknown(described(feed.node))
        return value


def _arrived(value: np.ndarray, feed: Feed, target: str) -> np.ndarray:
    """What becomes of the ``value`` of a ``feed`` on its way to an input of the type ``target``."""
    source = feed.socket.type
    for kind in (*feed.passed, target):
        value, source = converted(value, source, kind), kind
    return value


def constant(socket) -> np.ndarray:
    """The value set in a socket: (1, 1) for numbers, (1, 3) for colours and vectors."""
    value = getattr(socket, "default_value", 0.0)
    if socket.type in ("RGBA", "VECTOR"):
        return np.array(value, dtype=np.float64)[None, :3]
    return np.array([[float(value)]]) if isinstance(value, (int, float, bool)) else np.zeros((1, 1))


def converted(value: np.ndarray, source: str, target: str) -> np.ndarray:
    """``value`` of the socket type ``source`` as Cycles hands it to an input of the type ``target``."""
    wide = target in ("RGBA", "VECTOR")
    if wide:
        return np.repeat(value, 3, axis=1) if value.shape[1] == 1 else value
    if value.shape[1] > 1:
        value = luminance(value) if source == "RGBA" else value.mean(axis=1, keepdims=True)
    return np.trunc(value) if target in ("INT", "BOOLEAN") else value


def described(node) -> str:
    """A node's name for people."""
    kind = getattr(node, "operation", None) or getattr(node, "blend_type", None) or getattr(node, "sky_type", None)
    label = node.bl_label or node.bl_idname
    return f"{label} ({kind.replace('_', ' ').lower()})" if kind else label
