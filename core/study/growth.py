"""How the work grows with the number of points and segments, for small discs and large ones."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..gatherers.disc_index import DiscIndex
from ..gatherers.sphere_cache import SphereCache
from .fields import KINDS, spacing, uniform_discs, uniform_lines
from .measure import counted_and_timed, growth
from .theory import SearchProblem, search_tests

#: Large discs, in radii of the ball, and others beside them.
LARGE, OTHERS = 0.2, (0.1, 0.4)


def unbalanced(count: np.ndarray) -> np.ndarray:
    """Cut at random, as a tree grown point by point in random order is; twice as deep as a balanced one on average."""
    generator = np.random.default_rng(len(count))
    return (generator.random(len(count)) * count).astype(np.int64)


GATHERERS = {
    "sphere-cache": partial(SphereCache, short=0),
    "disc-index": DiscIndex,
    "disc-index, unbalanced": partial(DiscIndex, halves=unbalanced),
}

#: the study's exponents of n_P; the unbalanced tree's has a factor log n_P beside it
STUDY = {"small_discs": 1.0 / 3.0, "large_discs": 1.0}


def growth_rows(sizes: tuple[int, ...], lines: tuple[int, ...]) -> list[dict]:
    """Work and time over n_P with the last of ``lines``, over n_R with the middle of ``sizes``, and over large d."""
    middle = sizes[len(sizes) // 2]
    cases = [(size, lines[-1], LARGE) for size in sizes] + [(middle, count, LARGE) for count in lines[:-1]]
    rows = []
    for kind in KINDS:
        for discs_are in STUDY:
            others = [(middle, lines[0], radius) for radius in OTHERS] if discs_are == "large_discs" else []
            for points, count, large in cases + others:
                generator = np.random.default_rng(7)
                radius = spacing(kind, points) if discs_are == "small_discs" else large
                discs = uniform_discs(kind, points, radius, generator)
                segments = uniform_lines(count, generator)
                for name, make in GATHERERS.items():
                    problem = SearchProblem(count, points, radius, 1.0 + radius, KINDS[kind])
                    counts, time = counted_and_timed(make(discs), segments)
                    rows.append({
                        "gatherer": name, "discs": discs_are, "points": kind, "n_P": points, "n_R": count, "d": radius,
                        "theory": search_tests(name, problem), "work": counts["work"],
                        "crossings": counts["crossings"], "seconds": time.processor,
                    })  # fmt: skip
    return rows


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


def _slopes(rows: list[dict]) -> dict:
    least, most = min(row["n_R"] for row in rows), max(row["n_R"] for row in rows)
    points = [row for row in rows if row["n_R"] == most]
    middle = sorted({row["n_P"] for row in points})[len(points) // 2]
    radii = [row for row in rows if row["n_P"] == middle and row["n_R"] == least]
    lines = [row for row in rows if row["n_P"] == middle and row["d"] not in OTHERS]

    def over(size: str, some: list[dict], value: str = "work") -> dict:
        return growth([row[size] for row in some], [row[value] for row in some])

    slopes = {
        "n_P": over("n_P", points), "n_P, theory": over("n_P", points, "theory"),
        "n_P, seconds": over("n_P", points, "seconds"), "n_R": over("n_R", lines),
    }  # fmt: skip
    if len(radii) > 2:
        slopes |= {"d": over("d", radii), "d, theory": over("d", radii, "theory")}
    return slopes
