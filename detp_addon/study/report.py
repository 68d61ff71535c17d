"""What the study found, as text: study.json, and study.md that reads as a short report."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...core.study.run import StudyTables
from .. import tables
from ..tables import markdown_table, versions

#: plots, by file name without its ending, and what they show
PLOTS = {
    "radius": "Time of the searches over the disc radius",
    "q": "Comparisons and time of the Sphere Cache over Q",
    "slack": "Comparisons over the size of the last sphere",
    "growth": "Comparisons over the number of points",
    "frames": "Frames in which an object moves, over its size",
    "cauchy_crofton": "Share of the segments that meet a sphere, over that of the ideal field",
}


def as_json(found: StudyTables) -> str:
    """The figures that sum the study up, and the machine."""
    return tables.as_json({**found.figures, "versions": versions()})


def as_markdown(found: StudyTables, command: str, pictures: bool) -> str:
    """A short report: each claim of the study beside what was measured here, then the tables behind it."""
    figures = found.figures
    machine = ", ".join(f"{name} {version}" for name, version in versions().items())
    parts = [
        "# The study of 2006, done again",
        f"`{command}` on {machine}; {figures['machine']['parallel']:.1f} times faster with all processors than with "
        f"one; {figures['seconds']:.0f} s in all. "
        "Searches of scenes are timed in turn, and put right by the machine's speed at that moment.",
        "García, Ureña, Revelles, Lastra and Montes: *Density Estimation Optimizations for Global Illumination*, 2006.",
        markdown_table(
            ("the study", "here", ""),
            ((claim, here, "holds" if held else "does not hold") for claim, here, held in _claims(figures)),
        ),
    ]
    for name, title in (PLOTS | {"choice": "Every scene at the radius of its bake"}).items():
        picture = f"![{title}]({name}.svg)\n\n" if pictures and name in PLOTS else ""
        columns = _COLUMNS[name].split(", ")
        rows = [[_cell(row.get(column)) for column in columns] for row in found.tables[name]]
        parts.append(f"## {title}\n\n{picture}{markdown_table(columns, rows)}")
    return "\n\n".join(parts) + "\n"


#: Objects of this share of the scene's radius are small at any rate.
SMALL = 0.03

#: what is shown of each table
_COLUMNS = {
    "radius": "scene, d/spacing, search, build, seconds, work, theory, crossings",
    "q": "points, sorted, Q, sphere tests, disc tests, tests, theory, seconds",
    "slack": "points, slack, Q, tests, theory",
    "growth": "gatherer, discs, points, n_P, n_R, d, work, theory, crossings, seconds",
    "frames": "scene, discs, r/R, on it, moving, search, first, each, work, theory",
    "cauchy_crofton": "scene, r/r0, expected, measured, measured/expected",
    "choice": "scene, n_P, n_R, d/spacing, search, build, seconds, work, theory, crossings",
}


def _claims(figures: dict) -> Iterator[tuple[str, str, bool]]:
    """Each experiment of the study, its figure, ours, and whether it held."""
    for name, saving in figures["disc_index_saving"].items():
        cross = figures["crossover_d_over_spacing"][name]
        claim = "Disc Indexing takes up to 50 % less time than Sphere Cache for small discs"
        yield claim, f"{name}: {saving:.0%} less", saving > 0
        time, work = (_spacings(cross[key], cross) for key in ("seconds", "work"))
        here = f"{name}: {time} by time, {work} by comparisons"
        yield "Large discs favour the Sphere Cache", here, cross["seconds"] is not None
    for kind, best in figures["q_optimum"].items():
        yield f"Q is best around 0.6-0.7 ({kind})", f"{best:.2f} by comparisons", 0.55 <= best <= 0.75
    for name, by_size in figures["exponents"].items():
        for discs, entry in by_size.items():
            yield from _growth_claims(name, discs.replace("_", " "), entry)
    ideal = figures["cauchy_crofton"]
    low, high = ideal["interval"]
    here = (
        f"ideal field: {ideal['measured']:.5f} ({low:.5f} to {high:.5f}) where {ideal['expected']:.5f} is expected; "
        "in scenes see below"
    )
    held = low <= ideal["expected"] <= high
    yield "The share of the segments that meets a convex set is its surface over the scene's", here, held
    for case, entry in figures["quasi_static"].items():
        time, work, theory = (entry[f"crossover by {column}"] for column in ("each", "work", "theory"))
        here = (
            f"{case}: up to {_sizes(time)} of the scene's radius by time, {_sizes(work)} by comparisons, "
            f"{_sizes(theory)} by theory"
        )
        yield "Quasi-static scenes: Sphere Cache for small moving objects", here, time is None or time >= SMALL
        least, most = entry["hybrid"]
        here = f"{case}: {least:.0%} to {most:.0%} of Disc Indexing's time a frame"
        yield "Quasi-static scenes: an efficient hybrid", here, least < 1.0
    right, of = (figures["chosen_by_theory"][key] for key in ("right", "of"))
    here = f"the formulas name the faster search in {right} of {of} cases"
    yield "Theory can choose the algorithm", here, right > 0.9 * of


def _growth_claims(name: str, discs: str, entry: dict) -> Iterator[tuple[str, str, bool]]:
    """How the comparisons of a gatherer grow, for small or large discs."""

    def exponents(size: str) -> list[float]:
        return [entry[kind][size]["exponent"] for kind in ("volume", "surface")]

    (low, high), surface, by_theory = entry["interval"], exponents("n_P")[1], exponents("n_P, theory")
    here = (
        f"n_P^{entry['exponent']:.2f} ({low:.2f} to {high:.2f}) in a volume, n_P^{surface:.2f} on surfaces; the "
        f"formulas give n_P^{by_theory[0]:.2f} and n_P^{by_theory[1]:.2f} for the same sizes"
    )
    held = abs(entry["exponent"] - entry["study"]) < 0.15
    yield f"{name}, {discs}: comparisons grow as n_P^{entry['study']:.2f}", here, held
    lines = exponents("n_R")
    here = f"n_R^{lines[0]:.2f} in a volume, n_R^{lines[1]:.2f} on surfaces"
    yield f"{name}, {discs}: comparisons grow as n_R", here, max(abs(line - 1.0) for line in lines) < 0.15
    if "d" in entry["volume"]:
        wide, of_theory = exponents("d"), exponents("d, theory")
        here = (
            f"d^{wide[0]:.2f} in a volume, d^{wide[1]:.2f} on surfaces; the formulas give d^{of_theory[0]:.2f} and "
            f"d^{of_theory[1]:.2f} for the same sizes"
        )
        claim = f"{name}: comparisons grow as d^2" + ("" if name == "sphere-cache" else " log(r0 / d)")
        yield claim, here, abs(wide[0] - 2.0) < 0.5


def _spacings(value: float | None, cross: dict) -> str:
    return f"nowhere up to {cross['measured up to']:.2g} spacings" if value is None else f"from {value:.2g} spacings on"


def _sizes(value: float | None) -> str:
    return "any share" if value is None else f"{value:.1%}"


def _cell(value) -> str:
    if value is None:
        return ""
    if isinstance(value, bool) or not isinstance(value, (float, np.floating)):
        return str(value)
    return f"{value:.3g}"
