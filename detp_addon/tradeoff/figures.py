"""From the measured runs to figures: errors beside a reference that is itself noisy, the Pareto front, and Cycles' time
over ours at equal error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.errors import NoLightError
from .candidates import Measured
from .reference import Reference
from .scene import ComparedScene

#: an error smaller than this share of the reference's noise cannot be told from it, and counts as that much
TOLD = 0.25

#: errors at fewer points than these are not told, where Cycles reached only a part of the objects
FEW = 100

#: Cycles' time over ours at equal error: as its button is pressed, or all faces as one object; in proportion to the
#: square of the error, or with the set-up counted once
RATIOS = ("button", "button, set-up once", "one object", "one object, set-up once")


@dataclass(frozen=True)
class Comparison:
    """What a trade-off gives: ``rows``, one a kind of run, with equal keys, and ``points``, what they were measured on.

    Errors are medians over the runs of: ``error``, median over the points of the relative difference; ``error 95``,
    its 95th percentile; ``error mean``, mean absolute difference over the mean light; all beyond the reference's noise.
    ``noise`` is the median relative difference of two runs with seeds of their own, over the root of 2.
    """

    rows: list[dict]
    points: dict


def findings(compared: ComparedScene, reference: Reference, measured: list[Measured]) -> Comparison:
    """All figures; raises NoLightError when no compared corner has light."""
    points = ~compared.hidden & np.isfinite(reference.light)
    lit = points & (reference.light > 0)
    if not lit.any():
        raise NoLightError("No corner that could be compared has light: there is no error to trade for time here.")
    rows = [_row(m, reference, points, lit) for m in measured]
    known = [row for row in rows if row["group"] != "bounces" and row.get("complete", True)]
    front = pareto_front([row["seconds"] for row in known], [row["error"] for row in known])
    for row, best in zip(known, front, strict=True):
        row["front"] = bool(best)
    costs = _costs(rows)
    for row in rows:
        if row["who"] == "detp":
            row.update(_ratios(costs, max(row["error"], TOLD * reference.relative_noise), row["seconds"]))
    return Comparison(rows, {
        "corners": len(compared.faces.corners), "objects": len(compared.objects), "compared": len(compared.chosen),
        "hidden": int(compared.hidden.sum()), "lit": int(lit.sum()), "reference noise": reference.relative_noise,
        "reference samples": 2 * reference.samples, "reference seconds": round(reference.seconds, 1),
    })  # fmt: skip


def _row(measured: Measured, reference: Reference, points: np.ndarray, lit: np.ndarray) -> dict:
    found = []
    for light in measured.light:
        here = points & np.isfinite(light)
        enough = here.sum() >= min(FEW, points.sum())
        told = figures(light[here], reference.light[here], reference.noise[here])
        found.append(told if enough else {"points": told["points"]})

    def middle(name: str) -> float:
        return float(np.median([run.get(name, np.nan) for run in found]))

    seconds = measured.seconds
    return {
        "who": measured.who, "label": measured.label, "group": measured.group, "preset": measured.preset,
        "samples": measured.samples, "runs": len(seconds), "seconds": measured.median_seconds,
        "seconds least": min(seconds), "seconds most": max(seconds), "error": middle("median_beyond_noise"),
        "error mean": middle("mean_absolute_beyond_noise"), "error 95": middle("percentile_95_beyond_noise"),
        "mean ratio": middle("mean_ratio"), "noise": _noise(measured.light, reference, lit),
        "points": found[-1]["points"], "front": False, **measured.facts,
    }  # fmt: skip


def _noise(light: list[np.ndarray], reference: Reference, lit: np.ndarray) -> float:
    """Median over the lit points of the relative difference of the first two runs, over the root of 2."""
    if len(light) < 2:
        return float("nan")
    difference = np.abs(light[0] - light[1])[lit] / reference.light[lit] / np.sqrt(2.0)
    return float(np.median(difference[np.isfinite(difference)])) if np.isfinite(difference).any() else float("nan")


def _costs(rows: list[dict]) -> dict[str, list[tuple[int, float, float]]]:
    """Samples, seconds and errors of Cycles' runs, for its button and for all faces as one object.

    At a corner in a concave edge, or on another surface, Cycles' button gives what chance wants, and that is no measure
    of its samples. Its samples are those of the faces as one object, so its error is taken from there.
    """
    inside = {row["samples"]: row for row in rows if row["group"] == "inside" and np.isfinite(row["error"])}
    pressed = [row for row in rows if row["who"] == "cycles" and row["samples"] in inside]
    return {
        "button": [(row["samples"], row["seconds"], inside[row["samples"]]["error"]) for row in pressed],
        "one object": [(row["samples"], row["seconds"], row["error"]) for row in inside.values()],
    }


def _ratios(costs: dict[str, list[tuple[int, float, float]]], aim: float, seconds: float) -> dict[str, float]:
    """RATIOS of a bake of ours that took ``seconds``, without those that cannot be told."""
    ratios = {}
    for kind, runs in costs.items():
        if runs and aim > 0:
            plain, once = equal_error_seconds(*zip(*runs, strict=True), aim)
            ratios |= {kind: plain / seconds, f"{kind}, set-up once": once / seconds}
    return {name: ratio for name, ratio in ratios.items() if np.isfinite(ratio)}


def figures(ours: np.ndarray, theirs: np.ndarray, noise: np.ndarray) -> dict[str, float]:
    """The difference of ``ours`` (M,) from the reference ``theirs`` (M,), RGB sums at the same points.

    ``noise`` (M,) is the absolute noise of the reference, half the difference of two halves with seeds of their own.
    Of each figure of the difference the same figure of the noise is taken out in squares: "beyond noise". Relative
    differences are those of the points that the reference has lit; "mean_absolute" is over the reference's mean.
    """
    lit = theirs > 0
    found = {"points": len(theirs), "lit": int(lit.sum())}
    if not lit.any():
        return found
    difference = np.percentile(np.abs(ours[lit] / theirs[lit] - 1), (50, 95))
    of_reference = np.percentile(noise[lit] / theirs[lit], (50, 95))
    beyond = _without(difference, of_reference)
    mean, mean_noise = np.abs(ours - theirs).mean() / theirs.mean(), noise.mean() / theirs.mean()
    return found | {
        "median_relative_difference": float(difference[0]),
        "reference_noise": float(of_reference[0]),
        "median_beyond_noise": float(beyond[0]),
        "percentile_95": float(difference[1]),
        "percentile_95_beyond_noise": float(beyond[1]),
        "mean_absolute_beyond_noise": float(_without(mean, mean_noise)),
        "mean_ratio": float(ours.sum() / theirs.sum()),
        "median_ratio": float(np.median(ours[lit] / theirs[lit])),
    }


def pareto_front(seconds: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Whether (K,) no other run is at least as good in both and better in one."""
    seconds, errors = np.asarray(seconds, float), np.asarray(errors, float)
    as_good = (seconds[:, None] <= seconds) & (errors[:, None] <= errors)
    better = (seconds[:, None] < seconds) | (errors[:, None] < errors)
    return ~(as_good & better).any(axis=0)


