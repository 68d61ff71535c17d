"""The study's assumption: the share of the segments that meets a convex set is its surface over the scene's."""

from __future__ import annotations

import numpy as np

from ..gatherers.outer_spheres import Sphere, meeting
from ..segments import Segments
from .fields import uniform_lines, unit
from .theory import share_through


def share_met(segments: Segments, centres: np.ndarray, radius: float) -> np.ndarray:
    """Share (K,) of ``segments`` that come as near as ``radius`` to each of ``centres`` (K, 3)."""
    return np.array([len(meeting(segments, None, Sphere(c, radius))) for c in centres]) / len(segments)


def ideal(lines: int, spheres: int = 40, radius: float = 0.1) -> dict:
    """Expected and measured share in the ideal field, mean of ``spheres`` spread uniformly, with its 95 % interval."""
    generator = np.random.default_rng(8)
    inside = unit(generator.normal(size=(spheres, 3))) * (1 - radius) * generator.random((spheres, 1)) ** (1 / 3)
    batches = 16
    shares = [share_met(uniform_lines(lines // batches, generator), inside, radius).mean() for _ in range(batches)]
    error = 2.13 * float(np.std(shares, ddof=1)) / np.sqrt(batches)
    mean = float(np.mean(shares))
    return {"expected": float(share_through(radius, 1.0)), "measured": mean, "interval": [mean - error, mean + error]}


def scene_rows(name: str, segments: Segments, centres: np.ndarray, around: float) -> list[dict]:
    """The same in a scene: spheres of several sizes around random points of ``centres`` (N, 3), r0 = ``around``.

    Light is not uniform there, segments end at surfaces, and spheres lie where the surfaces are.
    """
    generator = np.random.default_rng(9)
    chosen = centres[generator.integers(0, len(centres), 40)]
    some = segments.taken(np.sort(generator.permutation(len(segments))[:20_000]))
    rows = []
    for share in (0.01, 0.03, 0.1, 0.3):
        met = share_met(some, chosen, share * around)
        expected = float(share_through(share, 1.0))
        low, middle, high = np.quantile(met, (0.1, 0.5, 0.9)) / expected
        rows.append({
            "scene": name, "r/r0": share, "expected": expected, "measured": float(met.mean()),
            "measured/expected": float(met.mean()) / expected, "10 %": low, "median": middle, "90 %": high,
        })  # fmt: skip
    return rows
