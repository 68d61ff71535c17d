"""A tree of boxes over all lights' emission that grows where particles were of use, and the aim that follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..lights.light import EMISSION_DIMENSIONS
from .emission_guide import Draws, EmissionGuide

#: A box is halved while so many particles of use lie in it, and at most so often.
LEAST_USEFUL = 12
DEEPEST = 40


@dataclass(frozen=True)
class Leaves:
    """The tree's boxes, and what a pilot's particles in each of them did.

    boxes      as if by power alone (see EmissionGuide)
    use, cost  (B, 2) integrals over the box, for particles emitted by power alone, of their squared use and of their
               cost: as the particles found them that the tree grew from, and as the others did
    """

    boxes: EmissionGuide
    use: np.ndarray
    cost: np.ndarray

    def guide(self, defensive: float) -> EmissionGuide:
        """The density that makes the noise least for its cost; the share ``defensive`` of it stays by power alone.

        With I the integral of the squared use, c the mean cost and m the natural probability of a box, noise and cost
        are the sums of I m / P and P c over the boxes: their product is least for P in proportion to sqrt(I m / c).
        """
        natural = self.boxes.natural
        mean_cost = self.cost[:, 0] / natural
        useful = (self.use[:, 0] > 0) & (mean_cost > 0)
        learnt = np.sqrt(np.where(useful, self.use[:, 0] * natural / np.where(useful, mean_cost, 1.0), 0.0))
        chance = defensive * natural + (1.0 - defensive) * learnt / learnt.sum()
        return EmissionGuide(self.boxes.light, self.boxes.lower, self.boxes.upper, natural, chance / chance.sum())

    def gain(self, guide: EmissionGuide) -> float:
        """How many times less noise times cost there is with ``guide``, from particles the tree did not grow from."""
        density = guide.chance / guide.natural
        use, cost = self.use[:, 1], self.cost[:, 1]
        after = float((use / density).sum() * (cost * density).sum())
        return float(use.sum() * cost.sum()) / after if after > 0.0 else 1.0


def grown(draws: Draws, use: np.ndarray, cost: np.ndarray, others: np.ndarray, natural: EmissionGuide) -> Leaves:
    """A tree over the lights' unit cubes from P particles with their squared ``use`` (P,) and ``cost`` (P,).

    ``others`` (P,) marks particles that do not help it grow but are counted apart. Every box is halved in the middle of
    the side that tells use from no use best, by the sum of the halves' square roots, to which the noise is in
    proportion.
    """
    group = others.astype(np.int64)
    # A particle stands for one over its density of those by power alone, and its squared use for its square.
    parts = max(len(use) - int(others.sum()), 1), max(int(others.sum()), 1)
    share = 1.0 / np.array(parts, float)[group]
    live = _Particles(
        draws.light.astype(np.int64), draws.uniforms, group, use * draws.density * share, cost / draws.density * share
    )
    light, lower, upper, volume = natural.light, natural.lower, natural.upper, natural.natural
    leaves = []
    for depth in range(DEEPEST + 1):
        count = len(light)
        middle = 0.5 * (lower + upper)
        above = live.uniforms >= middle.take(live.node, axis=0)
        grows = live.group == 0
        useful = np.bincount(live.node[grows & (live.use > 0)], minlength=count)
        split = (useful >= LEAST_USEFUL) & (depth < DEEPEST)
        leaves.append([light, lower, upper, volume, live.sums(live.use, count), live.sums(live.cost, count)])
        leaves[-1] = [array[~split] for array in leaves[-1]]
        if not split.any():
            break
        axis = _best_axis(live, above, grows, count)[split]
        number = np.cumsum(split) - 1
        rows = np.flatnonzero(split[live.node])
        live, above = live.taken(rows), above[rows]
        parent = number[live.node]
        live.node = 2 * parent + above[np.arange(len(rows)), axis[parent]]
        light, volume = np.repeat(light[split], 2), np.repeat(0.5 * volume[split], 2)
        each = np.arange(len(axis))
        lower, upper, cut = np.repeat(lower[split], 2, axis=0), np.repeat(upper[split], 2, axis=0), middle[split]
        upper[2 * each, axis] = lower[2 * each + 1, axis] = cut[each, axis]
    light, lower, upper, volume, use, cost = (np.concatenate(arrays) for arrays in zip(*leaves, strict=True))
    order = np.argsort(light, kind="stable")
    boxes = EmissionGuide(light[order], lower[order], upper[order], volume[order], volume[order])
    return Leaves(boxes, use[order], cost[order])


@dataclass
class _Particles:
    """Particles on their way down the tree: which ``node`` each is in, its numbers, group, use and cost."""

    node: np.ndarray
    uniforms: np.ndarray
    group: np.ndarray
    use: np.ndarray
    cost: np.ndarray

    def taken(self, rows: np.ndarray) -> _Particles:
        """The particles of these rows."""
        return _Particles(self.node[rows], self.uniforms[rows], self.group[rows], self.use[rows], self.cost[rows])

    def sums(self, values: np.ndarray, count: int) -> np.ndarray:
        """Sums (count, 2) of ``values`` over the particles of each node and group."""
        return np.bincount(2 * self.node + self.group, values, 2 * count).reshape(count, 2)


def _best_axis(live: _Particles, above: np.ndarray, grows: np.ndarray, count: int) -> np.ndarray:
    """The axis (count,) along which each node's halves differ most in use."""
    node, use, above = live.node[grows], live.use[grows], above[grows]
    whole = np.bincount(node, use, count)
    after = np.empty((EMISSION_DIMENSIONS, count))
    for axis in range(EMISSION_DIMENSIONS):
        high = np.bincount(node, use * above[:, axis], count)
        after[axis] = np.sqrt(high) + np.sqrt(np.maximum(whole - high, 0.0))
    return after.argmin(axis=0)