def equal_error_seconds(samples, seconds, errors, aim: float) -> tuple[float, float]:
    """The time in which Cycles would reach the error ``aim`` > 0, told from its runs of so many ``samples`` each.

    First as the plain rule has it: the time of the run with few samples (the least of at least 4) grows with the
    square of the error. Second with what the samples do not change (setting the scene up for each object) counted once:
    time is a + b samples, fitted to all runs, and the error of the run with most samples falls with the root of their
    number; at least one sample is needed. With one run alone both are the same, and where more samples took no longer,
    since all was over in no time, the second is NaN.
    """
    samples, seconds, errors = (np.asarray(values, float) for values in (samples, seconds, errors))
    order = np.argsort(samples)
    few = next((row for row in order if samples[row] >= 4), order[-1])
    plain = seconds[few] * (errors[few] / aim) ** 2
    if len(samples) == 1:
        return float(plain), float(plain)
    each, start = (float(value) for value in np.polyfit(samples, seconds, 1, w=1.0 / seconds))
    if start < 0.0:
        each, start = float(np.median(seconds / samples)), 0.0
    most = order[-1]
    once = start + each * max(1.0, samples[most] * (errors[most] / aim) ** 2)
    return float(plain), once if each > 0.0 else float("nan")


def _without(difference, noise):
    return np.sqrt(np.maximum(difference**2 - noise**2, 0.0))
