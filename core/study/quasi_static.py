"""The hybrid beside its two halves over the frames of a quasi-static scene: the study's future work, measured."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..cost_model import SearchProblem, best_q, disc_index_tests, outer_sphere_tests, share_through, sphere_cache_tests
from ..discs import TangentDiscs
from ..gatherers.candidates import Task, made, predicted_seconds
from ..gatherers.counts import Counts
from ..gatherers.disc_tree import LEAF
from ..gatherers.gatherer import Gatherer
from ..gatherers.hybrid import Hybrid, MovingDiscs
from ..gatherers.hybrid_choice import frame_seconds, hybrid_of
from ..segments import Segments
from ..unit_costs import build_seconds
from .fields import uniform_discs, uniform_lines
from .frames import Frame, MovingObject
from .measure import crossing, searched
from .scene import StudyScene

Way = Callable[[MovingObject, list[Frame], Counts], Iterator[int]]


def _rebuilt(make: Callable[[TangentDiscs, int], Gatherer], scene: MovingObject, frames, counts) -> Iterator[int]:
    """A search over all discs, made for each frame."""
    for frame in frames:
        yield searched(make(frame.discs, len(frame.segments)), frame.segments, counts)


def _hybrid(scene: MovingObject, frames, counts) -> Iterator[int]:
    """The hybrid, where each frame has segments of its own."""
    hybrid, _ = hybrid_of(frames[0].discs, scene.moving, len(scene.segments), scene.segments)
    for frame in frames:
        hybrid = hybrid.moved(frame.discs)
        yield searched(hybrid, frame.segments, counts)


def _hybrid_with_sums(scene: MovingObject, frames, counts) -> Iterator[int]:
    """The hybrid, where what the first scene's segments bring to discs that stay is known, and subtracted or kept."""
    hybrid, _ = hybrid_of(frames[0].discs, scene.moving, len(scene.segments), scene.segments)
    first = searched(hybrid.still, scene.segments, counts)
    for frame in frames:
        hybrid = hybrid.moved(frame.discs)
        known = first - searched(hybrid.still, scene.segments.taken(frame.gone), counts)
        known += searched(hybrid.still, frame.come, counts) + searched(hybrid.mobile, frame.come, counts)
        yield known + _not_gone(hybrid, scene.segments, frame.gone, counts)


def _not_gone(hybrid: Hybrid, segments: Segments, gone: np.ndarray, counts: Counts) -> int:
    """Crossings of ``segments`` but those ``gone`` with what moves."""
    stays = np.ones(len(segments), bool)
    stays[gone] = False
    return sum(np.count_nonzero(stays.take(found.segment)) for found in hybrid.mobile.crossings(segments, counts))


def _alone(make: Callable[[TangentDiscs, int], Gatherer], scene: MovingObject, frames, counts) -> Iterator[int]:
    """The discs that move alone, with a search made for each frame, and the first scene's segments."""
    for frame in frames:
        yield searched(make(frame.discs.taken(scene.moving), len(scene.segments)), scene.segments, counts)


def _in_spheres(kind: str, scene: MovingObject, frames, counts) -> Iterator[int]:
    """The same by the hybrid's half, whose outer spheres are kept."""
    search = partial(made, kind, expected=len(scene.segments))
    mobile = MovingDiscs(frames[0].discs, np.flatnonzero(scene.moving), search, best_q(2.0))
    for frame in frames:
        mobile = mobile.moved(frame.discs)
        yield searched(mobile, scene.segments, counts)


def _made(kind: str, discs: TangentDiscs, expected: int) -> Gatherer:
    """The search as the cost model plans it."""
    return Task.of(discs, expected, None).made(kind) if kind == "grid" else made(kind, discs, expected)


WHOLE: dict[str, Way] = {
    "disc-index": partial(_rebuilt, partial(_made, "grid")),
    "sphere-cache": partial(_rebuilt, partial(_made, "sphere-cache")),
    "hybrid": _hybrid,
    "hybrid, sums kept": _hybrid_with_sums,
}
ALONE: dict[str, Way] = {
    "grid": partial(_alone, partial(_made, "grid")),
    "tree": partial(_alone, partial(_made, "tree")),
    "sphere-cache": partial(_alone, partial(_made, "sphere-cache")),
    "sphere-cache, outer spheres kept": partial(_in_spheres, "sphere-cache"),
    "tree, outer spheres kept": partial(_in_spheres, "tree"),
}


@dataclass(frozen=True)
class Extent:
    """How much: ``sizes`` of the object over the scene, ``shares`` of the discs on it, and the rest."""

    sizes: tuple[float, ...] = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
    shares: tuple[float, ...] = (0.01, 0.1)
    frames: int = 6
    points: int = 20_000
    segments: int = 1 << 16
    repeats: int = 1


def uniform_scene(extent: Extent) -> StudyScene:
    """The study's assumption as a scene: uniform lines, and points on the surface of a ball."""
    generator = np.random.default_rng(12)
    discs = uniform_discs("surface", extent.points, 1.0, generator)
    lines = uniform_lines(extent.segments, generator)
    return StudyScene("uniform", 0, discs.centres, discs.normals, 1.0, lines, extent.segments)


def scene_rows(scene: StudyScene, extent: Extent) -> list[dict]:
    """:func:`frame_rows` for all sizes and shares."""
    cases = [(size, share) for share in extent.shares for size in extent.sizes]
    return [row for case in cases for row in frame_rows(scene, *case, extent)]


