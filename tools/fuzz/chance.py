"""Random choices that are the same for the same seed, and setting Blender's properties to whatever comes of them."""

from __future__ import annotations

import math
import random
from contextlib import suppress

import numpy as np

#: numbers that break things: nothing, tiny, denormal in float32, huge, beyond float32's square, and no numbers at all
ODD_NUMBERS = (0.0, -0.0, -1.0, 1e-45, 1e-38, 1e-20, 1e-6, 1e6, 1e19, -1e19, 1e30, 3e38, -3e38, math.inf, math.nan)

#: what Blender raises when it does not take a value, or this version does not have the property
REFUSALS = (TypeError, ValueError, OverflowError, AttributeError, RuntimeError, KeyError)


class Chance:
    """The random choices of one scene. ``oddness`` is the share of numbers that are odd; some scenes have none."""

    def __init__(self, seed: int):
        self._random = random.Random(f"fuzz {seed}")
        self.arrays = np.random.default_rng(seed)
        self.oddness = self.one_of(0.0, 0.01, 0.01, 0.05, 0.05, 0.3)

    def likely(self, share: float) -> bool:
        """True in that share of calls."""
        return self._random.random() < share

    def one_of(self, *things):
        """One of ``things``, each as likely."""
        return self._random.choice(things)

    def some_of(self, things, most: int) -> list:
        """Up to ``most`` different ones of ``things``."""
        things = list(things)
        return self._random.sample(things, min(self.count(0, most), len(things)))

    def count(self, low: int, high: int) -> int:
        """A whole number, both ends included."""
        return self._random.randint(low, high)

    def between(self, low: float, high: float) -> float:
        """A number between two sane ones."""
        return self._random.uniform(low, high)

    def number(self, low: float, high: float) -> float:
        """A number between two sane ones, or an odd one."""
        return self.one_of(*ODD_NUMBERS) if self.likely(self.oddness) else self.between(low, high)

    def numbers(self, size: int, low: float, high: float) -> tuple[float, ...]:
        """Several of :meth:`number`."""
        return tuple(self.number(low, high) for _ in range(size))

    def rows(self, shape: tuple[int, ...], low: float, high: float) -> np.ndarray:
        """An array of sane numbers, some of which are odd in odd scenes."""
        values = self.arrays.uniform(low, high, shape)
        odd = self.arrays.random(shape) < self.oddness / 4
        values[odd] = self.arrays.choice(ODD_NUMBERS, int(odd.sum()))
        return values


def put(owner, name: str, value) -> None:
    """Set a property if Blender takes the value and this version has the property."""
    if hasattr(owner, name):
        with suppress(*REFUSALS):
            setattr(owner, name, value)


def shuffle(owner, chance: Chance, share: float = 0.5, without: tuple[str, ...] = ()) -> None:
    """Set a ``share`` of the plain properties of a data-block, node or modifier to anything they can be."""
    for prop in owner.bl_rna.properties:
        if prop.is_readonly or prop.identifier in without or not chance.likely(share):
            continue
        if prop.type == "BOOLEAN" and not prop.is_array:
            put(owner, prop.identifier, chance.likely(0.5))
        elif prop.type == "ENUM" and not prop.is_enum_flag and len(prop.enum_items):
            put(owner, prop.identifier, chance.one_of(*(item.identifier for item in prop.enum_items)))
        elif prop.type == "FLOAT":
            values = chance.numbers(max(prop.array_length, 1), max(prop.soft_min, -10.0), min(prop.soft_max, 10.0))
            put(owner, prop.identifier, values if prop.is_array else values[0])
