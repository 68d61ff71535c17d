"""Which emitters a point asks: ranges by the light that they may bring and have brought, within them by distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..sampling import choose_in_rows, running_shares
from .emitters import Emitters

#: Shares of the choice by what was learnt of the ranges' light; by their unshadowed light; by the same without cosine
#: (what stands low may shine although its middle does not); and by their power alone, so that no light is lost.
BY_LEARNT, BY_LIGHT, BY_STRENGTH, BY_POWER = 0.94, 0.04, 0.015, 0.005

#: Points count as lit by at least this share of what would come to them unshadowed.
LEAST_LIGHT = 0.05


@dataclass(frozen=True)
class EmitterChoice:
    """How each of K points chooses among C ranges of ``emitters``.

    points      (K, 3) m
    group       (K,) which of the groups that are worked on together, from 0
    begin, end  (G, C) the groups' ranges
    light       (K, C) about what each range would bring unshadowed
    share       (K, C) probability of each range
    ends        (K * C,) their running shares
    """

    emitters: Emitters
    points: np.ndarray
    group: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    light: np.ndarray
    share: np.ndarray
    ends: np.ndarray

    @classmethod
    def of(cls, emitters, points, group, begin, end, light, strength, learnt) -> EmitterChoice:
        """From unshadowed ``light`` and ``strength`` (K, C), and ``learnt`` (K, C), or None."""
        power = (emitters.power[end] - emitters.power[begin])[group]
        whole = light if learnt is None else light * learnt
        share = np.zeros_like(light)
        for part, weight in ((BY_LEARNT, whole), (BY_LIGHT, light), (BY_STRENGTH, strength), (BY_POWER, power)):
            total = weight.sum(axis=1, keepdims=True)
            share += np.divide(part * weight, total, out=np.zeros_like(weight), where=total > 0.0)
        share[power == 0.0] = 0.0
        share /= share.sum(axis=1, keepdims=True)
        return cls(emitters, points, group, begin, end, light, share, running_shares(share))

    def chosen(self, spot: np.ndarray, uniforms: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """For each ``spot`` (S,) an emitter by ``uniforms`` (S,): its number, the uniforms rescaled, its range's column
        and its probability, each (S,)."""
        columns = self.share.shape[1]
        place, rest = choose_in_rows(self.ends, columns, spot, uniforms)
        column, group = place - spot * columns, self.group[spot]
        begin, end = self.begin[group, column], self.end[group, column]
        found, rest, part = self.emitters.chosen(begin, end, rest, self.points[spot])
        return self.emitters.order[found], rest, column, self.share.ravel()[place] * part

    def scale(self, lit: np.ndarray) -> np.ndarray:
        """One over the light (K,) that counts at points where ``lit`` (K,) was found so far; 0 where there is none.

        A point that has hardly seen any is not to outweigh all the others of its group.
        """
        light = np.maximum(lit, LEAST_LIGHT * self.light.sum(axis=1))
        return np.divide(1.0, light, out=np.zeros_like(light), where=light > 0.0)

    def probability(self, spot: np.ndarray, emitter: np.ndarray) -> np.ndarray:
        """Probability (S,) with which each ``spot`` (S,) chooses that ``emitter`` (S,)."""
        place, group = self.emitters.place[emitter], self.group[spot]
        columns, count = self.begin.shape[1], len(self.emitters)
        # Empty ranges stand behind all emitters, and are found by none.
        starts = (self.begin + np.arange(len(self.begin))[:, None] * (count + 1)).ravel()
        column = np.searchsorted(starts, place + group * (count + 1), side="right") - 1 - group * columns
        begin, end = self.begin[group, column], self.end[group, column]
        return self.share[spot, column] * self.emitters.probability(begin, end, place, self.points[spot])
