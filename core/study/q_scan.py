"""Which ratio Q of successive spheres is best, and how much larger than a disc the last sphere should be."""

from __future__ import annotations

import numpy as np

from ..gatherers.sphere_cache import SphereCache
from .fields import KINDS, spacing, uniform_discs, uniform_lines
from .measure import counted, counted_and_timed, lowest
from .theory import SearchProblem, sphere_cache_tests

SLACK = 1.5  # the last sphere's radius over a disc's, while Q varies


def q_rows(
    kind: str, points: int, lines: int, repeats: int, sort: bool = True, least: float = 0.2, most: float = 0.95
) -> list[dict]:
    """Tests per segment, counted and by the theory, and time over Q, d at half the spacing.

    Q goes about from ``least`` to ``most``, by the values that lead to the same last sphere in a whole number of
    steps, so that nothing else changes.
    """
    generator = np.random.default_rng(5)
    discs = uniform_discs(kind, points, 0.5 * spacing(kind, points), generator)
    segments = uniform_lines(lines, generator)
    problem = SearchProblem.of(discs, lines, KINDS[kind])
    last = SLACK * problem.radius
    rows = []
    for steps in _steps(problem.around / last, least, most, few=not sort):
        q = (last / problem.around) ** (1.0 / steps)
        search = SphereCache(discs, q, last * (1.0 - 1e-9), sort, short=0)
        counts, time = counted_and_timed(search, segments, repeats)
        theory = sphere_cache_tests(problem, q, last * (1.0 - 1e-9))
        rows.append({
            "points": kind, "n_P": points, "n_R": lines, "sorted": sort, "Q": q, "spheres": counts["lists"],
            "sphere tests": counts["nodes"] / lines, "disc tests": counts["listed"] / lines,
            "tests": counts["work"] / lines, "theory": sum(theory) / lines, "seconds": time.processor,
        })  # fmt: skip
    return rows


def _steps(ratio: float, least: float, most: float, few: bool) -> list[int]:
    """Numbers of steps from the first sphere to the last, for Q from ``least`` to ``most``, denser in the middle."""
    middle = (0.6, 0.7) if few else np.arange(0.5, 0.8, 0.025)
    wanted = [q for q in (*np.arange(least, 0.5, 0.1), *middle, 0.8, 0.85, 0.9, 0.95) if q <= most]
    return sorted({max(1, round(np.log(ratio) / -np.log(q))) for q in wanted})


def slack_rows(kind: str, points: int, lines: int) -> list[dict]:
    """Tests per segment over the last sphere's radius in disc radii, Q near 0.62."""
    generator = np.random.default_rng(6)
    discs = uniform_discs(kind, points, 0.5 * spacing(kind, points), generator)
    segments = uniform_lines(lines, generator)
    problem = SearchProblem.of(discs, lines, KINDS[kind])
    rows = []
    for slack in (1.0, 1.1, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 6.0):
        last = slack * problem.radius
        steps = max(1, round(np.log(problem.around / last) / -np.log(0.62)))
        q = (last / problem.around) ** (1.0 / steps)
        counts = counted(SphereCache(discs, q, last * (1.0 - 1e-9), short=0), segments)
        rows.append({
            "points": kind, "slack": slack, "Q": q, "spheres": counts["lists"], "tests": counts["work"] / lines,
            "theory": sum(sphere_cache_tests(problem, q, last * (1.0 - 1e-9))) / lines,
        })  # fmt: skip
    return rows


def optimum(rows: list[dict], value: str) -> float:
    """The Q at which a column of :func:`q_rows` is least."""
    return lowest([row["Q"] for row in rows], [row[value] for row in rows])
