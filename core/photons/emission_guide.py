"""Where lights send their particles: boxes of their emission's uniform numbers, each with a probability."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ..lights.light import EMISSION_DIMENSIONS


@dataclass(frozen=True)
class Draws:
    """What decides on P particles before they leave their lights.

    light     (P,) which light, ascending
    uniforms  (P, EMISSION_DIMENSIONS) in [0, 1)
    weight    (P,) the light's flux times this is what a particle stands for; 1 / (P times the light's share) by power
    density   (P,) probability of the choice over that by power alone
    """

    light: np.ndarray
    uniforms: np.ndarray
    weight: np.ndarray
    density: np.ndarray

    @staticmethod
    def joined(parts: list[Draws]) -> Draws:
        """All draws of ``parts`` in their order, so that the lights no longer ascend; ``parts`` holds at least one."""
        names = [field.name for field in fields(Draws)]
        return Draws(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


@dataclass(frozen=True)
class EmissionGuide:
    """A probability density over all lights' emission, constant within each of B boxes, which together fill all of it.

    light    (B,) which light, ascending
    lower    (B, EMISSION_DIMENSIONS) corner of the box in the light's unit cube, and ``upper``
    natural  (B,) probability of the box by power alone: the light's share of the power times the box's volume
    chance   (B,) probability of the box, > 0 wherever ``natural`` is; both add up to 1
    """

    light: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    natural: np.ndarray
    chance: np.ndarray

    @classmethod
    def by_shares(cls, shares: np.ndarray) -> EmissionGuide:
        """Each light with its share (J,) of the particles, uniform within it."""
        corner = np.zeros((len(shares), EMISSION_DIMENSIONS))
        return cls(np.arange(len(shares)), corner, corner + 1.0, shares, shares)

    def draws(self, particles: int, generator: np.random.Generator) -> Draws:
        """Choose ``particles`` by systematic sampling, so that each box's count is exact to one.

        In a box the first of the uniform numbers is stratified and ascends: bright places gain, and tables are looked
        up in order.
        """
        sums, offset = np.cumsum(self.chance), generator.random()
        uniforms = generator.random((particles, EMISSION_DIMENSIONS))
        box, uniforms = self._drawn(sums, offset, uniforms)
        density = self.chance / self.natural
        shares = np.bincount(self.light, self.natural)
        weight = 1.0 / (particles * shares[self.light] * density)
        return Draws(self.light.take(box), uniforms, weight.take(box), density.take(box))

    def _drawn(self, sums: np.ndarray, offset: float, uniforms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The particles' boxes (P,), whose running ``sums`` (B,) these are, and uniform numbers (P, 4) within them."""
        particles = len(uniforms)
        box = np.searchsorted(sums[:-1], (np.arange(particles) + offset) / particles, side="right")
        count = np.bincount(box, minlength=len(self.light))
        rank = np.arange(particles) - (np.cumsum(count) - count).take(box)
        uniforms[:, 0] = (rank + uniforms[:, 0]) / count.take(box)
        if not self.lower.any() and (self.upper == 1.0).all():
            return box, np.minimum(uniforms, _BELOW_ONE, out=uniforms)
        lower = self.lower.take(box, axis=0)
        # Doubly rounded, a number just below one could reach the box's upper end.
        return box, np.minimum(lower + uniforms * (self.upper.take(box, axis=0) - lower), _BELOW_ONE)


#: The largest float64 below one.
_BELOW_ONE = np.nextafter(1.0, 0.0)
