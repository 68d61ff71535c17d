"""Draws the study's tables as SVG and PNG; needs matplotlib, which ``pip install ".[study]"`` brings."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from ...core.errors import DetpError
from ...core.settings import GATHERERS
from ...core.study.run import StudyTables
from ..command.terminal import complain
from ..files.write_files import replace_file
from .report import PLOTS


class NoPlotsError(DetpError):
    """matplotlib is not there to draw the plots."""


def draw(found: StudyTables, folder: Path) -> None:
    """Write each of PLOTS into ``folder`` as .svg and .png.

    Raises NoPlotsError when matplotlib is missing.
    """
    made = figure_class()
    for name, title in PLOTS.items():
        figure = made(figsize=(12 if name == "growth" else 9, 4.2), layout="constrained")
        figure.suptitle(title)
        _DRAWN[name](figure, found.tables)
        save(figure, folder, name)


def figure_class():
    """matplotlib's Figure, for drawing into files; raises NoPlotsError when it is missing."""
    try:
        import matplotlib
    except ImportError as error:
        raise NoPlotsError('The plots need matplotlib: install it with pip install ".[study]".') from error
    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    return Figure


def drawn(draw: Callable[[], None], quiet: bool = False) -> bool:
    """Draw plots; without matplotlib say so, unless ``quiet``, and return False."""
    try:
        draw()
    except NoPlotsError as error:
        if not quiet:
            complain(f"detp: {error}")
        return False
    return True


def save(figure, folder: Path, name: str) -> None:
    """Write a figure as SVG and PNG."""
    for ending in ("svg", "png"):
        replace_file(folder / f"{name}.{ending}", partial(figure.savefig, dpi=110))


def _radius(figure, tables: dict) -> None:
    rows = [row | {"microseconds": 1e6 * row["processor"] / row["n_R"]} for row in tables["radius"]]
    for axes, here in _panels(figure, rows, "scene", "d / spacing", "µs a segment"):
        for search, line in _groups(here, "search"):
            axes.loglog(*_columns(line, "d/spacing", "microseconds"), "o-", label=GATHERERS[search])
        axes.legend()


def _q(figure, tables: dict) -> None:
    for axes, here in _panels(figure, tables["q"], "points", "Q", "comparisons a segment", "points: "):
        for is_sorted, line in _groups(here, "sorted"):
            name = "sorted" if is_sorted else f"unsorted, {line[0]['n_P']} points"
            axes.semilogy(*_columns(line, "Q", "tests"), "o-", label=f"counted, {name}")
            if is_sorted:
                axes.semilogy(*_columns(line, "Q", "theory"), "--", label="theory")
                time = axes.twinx()
                time.plot(*_columns(line, "Q", "seconds"), "r:", label="time")
                time.set_ylabel("seconds (dotted)")
        axes.axvspan(0.6, 0.7, color="0.9")
        axes.legend(loc="upper center")


def _slack(figure, tables: dict) -> None:
    for axes, here in _panels(
        figure, tables["slack"], "points", "last sphere / disc", "comparisons a segment", "points: "
    ):
        axes.plot(*_columns(here, "slack", "tests"), "o-", label="counted")
        axes.plot(*_columns(here, "slack", "theory"), "--", label="theory")
        axes.set_ylim(bottom=0)
        axes.legend()


def _growth(figure, tables: dict) -> None:
    most = max(row["n_R"] for row in tables["growth"])
    rows = [
        row | {"case": f"{row['points']}, {row['discs'].replace('_', ' ')}", "tests": row["work"] / most}
        for row in tables["growth"]
        if row["n_R"] == most
    ]
    for axes, here in _panels(figure, rows, "case", "points", "comparisons a segment"):
        for gatherer, line in _groups(here, "gatherer"):
            axes.loglog(*_columns(line, "n_P", "tests"), "o-", label=gatherer)
        axes.xaxis.set_minor_formatter("")
    figure.axes[0].legend(fontsize="small")


def _cauchy_crofton(figure, tables: dict) -> None:
    axes = figure.subplots()
    for scene, line in _groups(tables["cauchy_crofton"], "scene"):
        axes.loglog(*_columns(line, "r/r0", "measured/expected"), "o-", label=scene)
    axes.axhline(1.0, color="0.5")
    axes.set(xlabel="r / r0", ylabel="measured / expected")
    axes.legend(fontsize="small", ncols=2)


def _frames(figure, tables: dict) -> None:
    rows = [row | {"case": f"{row['scene']}, {row['on it']:.0%} move"} for row in tables["frames"] if "theory" in row]
    figure.set_size_inches(14, 4.2)
    for axes, here in _panels(figure, rows, "case", "r / R", "comparisons a frame"):
        for search, line in _groups(here, "search"):
            drawn = axes.loglog(*_columns(line, "r/R", "work"), "o-", label=search)
            axes.loglog(*_columns(line, "r/R", "theory"), ":", color=drawn[0].get_color())
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize="small")


def _columns(rows: list[dict], *names: str) -> list[list[float]]:
    return [[row[name] for row in rows] for name in names]


def _panels(figure, rows: list[dict], key: str, xlabel: str, ylabel: str, title: str = ""):
    """Axes side by side, one for each value of ``key``, which stands behind the ``title``, with its rows."""
    groups = _groups(rows, key)
    for axes, (value, here) in zip(figure.subplots(1, len(groups), squeeze=False)[0], groups, strict=True):
        axes.set(xlabel=xlabel, ylabel=ylabel, title=f"{title}{value}")
        axes.grid(alpha=0.3)
        yield axes, here


def _groups(rows: list[dict], key: str) -> list[tuple]:
    """Each value of ``key`` with its rows, in the order of their first ones."""
    return [(value, [row for row in rows if row[key] == value]) for value in dict.fromkeys(row[key] for row in rows)]


_DRAWN: dict[str, Callable] = {
    "radius": _radius, "q": _q, "slack": _slack, "growth": _growth, "cauchy_crofton": _cauchy_crofton,
    "frames": _frames,
}  # fmt: skip
