"""Many emitters in an order in which neighbours stand together, so that ranges of them can be looked at as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..lights.area import AreaLight
from ..lights.emissive import EmissiveTriangles
from ..lights.light import Light
from ..lights.sun import SunLight
from ..sampling import BELOW_ONE
from .emitter_ranges import Ranges

#: A difference between unit normals counts as much as that share of the emitters' extent.
NORMAL_WEIGHT = 0.25

#: So does a power of ten in their strengths, down to that share of the strongest.
POWER_WEIGHT, LEAST_POWER = 0.25, 1e-6

#: Share of the way down the tree that goes by power alone, so that no light is lost; and the least chance of a half.
BY_POWER, LEAST_CHANCE = 0.05, 1e-9

# Columns of the running sums: power, power times place (3) and its square with the extent's, and power by how it
# shines: alike in all directions, along an axis (3), to both sides of a plane (the products of its normal, 3 by 3).
_POWER, _PLACE, _SQUARE, _EVEN, _AXIS, _PLANE = 0, slice(1, 4), 4, 5, slice(6, 9), slice(9, 18)


@dataclass(frozen=True)
class Emitters:
    """E emitters of E > 0.

    order   (E,) their numbers, neighbours together: halves of the order, halves of those and so on lie close together
    placed  how many of the order have a place; the rest are distant
    power   (E + 1,) running sum of their powers in that order
    """

    order: np.ndarray
    placed: int
    power: np.ndarray
    _sums: np.ndarray
    _middle: np.ndarray

    @classmethod
    def of_triangles(cls, light: EmissiveTriangles) -> Emitters:
        """Triangles, each as strong as its strongest channel times its area."""
        power, places, normals = light.chances, light.corners.mean(axis=1), light.normals
        extent = ((light.corners - places[:, None]) ** 2).sum(axis=2).mean(axis=1) / 4.0
        columns = np.zeros((len(power), 18))
        columns[:, _PLANE] = (normals[:, :, None] * normals[:, None, :]).reshape(-1, 9)
        # Both sides of a triangle shine: of its normals the one that points up will do.
        upward = normals * np.copysign(1.0, normals @ (0.48, 0.6, 0.64))[:, None]
        return cls._of(places, upward, power, extent, columns, np.zeros(len(power), bool))

    @classmethod
    def of_lamps(cls, lamps: Sequence[Light]) -> Emitters:
        """Lamps, each as strong as its flux over 4 pi tells, suns by their irradiance."""
        columns, places, axes = np.zeros((len(lamps), 18)), np.zeros((len(lamps), 3)), np.zeros((len(lamps), 3))
        power, extent, distant = np.zeros(len(lamps)), np.zeros(len(lamps)), np.zeros(len(lamps), bool)
        for row, lamp in enumerate(lamps):
            if isinstance(lamp, SunLight):
                power[row], places[row], distant[row] = np.abs(lamp.irradiance).sum(), -lamp.direction, True
            elif isinstance(lamp, AreaLight):
                power[row], places[row], axes[row] = np.abs(lamp.power).sum() / np.pi, lamp.centre, lamp.normal
                extent[row] = (lamp.edge_u @ lamp.edge_u + lamp.edge_v @ lamp.edge_v) / 12.0
                columns[row, _AXIS] = lamp.normal
            else:
                power[row], places[row] = np.abs(lamp.power).sum() / (4.0 * np.pi), lamp.position
                extent[row] = 0.5 * lamp.radius**2
                columns[row, _EVEN] = 1.0
        return cls._of(places, axes, power, extent, columns, distant)

    @classmethod
    def _of(cls, places, axes, power, extent, columns, distant) -> Emitters:
        if power.sum() == 0.0:
            power = np.ones(len(power))  # nothing shines, and any choice is right
        near = np.flatnonzero(~distant)
        size = np.ptp(places[near], axis=0).max() if len(near) else 0.0
        # Counted from their middle, so that squares keep their digits however far out the scene lies.
        middle = places[near].mean(axis=0) if len(near) else np.zeros(3)
        places = np.where(distant[:, None], places, places - middle)
        # Where weak and strong ones stand side by side, ranges would hide the weak ones from who is close to them.
        strength = np.log10(np.maximum(power / power.max(), LEAST_POWER))[:, None]
        kept = np.concatenate([places, NORMAL_WEIGHT * size * axes, POWER_WEIGHT * size * strength], axis=1)
        order = np.concatenate([near[halved(kept[near])], np.flatnonzero(distant)])
        columns[:, _POWER], columns[:, _PLACE] = 1.0, places
        columns[:, _SQUARE] = (places**2).sum(axis=1) + extent
        columns *= power[:, None]
        sums = np.concatenate([np.zeros((1, 18)), np.cumsum(columns[order], axis=0)])
        return cls(order, len(near), sums[:, _POWER].copy(), sums, middle)

    def __len__(self) -> int:
        return len(self.order)

    @cached_property
    def place(self) -> np.ndarray:
        """Where (E,) in the order each emitter stands."""
        place = np.empty_like(self.order)
        place[self.order] = np.arange(len(place))
        return place

    def ranges(self, begin: np.ndarray, end: np.ndarray) -> Ranges:
        """What stands in the order from ``begin`` to before ``end`` (...), all with a place or all without."""
        sums = self._sums[end] - self._sums[begin]
        power = np.maximum(sums[..., _POWER], 0.0)
        share = 1.0 / np.where(power > 0.0, power, 1.0)
        centre = sums[..., _PLACE] * share[..., None]
        spread = np.maximum(sums[..., _SQUARE] * share - np.einsum("...i,...i->...", centre, centre), 0.0)
        plane = sums[..., _PLANE].reshape(*power.shape, 3, 3)
        distant = begin >= self.placed
        centre = np.where(distant[..., None], centre, centre + self._middle)
        return Ranges(power, centre, spread, np.maximum(sums[..., _EVEN], 0.0), sums[..., _AXIS], plane, distant)

    def chosen(
        self, begin: np.ndarray, end: np.ndarray, uniforms: np.ndarray, places: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """One emitter of each range (S,), by ``uniforms`` (S,), for light at ``places`` (S, 3).

        That goes down the tree of halves, to either by what it may bring there. Returns where in the order it stands,
        the uniforms rescaled, and its probability, each (S,).
        """
        begin, end, rest = begin.copy(), end.copy(), uniforms.copy()
        probability = np.ones(len(begin))
        while len(rows := np.flatnonzero(end - begin > 1)):
            middle, first = self._first_half(begin[rows], end[rows], places[rows])
            later = rest[rows] >= first
            share = np.where(later, 1.0 - first, first)
            rest[rows] = (rest[rows] - np.where(later, first, 0.0)) / share
            probability[rows] *= share
            begin[rows], end[rows] = np.where(later, middle, begin[rows]), np.where(later, end[rows], middle)
        return begin, np.clip(rest, 0.0, BELOW_ONE), probability

    def probability(self, begin: np.ndarray, end: np.ndarray, found: np.ndarray, places: np.ndarray) -> np.ndarray:
        """With which :meth:`chosen` finds what stands at ``found`` (S,) in the order, of those ranges (S,)."""
        begin, end = begin.copy(), end.copy()
        probability = np.ones(len(begin))
        while len(rows := np.flatnonzero(end - begin > 1)):
            middle, first = self._first_half(begin[rows], end[rows], places[rows])
            later = found[rows] >= middle
            probability[rows] *= np.where(later, 1.0 - first, first)
            begin[rows], end[rows] = np.where(later, middle, begin[rows]), np.where(later, end[rows], middle)
        return probability

    def _first_half(self, begin, end, places) -> tuple[np.ndarray, np.ndarray]:
        """Where the second halves of ranges (S,) begin, and the probability (S,) of the first, strictly within 0..1."""
        middle = begin + (end - begin) // 2
        low, high = self._bright(begin, middle, places), self._bright(middle, end, places)
        first, whole = low[0] + high[0], low[1] + high[1]
        by_light = np.divide(low[1], whole, out=np.full_like(whole, 0.5), where=whole > 0.0)
        by_power = np.divide(low[0], first, out=np.full_like(first, 0.5), where=first > 0.0)
        return middle, np.clip(by_light + BY_POWER * (by_power - by_light), LEAST_CHANCE, 1.0 - LEAST_CHANCE)

    def _bright(self, begin, end, places) -> tuple[np.ndarray, np.ndarray]:
        """The power of ranges (S,), and that over the squared distance from ``places`` (S, 3); as it is if distant."""
        sums = self._sums[end, :_EVEN] - self._sums[begin, :_EVEN]
        power = np.maximum(sums[:, _POWER], 0.0)
        share = 1.0 / np.where(power > 0.0, power, 1.0)
        # Their mean squared distance, which is that of the centre and the spread about it.
        away = places - self._middle
        square = sums[:, _SQUARE] * share - 2.0 * np.einsum("ij,ij->i", sums[:, _PLACE], away) * share
        square += np.einsum("ij,ij->i", away, away)
        least = LEAST_CHANCE * np.einsum("ij,ij->i", away, away) + np.finfo(float).tiny
        return power, np.where(begin >= self.placed, power, power / np.maximum(square, least))


def halved(places: np.ndarray) -> np.ndarray:
    """Rows (E,) of ``places`` (E, D) in an order whose halves, and halves of halves, are cut across what differs most.

    A range of c rows is cut behind its first c // 2.
    """
    order, start = np.arange(len(places)), np.array([0])
    count = np.array([len(places)])
    while len(count) and (count > 1).any():
        held = places[order]
        most, least = (extreme.reduceat(held, start, axis=0) for extreme in (np.maximum, np.minimum))
        owner = np.repeat(np.arange(len(start)), count)
        along = np.take_along_axis(held, (most - least).argmax(axis=1)[owner, None], axis=1)[:, 0]
        order = order[np.lexsort((along, owner))]
        half = count // 2
        start = np.stack([start, start + half], axis=1).ravel()
        count = np.stack([half, count - half], axis=1).ravel()
        start, count = start[count > 0], count[count > 0]
    return order
