"""How the work grows with the number of points and segments, for small discs and large ones."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..cost_model import SearchProblem, disc_index_tests, sphere_cache_tests
from ..discs import TangentDiscs
from ..gatherers.disc_index import DiscIndex
from ..gatherers.disc_tree import LEAF, DiscTree
from ..gatherers.sphere_cache import SphereCache
from .fields import KINDS, spacing, uniform_discs, uniform_lines
from .measure import counted_and_timed, growth

LARGE = 0.2  # of the ball's radius, for large discs


def unbalanced(count: np.ndarray) -> np.ndarray:
    """Cut at random, as a tree grown point by point in random order is; twice as deep as a balanced one on average."""
    generator = np.random.default_rng(len(count))
    return (generator.random(len(count)) * count).astype(np.int64)


GATHERERS = {
    "sphere-cache": partial(SphereCache, short=0),
    "disc-index": partial(DiscIndex, index="tree"),
    "disc-index, unbalanced": partial(DiscIndex, index=partial(DiscTree, halves=unbalanced)),
    "disc-index, grid": partial(DiscIndex, index="grid"),
}

#: the study's exponents of n_P; the unbalanced tree's has a factor log n_P beside it
STUDY = {"small_discs": 1.0 / 3.0, "large_discs": 1.0}


def growth_rows(sizes: tuple[int, ...], lines: tuple[int, ...]) -> list[dict]:
    """Work and time over n_P with the last of ``lines``, and over n_R with the middle of ``sizes``."""
    cases = [(size, lines[-1]) for size in sizes] + [(sizes[len(sizes) // 2], count) for count in lines[:-1]]
    rows = []
    for kind in KINDS:
        for discs_are in STUDY:
            for points, count in cases:
                generator = np.random.default_rng(7)
                radius = spacing(kind, points) if discs_are == "small_discs" else LARGE
                discs = uniform_discs(kind, points, radius, generator)
                segments = uniform_lines(count, generator)
                for name, make in GATHERERS.items():
                    case = {"gatherer": name, "discs": discs_are, "points": kind, "n_P": points, "n_R": count}
                    problem = SearchProblem(count, points, radius, 1.0 + radius, KINDS[kind])
                    rows.append(case | {"theory": theory(name, problem)} | _measured(make, discs, segments))
    return rows


def _measured(make, discs: TangentDiscs, segments) -> dict:
    counts, time = counted_and_timed(make(discs), segments, repeats=1)
    return {"work": counts["work"], "crossings": counts["crossings"], "seconds": time.processor}


def exponents(rows: list[dict]) -> dict:
    """For study.json: gatherer -> small_discs and large_discs -> the exponent of n_P in the work, and all others.

    The exponent itself is that of points in a volume, as the study assumes.
    """
    result: dict = {}
    for name in GATHERERS:
        for discs_are, study in STUDY.items():
            here = [row for row in rows if row["gatherer"] == name and row["discs"] == discs_are]
            entry = {kind: _slopes([row for row in here if row["points"] == kind]) for kind in KINDS}
            result.setdefault(name, {})[discs_are] = {**entry["volume"]["n_P"], "study": round(study, 3), **entry}
    return result


def theory(name: str, problem: SearchProblem) -> float:
    """Comparisons by core/cost_model.py, whose exponents over the same finite sizes differ from the limits."""
    if name == "sphere-cache":
        return sum(sphere_cache_tests(problem, 0.62, 1.5 * problem.radius))
    # The tree keeps discs apart by six sides; on a surface these lie apart anyway.
    roots = 6 if problem.dimension > 2.5 else 1
    return sum(disc_index_tests(problem, 1 if name.endswith("grid") else LEAF, "unbalanced" not in name, roots))


def _slopes(rows: list[dict]) -> dict:
    count = max(row["n_R"] for row in rows)
    points = [row for row in rows if row["n_R"] == count]
    middle = sorted({row["n_P"] for row in points})[len(points) // 2]
    lines = [row for row in rows if row["n_P"] == middle]
    return {
        "n_P": growth([row["n_P"] for row in points], [row["work"] for row in points]).as_json(),
        "n_P, theory": growth([row["n_P"] for row in points], [row["theory"] for row in points]).as_json(),
        "n_P, seconds": growth([row["n_P"] for row in points], [row["seconds"] for row in points]).as_json(),
        "n_R": growth([row["n_R"] for row in lines], [row["work"] for row in lines]).as_json(),
    }
