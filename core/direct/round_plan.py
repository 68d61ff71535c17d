"""How many rounds of rays each point gets next: more where the light around it is noisy, fewer where it is sure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .round_sums import sample_sizes

#: No point gets less than this share of the rounds that an even plan would give it, nor more than so many times them.
LEAST_SHARE, MOST_SHARE = 0.5, 4.0

#: Nor less than this share where its neighbours' rounds found no light at all: in case there is some after all.
DARK_SHARE = 0.125

#: Rounds of a larger relative variance count as no noisier: nobody waits for the light of dark corners.
NOISIEST = 16.0

#: Most points by which the level is found, and halvings of an interval that find it.
_SAMPLE, _HALVINGS = 1 << 14, 20


def planned(
    rounds: int, had: Sequence[np.ndarray], variance: Sequence[np.ndarray], cost: Sequence[int]
) -> tuple[np.ndarray, ...]:
    """Rounds (N,) of each kind of rays for each of N points, at the cost of ``rounds`` for all.

    For each kind: how many rounds each point has ``had`` (N,), the relative ``variance`` (N,) of one round there, as
    its neighbours' rounds tell (nan while that is unknown), and the ``cost`` of a round, 0 if there are no such rays.
    The mean of all points' squared errors becomes least when the rounds had are as sqrt(variance / cost).
    """
    even = _whole(np.full(len(had[0]), float(rounds)))
    wanted = [np.sqrt(np.minimum(v, NOISIEST) / max(c, 1)) for v, c in zip(variance, cost, strict=True)]
    kinds = [kind for kind, c in enumerate(cost) if c]
    if not kinds or any(np.isnan(wanted[kind]).all() for kind in kinds):
        return tuple(even for _ in cost)
    few = slice(None, None, -(-len(even) // _SAMPLE))

    def at(level: float, kind: int, rows: slice) -> np.ndarray:
        """Rounds of that kind for rounds had of ``level`` times what is wanted."""
        least = np.where(wanted[kind][rows] == 0.0, DARK_SHARE, LEAST_SHARE) * rounds
        more = np.clip(level * wanted[kind][rows] - had[kind][rows], least, MOST_SHARE * rounds)
        return np.where(np.isnan(more), rounds, more)

    def spent(level: float) -> float:
        return sum(cost[kind] * at(level, kind, few).mean() for kind in kinds)

    budget = rounds * sum(cost)
    most = max(np.nanmax(wanted[kind]) for kind in kinds)
    if most == 0:
        return tuple(even for _ in cost)
    low, high = 0.0, 1.0 / most
    while spent(high) < budget and high < 1e12 / most:
        low, high = high, 2.0 * high
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if spent(middle) < budget else (low, middle)
    return tuple(_whole(at(low, kind, slice(None)) if c else np.zeros(len(even))) for kind, c in enumerate(cost))


def _whole(rounds: np.ndarray) -> np.ndarray:
    """``rounds`` (N,) that make up whole samples; points round up and down in turn, to be right on average."""
    turn = (np.arange(len(rounds)) * 0.6180339887498949) % 1.0
    size = sample_sizes(rounds)
    return size * np.maximum((rounds / size + turn).astype(np.int64), (rounds > 0).astype(np.int64))