def frame_rows(scene: StudyScene, size: float, share: float, extent: Extent) -> list[dict]:
    """One row for each way: an object of ``size`` scene radii with that ``share`` of all discs.

    "first" are the processor seconds of the first frame with all that is built for it, "each" those of a later one,
    medians; all ways do each frame in turn. "work" is what a later frame compares: segments with whole searches, with
    nodes and with listed discs.
    """
    moving = MovingObject.of(scene, size, share, extent.points, extent.segments)
    frames = list(moving.frames(extent.frames))
    rows = []
    for discs_are, ways in (("all", WHOLE), ("moving", ALONE)):
        times, work, crossings = _in_turn(ways, moving, frames, extent.repeats)
        for name in ways:
            rows.append({
                "scene": scene.name, "discs": discs_are, "r/R": size, "on it": share, "n_P": len(frames[0].discs),
                "moving": len(moving.placed), "n_R": len(moving.segments), "search": name,
                "first": float(np.median([run[0] for run in times[name]])),
                "each": float(np.median([run[1:] for run in times[name]])), "work": work[name],
                "crossings": crossings[name],
            })  # fmt: skip
            rows[-1] |= predicted(name, moving, frames) if discs_are == "all" else theory(name, moving)
    return rows


def _in_turn(ways: dict[str, Way], moving: MovingObject, frames: list[Frame], repeats: int):
    """Processor seconds of all frames for each run of each way, and comparisons and crossings of the last frame."""
    times: dict[str, list[list[float]]] = {name: [] for name in ways}
    work, crossings = {}, {}
    for _ in range(repeats):
        counts = {name: Counts() for name in ways}
        running = {name: way(moving, frames, counts[name]) for name, way in ways.items()}
        spent: dict[str, list[float]] = {name: [] for name in ways}
        for _ in frames:
            for name, way in running.items():
                before, begin = _compared(counts[name]), time.process_time()
                crossings[name] = next(way)
                spent[name].append(time.process_time() - begin)
                work[name] = _compared(counts[name]) - before
        for name in ways:
            times[name].append(spent[name])
    return times, work, crossings


def _compared(counts: Counts) -> int:
    totals = counts.totals()
    return totals["segments"] + totals["nodes"] + totals["listed"]


def theory(name: str, moving: MovingObject) -> dict:
    """Comparisons of a frame by the study's formulas, for the discs that move alone; none for a grid."""
    placed, whole, around = moving.placed, len(moving.segments), moving.around
    disc = float(placed.radii[0])
    radius, q = moving.radius + disc, best_q(2.0)
    met = whole * float(share_through(radius, around))
    inside = SearchProblem(met, len(placed), disc, radius, 2.0)
    if name == "grid":
        return {}
    seen = whole
    if name.endswith("kept"):
        outside = SearchProblem(whole, len(placed), disc, around, 2.0)
        last = around * q ** max(np.floor(np.log(radius / around) / np.log(q) + 1e-9), 0.0)
        seen = outer_sphere_tests(outside, radius, moving.step, q) + whole * float(share_through(last, around))
    if name.startswith("tree"):
        return {"theory": seen + sum(disc_index_tests(inside, LEAF))}
    return {"theory": seen + sum(sphere_cache_tests(inside, q, 1.5 * disc))}


def predicted(name: str, moving: MovingObject, frames: list[Frame]) -> dict:
    """Reference seconds of one processor for a later frame, all discs and segments, by the cost model."""
    discs, segments = frames[0].discs, frames[0].segments
    task = Task.of(discs, len(segments), segments)
    if not name.startswith("hybrid"):
        kind = "grid" if name == "disc-index" else name
        search = predicted_seconds(kind, task.made(kind), task.expected, task.pilot)
        return {"predicted": build_seconds(kind, len(discs)) + search}
    hybrid, kind = hybrid_of(discs, moving.moving, task.expected, task.pilot)
    seconds = frame_seconds(hybrid, (kind, "sphere-cache"), task, frames=1 << 30)
    if name.endswith("sums kept"):
        still = predicted_seconds(kind, hybrid.still.search, task.expected, task.pilot)
        changed = (len(frames[0].gone) + len(frames[0].come)) / task.expected
        seconds -= (1.0 - changed) * still
    return {"predicted": seconds}


def figures(rows: list[dict]) -> dict:
    """For study.json, by scene and share of the discs: the r/R from which the Sphere Cache, its outer spheres kept, no
    longer finds the discs that move with less of "theory", "work" and "each" than a tree that is built for each frame
    (None: nowhere in ``rows``; the least r/R: everywhere), and a frame's time with the hybrid over that with Disc
    Indexing, for the smallest object and the largest.
    """
    result = {}
    for case in dict.fromkeys((row["scene"], row["on it"]) for row in rows):
        here = [row for row in rows if (row["scene"], row["on it"]) == case]
        spheres, tree = (_by_size(here, "moving", name) for name in ("sphere-cache, outer spheres kept", "tree"))
        entry = {f"crossover by {column}": _reached(spheres, tree, column) for column in ("theory", "work", "each")}
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
    ratios = [one[size][column] / other[size][column] for size in sizes]
    return sizes[0] if ratios[0] >= 1.0 else crossing(sizes, ratios)
