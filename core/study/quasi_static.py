"""The hybrid beside its two halves over the frames of a quasi-static scene: the study's future work, measured."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from ..gatherers.disc_index import LEAF
from ..gatherers.gatherer import Counts
from ..gatherers.sphere_cache_plan import SLACK
from .fields import StudyScene, uniform_discs, uniform_lines
from .frame_ways import ALONE, WHOLE, Way
from .frames import Frame, MovingObject
from .measure import crossing
from .theory import SearchProblem, best_q, disc_index_tests, outer_sphere_tests, share_through, sphere_cache_tests


@dataclass(frozen=True)
class FramesExtent:
    """How much: ``sizes`` of the object over the scene, ``shares`` of the discs on it, and the rest."""

    sizes: tuple[float, ...] = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
    shares: tuple[float, ...] = (0.01, 0.1)
    frames: int = 6
    points: int = 20_000
    segments: int = 1 << 16


def uniform_scene(extent: FramesExtent) -> StudyScene:
    """The study's assumption as a scene: uniform lines, and points on the surface of a ball."""
    generator = np.random.default_rng(12)
    discs = uniform_discs("surface", extent.points, 1.0, generator)
    lines = uniform_lines(extent.segments, generator)
    return StudyScene("uniform", 0, discs.centres, discs.normals, 1.0, lines)


def scene_rows(scene: StudyScene, extent: FramesExtent) -> list[dict]:
    """:func:`frame_rows` for all sizes and shares."""
    cases = [(size, share) for share in extent.shares for size in extent.sizes]
    return [row for case in cases for row in frame_rows(scene, *case, extent)]


def frame_rows(scene: StudyScene, size: float, share: float, extent: FramesExtent) -> list[dict]:
    """One row for each way: an object of ``size`` scene radii with that ``share`` of all discs.

    "first" are the processor seconds of the first frame with all that is built for it, "each" those of a later one,
    medians; all ways do each frame in turn. "work" is what a later frame compares: segments with whole searches, with
    nodes and with listed discs.
    """
    moving = MovingObject.of(scene, size, share, extent.points, extent.segments)
    frames = list(moving.frames(extent.frames))
    rows = []
    for discs_are, ways in (("all", WHOLE), ("moving", ALONE)):
        times, work, crossings = _in_turn(ways, moving, frames)
        for name in ways:
            rows.append({
                "scene": scene.name, "discs": discs_are, "r/R": size, "on it": share, "n_P": len(frames[0].discs),
                "moving": len(moving.placed), "n_R": len(moving.segments), "search": name,
                "first": times[name][0], "each": float(np.median(times[name][1:])), "work": work[name],
                "crossings": crossings[name],
            })  # fmt: skip
            if discs_are == "moving":
                rows[-1]["theory"] = theory(name, moving)
    return rows


def _in_turn(ways: dict[str, Way], moving: MovingObject, frames: list[Frame]):
    """Processor seconds of all frames for each way, and comparisons and crossings of the last frame."""
    times, work, crossings = {name: [] for name in ways}, {}, {}
    counts = {name: Counts() for name in ways}
    running = {name: way(moving, frames, counts[name]) for name, way in ways.items()}
    for _ in frames:
        for name, way in running.items():
            before, begin = _compared(counts[name]), time.process_time()
            crossings[name] = next(way)
            times[name].append(time.process_time() - begin)
            work[name] = _compared(counts[name]) - before
    return times, work, crossings


def _compared(counts: Counts) -> int:
    totals = counts.totals()
    return totals["segments"] + totals["nodes"] + totals["listed"]


def theory(name: str, moving: MovingObject) -> float:
    """Comparisons of a frame by the study's formulas, for the discs that move alone."""
    placed, whole, around = moving.placed, len(moving.segments), moving.around
    disc = float(placed.radii[0])
    radius, q = moving.radius + disc, best_q(2.0)
    met = whole * float(share_through(radius, around))
    inside = SearchProblem(met, len(placed), disc, radius, 2.0)
    seen = whole
    if name.endswith("kept"):
        outside = SearchProblem(whole, len(placed), disc, around, 2.0)
        last = around * q ** max(np.floor(np.log(radius / around) / np.log(q) + 1e-9), 0.0)
        seen = outer_sphere_tests(outside, radius, moving.step, q) + whole * float(share_through(last, around))
    if name.startswith("disc-index"):
        return seen + sum(disc_index_tests(inside, LEAF))
    return seen + sum(sphere_cache_tests(inside, q, SLACK * disc))


def figures(rows: list[dict]) -> dict:
    """For study.json, by scene and share of the discs: up to which r/R the Sphere Cache, its outer spheres kept, finds
    the discs that move with less of "theory", "work" and "each" than Disc Indexing that is built for each frame (None:
    up to the largest in ``rows``; 0: not even the smallest), and a frame's time with the hybrid over that with Disc
    Indexing, for the smallest object and the largest.
    """
    result = {}
    for case in dict.fromkeys((row["scene"], row["on it"]) for row in rows):
        here = [row for row in rows if (row["scene"], row["on it"]) == case]
        spheres, alone = (_by_size(here, "moving", name) for name in ("sphere-cache, outer spheres kept", "disc-index"))
        entry = {f"crossover by {column}": _reached(spheres, alone, column) for column in ("theory", "work", "each")}
        index = _by_size(here, "all", "disc-index")
        for name in ("hybrid", "hybrid, sums kept"):
            hybrid = _by_size(here, "all", name)
            entry[name] = [hybrid[size]["each"] / index[size]["each"] for size in (min(index), max(index))]
        result[f"{case[0]}, {case[1]:.0%} of the discs"] = entry
    return result


def _by_size(rows: list[dict], discs_are: str, search: str) -> dict[float, dict]:
    return {row["r/R"]: row for row in rows if row["discs"] == discs_are and row["search"] == search}


def _reached(one: dict[float, dict], other: dict[float, dict], column: str) -> float | None:
    sizes = sorted(one)
    # Where no segment comes near there is nothing to compare.
    ratios = [max(one[size][column], 1e-9) / other[size][column] for size in sizes]
    return 0.0 if ratios[0] >= 1.0 else crossing(sizes, ratios)
