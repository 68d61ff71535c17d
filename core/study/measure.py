"""Timed and counted searches, and the fits to them."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..gatherers.gatherer import Counts, Gatherer
from ..machine import measured_machine
from ..segments import Segments

#: An action that is timed in turn with others is not repeated when it has taken more seconds than this.
ENOUGH = 3.0

# Quantiles of Student's t for 95 % intervals, by degrees of freedom from 1.
_STUDENT = (12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23)


class Timing(NamedTuple):
    """``wall`` and ``processor`` seconds; the latter add up over the threads."""

    wall: float
    processor: float


def timed(action: Callable[[], object]) -> Timing:
    """What one call of ``action`` takes."""
    wall, processor = time.perf_counter(), time.process_time()
    action()
    return Timing(time.perf_counter() - wall, time.process_time() - processor)


def in_turn(actions: dict[str, Callable[[], object]], repeats: int) -> dict[str, Timing]:
    """Median times of ``actions`` run in turn, each so often, at the machine's usual speed meanwhile.

    A processor that others use too is now faster, now slower, for seconds at a time. Each time is therefore put right
    by the machine's speed measured just before and after, which is why such times can be compared. What takes long is
    not repeated.
    """
    runs: dict[str, list[np.ndarray]] = {name: [] for name in actions}
    spent = dict.fromkeys(actions, 0.0)
    slowness = [measured_machine().slowness]
    for _ in range(max(1, repeats)):
        for name, action in actions.items():
            if spent[name] > ENOUGH:
                continue
            took = timed(action)
            slowness.append(measured_machine().slowness)
            spent[name] += took.wall
            runs[name].append(np.divide(took, 0.5 * (slowness[-2] + slowness[-1])))
    usual = float(np.median(slowness))
    return {name: Timing(*(usual * np.median(run, axis=0))) for name, run in runs.items()}


def searched(gatherer: Gatherer, segments: Segments, counts: Counts | None = None) -> int:
    """Take all crossings and return how many."""
    return sum(len(crossings) for crossings in gatherer.crossings(segments, counts))


def counted(gatherer: Gatherer, segments: Segments) -> dict[str, int]:
    """What a search of ``segments`` does; "work" is what the study counts: segments against nodes and listed discs."""
    counts = Counts()
    searched(gatherer, segments, counts)
    totals = counts.totals()
    return {**totals, "work": totals["nodes"] + totals["listed"]}


def counted_and_timed(gatherer: Gatherer, segments: Segments) -> tuple[dict[str, int], Timing]:
    """Both at once: counting adds less to the time than the machine's moods do."""
    counts: dict[str, int] = {}
    time = timed(lambda: counts.update(counted(gatherer, segments)))
    return counts, time


def growth(sizes, values) -> dict:
    """The ``exponent`` e of values ~ sizes^e, three sizes or more, by least squares of the logarithms, and its 95 %
    ``interval``."""
    x, y = np.log(np.asarray(sizes, float)), np.log(np.asarray(values, float))
    x -= x.mean()
    slope = float((x * y).sum() / (x * x).sum())
    rest = y - y.mean() - slope * x
    freedom = len(x) - 2
    error = float(np.sqrt((rest**2).sum() / freedom / (x * x).sum())) * _STUDENT[min(freedom, len(_STUDENT)) - 1]
    return {"exponent": round(slope, 3), "interval": [round(slope - error, 3), round(slope + error, 3)]}


def lowest(x, values) -> float:
    """Where a smooth curve through ``values`` over ``x`` is lowest, by a parabola through the logarithms near it."""
    x, y = np.asarray(x, float), np.log(np.asarray(values, float))
    near = np.sort(np.argsort(np.abs(x - x[y.argmin()]))[:5])
    bend, slope, _ = np.polyfit(x[near], y[near], 2)
    return float(np.clip(-slope / (2.0 * bend), x[near].min(), x[near].max())) if bend > 0 else float(x[y.argmin()])


def crossing(x, ratios) -> float | None:
    """The first x at which ``ratios`` reach 1 from below, between logarithms; None when they do not."""
    x, y = np.log(np.asarray(x, float)), np.log(np.asarray(ratios, float))
    for place in range(1, len(x)):
        if y[place - 1] < 0.0 <= y[place]:
            share = -y[place - 1] / (y[place] - y[place - 1])
            return float(np.exp(x[place - 1] + share * (x[place] - x[place - 1])))
    return None
