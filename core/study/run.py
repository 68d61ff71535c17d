"""The whole study, step by step: a generator that says what it does and returns what it found."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, field

from ..errors import DetpError
from ..machine import this_machine
from . import crofton, growth, q_scan, quasi_static, searches
from .fields import KINDS, StudyScene


@dataclass(frozen=True)
class Extent:
    """How much of everything: less for --quick."""

    q_points: int = 10_000
    q_lines: int = 4000
    growth_points: tuple[int, ...] = (2000, 6000, 20_000, 60_000, 200_000)
    growth_lines: tuple[int, ...] = (500, 1000, 2000)
    spacings: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
    scan_segments: int = 1 << 16
    choice_segments: int = 1 << 16
    crofton_lines: int = 400_000
    repeats: int = 4
    quasi_static: quasi_static.FramesExtent = field(default_factory=quasi_static.FramesExtent)


QUICK = Extent(
    q_points=4000, q_lines=2000, growth_points=(1000, 3000, 10_000, 30_000), growth_lines=(500, 1000, 2000),
    spacings=(0.25, 1.0, 4.0, 12.0), scan_segments=1 << 15, choice_segments=1 << 16,
    crofton_lines=200_000, repeats=3,
    quasi_static=quasi_static.FramesExtent((0.01, 0.05, 0.3), (0.1,), frames=3, points=5000, segments=1 << 14),
)  # fmt: skip


@dataclass(frozen=True)
class StudyTables:
    """Tables by name, each a list of rows with equal keys, and the figures that sum them up, for study.json."""

    tables: dict[str, list[dict]] = field(default_factory=dict)
    figures: dict = field(default_factory=dict)


def run(
    scans: dict[str, Callable[[], StudyScene]], scenes: dict[str, Callable[[], StudyScene]], extent: Extent
) -> Generator[str, None, StudyTables]:
    """Do all experiments; yields a sentence before each. ``scans`` go over many radii, all ``scenes`` have their own.

    Scenes are loaded one at a time by calling them, so that one alone is in memory.
    """
    begin = time.perf_counter()
    found = StudyTables()
    yield "Which Q is best"
    found.tables["q"], found.tables["slack"] = _q_tables(extent)
    yield "How the work grows"
    found.tables["growth"] = growth.growth_rows(extent.growth_points, extent.growth_lines)
    yield "Frames in which something moves"
    frames = quasi_static.scene_rows(quasi_static.uniform_scene(extent.quasi_static), extent.quasi_static)
    yield "Whether shares follow surfaces"
    ideal, uneven, by_radius, choices = crofton.ideal(extent.crofton_lines), [], [], []
    for name, load in {**scans, **scenes}.items():
        yield f"{name}: both searches"
        try:
            scene = load()
        except DetpError as error:
            yield f"{name} is left out: {error}"
            continue
        uneven += crofton.scene_rows(name, scene.segments, scene.centres, scene.around)
        choices += searches.scene_rows(scene, scene.radius, extent.choice_segments, extent.repeats)
        for spacings in extent.spacings if name in scans else ():
            yield f"{name}: discs of {spacings:g} spacings"
            radius = spacings * scene.spacing
            by_radius += searches.scene_rows(scene, radius, extent.scan_segments, extent.repeats)
        if name in scans:
            yield f"{name}: frames in which something moves"
            frames += quasi_static.scene_rows(scene, extent.quasi_static)
    found.tables.update({"cauchy_crofton": uneven, "radius": by_radius, "choice": choices, "frames": frames})
    found.figures.update(_figures(found.tables, ideal))
    found.figures["seconds"] = round(time.perf_counter() - begin, 1)
    return found


def _q_tables(extent: Extent) -> tuple[list[dict], list[dict]]:
    rows, slack = [], []
    for kind in KINDS:
        rows += q_scan.q_rows(kind, extent.q_points, extent.q_lines)
        # Unsorted walks need many times the tests, so fewer segments and points show it.
        few = (extent.q_points // 4, extent.q_lines // 8)
        rows += q_scan.q_rows(kind, *few, sort=False, least=0.45, most=0.8)
        slack += q_scan.slack_rows(kind, extent.q_points, extent.q_lines // 2)
    return rows, slack


def _figures(tables: dict[str, list[dict]], ideal: dict) -> dict:
    """What sums the tables up, under the names that study.json promises."""
    walks = {kind: [row for row in tables["q"] if row["points"] == kind and row["sorted"]] for kind in KINDS}
    names = list(dict.fromkeys(row["scene"] for row in tables["radius"]))
    scans = {name: [row for row in tables["radius"] if row["scene"] == name] for name in names}
    return {
        "q_optimum": {kind: q_scan.optimum(rows, "tests") for kind, rows in walks.items()},
        "q_optimum_seconds": {kind: q_scan.optimum(rows, "seconds") for kind, rows in walks.items()},
        # What Disc Indexing saves of the Sphere Cache's time for the smallest discs.
        "disc_index_saving": {
            name: 1.0 - searches.disc_index_over_sphere_cache(rows, "processor")[0][1] for name, rows in scans.items()
        },
        "exponents": growth.exponents(tables["growth"]),
        "crossover_d_over_spacing": {
            name: {
                "seconds": searches.crossover(rows, "processor"),
                "work": searches.crossover(rows, "work"),
                "measured up to": max(row["d/spacing"] for row in rows),
            }
            for name, rows in scans.items()
        },
        "cauchy_crofton": ideal,
        "chosen_by_theory": searches.agreement([*tables["choice"], *tables["radius"]]),
        "quasi_static": quasi_static.figures(tables["frames"]),
        "machine": {"slowness": this_machine().slowness, "parallel": this_machine().parallel},
    }
