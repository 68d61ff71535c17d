"""Every kind of search on real scenes: time and work, predicted and measured, and what auto takes."""

from __future__ import annotations

from ..discs import TangentDiscs
from ..gatherers.choose import Task, made, make_gatherer, predicted_seconds
from ..gatherers.gatherer import Gatherer
from ..segments import Segments
from ..unit_costs import search_lanes, this_machine
from .measure import counted_and_timed, crossing, searched, timed
from .scene import StudyScene

#: The kinds that the study compares; brute force is out of the question for scenes of its size.
SEARCHES = ("grid", "tree", "sphere-cache")


def scene_rows(scene: StudyScene, radius: float, segments: int, repeats: int) -> list[dict]:
    """One row for each of SEARCHES, and one for auto, for so many segments and discs of ``radius`` metres."""
    discs, some = scene.discs(radius), scene.some(segments)
    case = {"scene": scene.name, "n_P": len(discs), "n_R": len(some), "d": radius, "d/spacing": radius / scene.spacing}
    task = Task.of(discs, len(some), some)
    rows = [case | _measured(kind, task, some, repeats) for kind in SEARCHES]
    return [*rows, case | _automatic(rows, discs, some, repeats)]


def _measured(kind: str, task: Task, segments: Segments, repeats: int) -> dict:
    """A search built with the options that auto would give it."""
    built: list[Gatherer] = []
    building = timed(lambda: built.append(made(kind, task.discs, task.expected, task.plan.cell)), repeats)
    gatherer = built[-1]
    counts, searching = counted_and_timed(gatherer, segments, repeats)
    predicted, machine = predicted_seconds(kind, gatherer, task.expected, task.pilot), this_machine()
    return {
        "search": kind, "build": building.wall, "seconds": searching.wall, "processor": searching.processor,
        "predicted": machine.wall_seconds(predicted, search_lanes(len(segments), gatherer.chunk)),
        "predicted processor": machine.slowness * predicted,
        **{name: value / len(segments) for name, value in counts.items() if name != "segments"},
    }  # fmt: skip


def _automatic(rows: list[dict], discs: TangentDiscs, segments: Segments, repeats: int) -> dict:
    """What auto takes, what choosing and building cost, and its time in all over that of the best choice.

    Its search is one of those in ``rows``, so its time is theirs: the same search timed twice would only add the
    machine's moods.
    """
    chosen = []
    choosing = timed(lambda: chosen.append(make_gatherer("auto", discs, len(segments), segments)), repeats)
    gatherer, reason = chosen[-1]
    kind = gatherer.index if gatherer.name == "disc-index" else gatherer.name
    own = next((row for row in rows if row["search"] == kind), None)
    seconds = own["seconds"] if own else timed(lambda: searched(gatherer, segments), repeats).wall
    best = min(row["build"] + row["seconds"] for row in rows)
    return {
        "search": "auto", "took": kind, "build": choosing.wall, "seconds": seconds,
        "regret": (choosing.wall + seconds) / best, "reason": reason,
    }  # fmt: skip


def disc_index_over_sphere_cache(rows: list[dict], column: str, index: str = "grid") -> list[tuple[float, float]]:
    """(d/spacing, what Disc Indexing needs of ``column`` over what the Sphere Cache needs), by ascending radius."""
    by_kind = {
        kind: {row["d/spacing"]: row[column] for row in rows if row["search"] == kind}
        for kind in (index, "sphere-cache")
    }
    needed = by_kind["sphere-cache"]
    return [(d, by_kind[index][d] / needed[d]) for d in sorted(by_kind[index]) if needed[d] > 0]


def crossover(rows: list[dict], column: str, index: str) -> float | None:
    """d in spacings from which the Sphere Cache needs less of ``column``; None: it never does in ``rows``."""
    ratios = disc_index_over_sphere_cache(rows, column, index)
    return crossing(*zip(*ratios, strict=True)) if ratios else None
