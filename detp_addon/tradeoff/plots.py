"""Draws error against time; needs matplotlib, which ``pip install ".[study]"`` brings."""

from __future__ import annotations

from pathlib import Path

from ...core.settings import GATHERERS
from ..study.plots import figure_class, save
from .figures import Comparison

#: the figures' names in the rows, and their titles
_ERRORS = {"error": "median error", "error 95": "95th percentile of the error"}

_NAMES = {
    "quality": "presets", "error": "error aimed at", "time": "time given", "radius": "radii",
    "direct": "direct light by photons", **GATHERERS, "cycles": "Cycles, button", "inside": "Cycles, one object",
}  # fmt: skip
_STYLES = {
    "quality": "k*",
    "error": "kd:",
    "time": "kP:",
    "cycles": "rs--",
    "inside": "m^--",
    "radius": "v",
    "direct": "x",
}


def draw(found: Comparison, title: str, folder: Path) -> None:
    """Write tradeoff.svg and tradeoff.png into ``folder``.

    Raises NoPlotsError when matplotlib is missing.
    """
    figure = figure_class()(figsize=(13, 5.5), layout="constrained")
    figure.suptitle(title)
    for axes, (error, name) in zip(figure.subplots(1, 2), _ERRORS.items(), strict=True):
        _panel(axes, found.rows, error)
        axes.set(xlabel="seconds", ylabel=name, xscale="log", yscale="log")
        _count_in(axes.xaxis, lambda value, _: f"{value:g}")
        _count_in(axes.yaxis, lambda value, _: f"{100 * value:g} %")
        axes.grid(alpha=0.3, which="both")
    figure.axes[0].legend(fontsize="small")
    save(figure, folder, "tradeoff")


def _panel(axes, rows: list[dict], error: str) -> None:
    rows = [row for row in rows if row[error] and row[error] > 0]
    for group in dict.fromkeys(row["group"] for row in rows if row["group"] != "bounces"):
        line = sorted((row for row in rows if row["group"] == group), key=lambda row: row["seconds"])
        axes.plot([row["seconds"] for row in line], [row[error] for row in line], _STYLES.get(group, "o-"),
                  label=_NAMES.get(group, group), markersize=13 if group == "quality" else 6, zorder=2)  # fmt: skip
    front = sorted((row for row in rows if row["front"]), key=lambda row: row["seconds"])
    if error == "error":
        axes.plot([row["seconds"] for row in front], [row[error] for row in front], color="0.6", linewidth=7,
                  alpha=0.4, zorder=1, label="Pareto front")  # fmt: skip
    for row in rows:
        if row["preset"]:
            axes.annotate(row["label"], (row["seconds"], row[error]), xytext=(7, 7), textcoords="offset points")


def _count_in(axis, words) -> None:
    """Numbers at 1, 2 and 5 of each decade."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(words)
    axis.set_minor_formatter(NullFormatter())
