"""What the study found, as text: study.json, and study.md that reads as a short report."""

from __future__ import annotations

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
    "cauchy_crofton": "Share of the segments that meet a sphere, over that of the ideal field",
    "frames": "Frames in which an object moves, over its size",
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
        markdown_table(("the study", "here", ""), _claims(figures)),
    ]
    for name, title, columns in _SECTIONS:
        picture = f"![{title}]({name}.svg)\n\n" if pictures and name in PLOTS else ""
        rows = [[_cell(row.get(column)) for column in columns] for row in found.tables[name]]
        parts.append(f"## {title}\n\n{picture}{markdown_table(columns, rows)}")
    return "\n\n".join(parts) + "\n"


#: Objects of this share of the scene's radius are small at any rate.
SMALL = 0.03
_SECTIONS = (
    (
        "radius",
        PLOTS["radius"],
        ("scene", "d/spacing", "search", "build", "seconds", "work", "theory", "crossings"),
    ),
    ("q", PLOTS["q"], ("points", "sorted", "Q", "sphere tests", "disc tests", "tests", "theory", "seconds")),
    ("slack", PLOTS["slack"], ("points", "slack", "Q", "tests", "theory")),
    (
        "growth",
        PLOTS["growth"],
        ("gatherer", "discs", "points", "n_P", "n_R", "d", "work", "theory", "crossings", "seconds"),
    ),
    (
        "frames",
        PLOTS["frames"],
        ("scene", "discs", "r/R", "on it", "moving", "search", "first", "each", "work", "theory"),
    ),
    ("cauchy_crofton", PLOTS["cauchy_crofton"], ("scene", "r/r0", "expected", "measured", "measured/expected")),
    (
        "choice",
        "Every scene at the radius of its bake",
        ("scene", "n_P", "n_R", "d/spacing", "search", "build", "seconds", "work", "theory", "crossings"),
    ),
)


def _claims(figures: dict) -> list[list[str]]:
    """Each experiment of the study, its figure, ours, and whether it held."""
    rows = []
    for name, saving in figures["disc_index_saving"].items():
        cross = figures["crossover_d_over_spacing"][name]
        rows.append([
            "Disc Indexing takes up to 50 % less time than Sphere Cache for small discs",
            f"{name}: {saving:.0%} less",
            _held(saving > 0),
        ])  # fmt: skip
        time, work = (_spacings(cross[key], cross) for key in ("seconds", "work"))
        rows.append([
            "Large discs favour the Sphere Cache",
            f"{name}: {time} by time, {work} by comparisons",
            _held(cross["seconds"] is not None),
        ])  # fmt: skip
    for kind, best in figures["q_optimum"].items():
        rows.append([f"Q is best around 0.6-0.7 ({kind})", f"{best:.2f} by comparisons", _held(0.55 <= best <= 0.75)])
    for name, by_size in figures["exponents"].items():
        for discs, entry in by_size.items():
            low, high = entry["interval"]
            surface = entry["surface"]["n_P"]
            by_theory = {kind: entry[kind]["n_P, theory"]["exponent"] for kind in ("volume", "surface")}
            rows.append([
                f"{name}, {discs.replace('_', ' ')}: comparisons grow as n_P^{entry['study']:.2f}",
                f"n_P^{entry['exponent']:.2f} ({low:.2f} to {high:.2f}) in a volume, "
                f"n_P^{surface['exponent']:.2f} on surfaces; the formulas give n_P^{by_theory['volume']:.2f} and "
                f"n_P^{by_theory['surface']:.2f} for the same sizes",
                _held(abs(entry["exponent"] - entry["study"]) < 0.15),
            ])  # fmt: skip
            lines = [entry[kind]["n_R"]["exponent"] for kind in ("volume", "surface")]
            rows.append([
                f"{name}, {discs.replace('_', ' ')}: comparisons grow as n_R",
                f"n_R^{lines[0]:.2f} in a volume, n_R^{lines[1]:.2f} on surfaces",
                _held(max(abs(line - 1.0) for line in lines) < 0.15),
            ])  # fmt: skip
            if "d" in entry["volume"]:
                wide, of_theory = ([entry[kind][key]["exponent"] for kind in ("volume", "surface")]
                                   for key in ("d", "d, theory"))  # fmt: skip
                rows.append([
                    f"{name}: comparisons grow as d^2" + ("" if name == "sphere-cache" else " log(r0 / d)"),
                    f"d^{wide[0]:.2f} in a volume, d^{wide[1]:.2f} on surfaces; the formulas give d^{of_theory[0]:.2f} "
                    f"and d^{of_theory[1]:.2f} for the same sizes", _held(abs(wide[0] - 2.0) < 0.5),
                ])  # fmt: skip
    ideal = figures["cauchy_crofton"]
    low, high = ideal["interval"]
    rows.append([
        "The share of the segments that meets a convex set is its surface over the scene's",
        f"ideal field: {ideal['measured']:.5f} ({low:.5f} to {high:.5f}) where {ideal['expected']:.5f} is expected; "
        "in scenes see below", _held(low <= ideal["expected"] <= high),
    ])  # fmt: skip
    for case, entry in figures["quasi_static"].items():
        rows.append([
            "Quasi-static scenes: Sphere Cache for small moving objects",
            f"{case}: up to {_sizes(entry['crossover by each'])} of the scene's radius by time, "
            f"{_sizes(entry['crossover by work'])} by comparisons, {_sizes(entry['crossover by theory'])} by theory",
            _held(entry["crossover by each"] is None or entry["crossover by each"] >= SMALL),
        ])  # fmt: skip
        least, most = entry["hybrid"]
        rows.append([
            "Quasi-static scenes: an efficient hybrid",
            f"{case}: {least:.0%} to {most:.0%} of Disc Indexing's time a frame", _held(least < 1.0),
        ])  # fmt: skip
    chosen = figures["chosen_by_theory"]
    rows.append([
        "Theory can choose the algorithm",
        f"the formulas name the faster search in {chosen['right']} of {chosen['of']} cases",
        _held(chosen["right"] > 0.9 * chosen["of"]),
    ])  # fmt: skip
    return rows


def _spacings(value: float | None, cross: dict) -> str:
    return f"nowhere up to {cross['measured up to']:.2g} spacings" if value is None else f"from {value:.2g} spacings on"


def _sizes(value: float | None) -> str:
    return "any share" if value is None else f"{value:.1%}"


def _held(held: bool) -> str:
    return "holds" if held else "does not hold"


def _cell(value) -> str:
    if value is None:
        return ""
    if isinstance(value, bool) or not isinstance(value, (float, np.floating)):
        return str(value)
    return f"{value:.3g}"
