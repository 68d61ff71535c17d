"""Which ratio Q of successive spheres is best, and how much larger than a disc the last sphere should be."""

from __future__ import annotations

import numpy as np

from ..discs import TangentDiscs
from ..gatherers.sphere_cache import SphereCache
from ..gatherers.sphere_cache_plan import SLACK, Q
from ..segments import Segments
from .fields import KINDS, spacing, uniform_discs, uniform_lines
from .measure import counted_and_timed, lowest
from .theory import SearchProblem, sphere_cache_tests


def q_rows(kind: str, points: int, lines: int, sort: bool = True, least: float = 0.2, most: float = 0.95) -> list[dict]:
    """Tests per segment, counted and by the theory, and time over Q, d at half the spacing.

    Q goes about from ``least`` to ``most``, by the values that lead to the same last sphere in a whole number of
    steps, so that nothing else changes.
    """
    field = _field(kind, points, lines, 5)
    middle = np.arange(0.5, 0.8, 0.025) if sort else (0.6, 0.7)
    wanted = [q for q in (*np.arange(least, 0.5, 0.1), *middle, 0.8, 0.85, 0.9, 0.95) if q <= most]
    case = {"points": kind, "n_P": points, "n_R": lines, "sorted": sort}
    return [
        case | _walked(*field, SLACK, steps, sort) for steps in sorted({_steps(field[2], SLACK, q) for q in wanted})
    ]


def slack_rows(kind: str, points: int, lines: int) -> list[dict]:
    """The same over the last sphere's radius in disc radii, Q near 0.62."""
    field = _field(kind, points, lines, 6)
    return [
        {"points": kind, "slack": slack} | _walked(*field, slack, _steps(field[2], slack, Q))
        for slack in (1.0, 1.1, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 6.0)
    ]


def optimum(rows: list[dict], value: str) -> float:
    """The Q at which a column of :func:`q_rows` is least."""
    return lowest([row["Q"] for row in rows], [row[value] for row in rows])


def _field(kind: str, points: int, lines: int, seed: int) -> tuple[TangentDiscs, Segments, SearchProblem]:
    generator = np.random.default_rng(seed)
    discs = uniform_discs(kind, points, 0.5 * spacing(kind, points), generator)
    return discs, uniform_lines(lines, generator), SearchProblem.of(discs, lines, KINDS[kind])


def _steps(problem: SearchProblem, slack: float, q: float) -> int:
    """Steps of about ``q`` from the first sphere to one of ``slack`` disc radii."""
    return max(1, round(np.log(problem.around / (slack * problem.radius)) / -np.log(q)))


def _walked(
    discs: TangentDiscs, segments: Segments, problem: SearchProblem, slack: float, steps: int, sort: bool = True
) -> dict:
    """What the Sphere Cache does for a segment, with so many ``steps`` to the last sphere."""
    last, lines = slack * problem.radius, len(segments)
    q = (last / problem.around) ** (1.0 / steps)
    last *= 1.0 - 1e-9  # so that rounding leaves no step out
    counts, time = counted_and_timed(SphereCache(discs, q, last, sort, short=0), segments)
    return {
        "Q": q, "spheres": counts["lists"], "sphere tests": counts["nodes"] / lines,
        "disc tests": counts["listed"] / lines, "tests": counts["work"] / lines,
        "theory": sum(sphere_cache_tests(problem, q, last)) / lines, "seconds": time.processor,
    }  # fmt: skip
