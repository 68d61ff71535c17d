"""How far light is from a reference that is itself noisy, and what that is worth in time."""

from __future__ import annotations

import numpy as np


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
