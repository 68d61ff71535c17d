"""What the trade-off gave, as text: tradeoff.json, tradeoff.csv, and tradeoff.md that reads as a short report."""

from __future__ import annotations

import importlib.metadata
import math
import os
import platform
from pathlib import Path

import bpy

from ...core.parallel import worker_count
from ..files.write_files import write_text
from ..tables import as_csv, as_json, markdown_table, versions
from .figures import RATIOS, Comparison

_FAIRNESS = """\
The quantity is E/pi, diffuse direct and indirect light without colour, at the same corners for all: whole faces chosen
at random from all meshes that both can bake. The reference is Cycles *just inside* the corners (faces apart, drawn 2 %
into themselves), with two seeds, whose difference is its own noise; of every figure that noise is taken out in squares.
Corners that a bake fills from neighbours, because they are buried, are left out for all. *Error*: median of
|light / reference - 1| of the RGB sum over the lit corners; *mean*: mean absolute difference over the mean light;
*95 %*: that percentile of the former.

Cycles bakes on the CPU with all cores, a fixed number of samples, 64 bounces, no denoising and no clamping, in two
ways. *Button*: its DIFFUSE bake into the vertex colours of all meshes, as a user would press it, with its setting up of
the scene for each object. *One object*: all faces as one object, just inside: Cycles at its fastest. The button samples
exactly at the corners, where in concave edges and on other surfaces chance decides; the errors listed contain that, and
the ratios do not: for them the button's error is that of as many samples just inside. *Noise*, the median difference of
two runs over the root of 2, shows that the samples are worth the same. Our seconds are of everything: reading the
scene, baking, writing the colours.

Ratios are Cycles' seconds over ours at equal error: in proportion to the square of the error, from a run at few
samples; and with what does not depend on the samples counted once (time = a + b samples), the fairer figure where
setting up takes long. An error below a quarter of the reference's noise counts as that quarter. Outdoors, where most
light comes straight from the sun and is exact for both, the median says little: look at the other two."""


def write(found: Comparison, facts: dict, folder: Path, picture: bool) -> None:
    """Write the three files into ``folder``; ``picture``: whether the plots are there."""
    plain = [{key: value for key, value in row.items() if not isinstance(value, (dict, list))} for row in found.rows]
    write_text(folder / "tradeoff.json", as_json({**facts, "points": found.points, "runs": found.rows}))
    write_text(folder / "tradeoff.csv", as_csv(plain))
    write_text(folder / "tradeoff.md", as_markdown(found, facts, picture))


def machine() -> dict:
    """What the figures are measured on and with."""
    return {
        "processor": _processor(), "cores": os.cpu_count(), "threads": worker_count(),
        "load before": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "blender": bpy.app.version_string, "embreex": importlib.metadata.version("embreex"), **versions(),
    }  # fmt: skip


def as_markdown(found: Comparison, facts: dict, picture: bool) -> str:
    """The report."""
    here, points = facts["machine"], found.points
    ours = [row for row in found.rows if row["who"] == "detp"]
    theirs = [row for row in found.rows if row["who"] != "detp"]
    parts = [
        f"# Error against time: {Path(facts['scene']).stem}",
        f"`{facts['command']}`; {', '.join(f'{name} {value}' for name, value in here.items())}. Seconds and "
        f"errors are medians of {max(row['runs'] for row in found.rows)} runs, in turn.",
        f"{points['objects']} objects with {points['corners']} corners, compared at {points['compared']}, of which "
        f"{points['hidden']} are hidden and left out, and {points['lit']} of the rest are lit. Reference: "
        f"{points['reference samples']} samples, "
        f"{_percent(points['reference noise'])} noise, {points['reference seconds']} s.",
        *(f"Warning: {warning}" for warning in facts["warnings"]),
        *(["![Error against time](tradeoff.svg)"] if picture else []),
        "## DETP\n\nA star marks the Pareto front: nothing measured is both faster and better. The last columns are "
        "Cycles' time over ours at equal error.\n\n" + markdown_table(
            ("", "bake", "s", "error", "mean", "95 %", "radius m", "photons", *RATIOS),
            [[
                "*" * row["front"], f"**{row['label']}**" if row["preset"] else row["label"], *_errors(row),
                f"{row['radius']:.3g}", str(row["photons"]), *(f"{row[n]:.3g}" if n in row else "" for n in RATIOS),
            ] for row in ours],
        ),
        *([] if not theirs else ["## Cycles\n\n" + markdown_table(
            ("bake", "s", "error", "mean", "95 %", "noise", "corners", ""),
            [[
                row["label"], *_errors(row), _percent(row["noise"]), str(row["points"]), _reached(row, points),
            ] for row in theirs],
        ), _bounces(theirs)]),
        "## What is compared\n\n" + _FAIRNESS,
    ]  # fmt: skip
    return "\n\n".join(filter(None, parts)) + "\n"


def _errors(row: dict) -> list[str]:
    return [f"{row['seconds']:.3g}", *(_percent(row[name]) for name in ("error", "error mean", "error 95"))]


def _percent(share: float) -> str:
    return "" if not math.isfinite(share) else f"{100 * share:.3g} %"


def _reached(row: dict, points: dict) -> str:
    if row.get("complete", True):
        return ""
    return f"time told from {row['baked']} of {points['objects']} objects"


def _bounces(rows: list[dict]) -> str:
    """What Blender's default limit of bounces saves."""
    few = next((row for row in rows if row["group"] == "bounces"), {"samples": None})
    full = next((row for row in rows if (row["group"], row["samples"]) == ("inside", few["samples"])), None)
    if full is None:
        return ""
    saved, lost = 1 - few["seconds"] / full["seconds"], 1 - few["mean ratio"] / full["mean ratio"]
    return f"With 4 bounces, Blender's default, Cycles saves {saved:.0%} of the time and loses {lost:.1%} of the light."


def _processor() -> str:
    """The processor's name, which Python knows on some systems only."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()
