"""Every kind of search on real scenes: time and work, predicted and measured, and what auto takes."""

from __future__ import annotations

from functools import partial

from ..cost_model import SearchProblem, disc_index_tests, sphere_cache_tests
from ..gatherers.candidates import Task, predicted_seconds
from ..gatherers.choose import FEW, make_gatherer
from ..gatherers.disc_tree import LEAF
from ..gatherers.gatherer import Gatherer
from ..unit_costs import SHARED_OUT, Machine, search_lanes
from .measure import Timing, counted, crossing, in_turn
from .scene import StudyScene


def searches(discs: int) -> tuple[str, ...]:
    """The kinds that are compared for so many ``discs``: brute force is out of the question for scenes of any size."""
    return ("grid", "tree", "sphere-cache", *(("brute-force",) if discs <= FEW else ()))


def scene_rows(scene: StudyScene, radius: float, segments: int, repeats: int) -> list[dict]:
    """One row for each kind of search, and one for auto, for discs of ``radius`` metres.

    So many ``segments`` are searched and timed. But searches are built, and auto chooses, for as many as a bake of the
    scene has: it counts what choosing and building take there. Seconds are those of this machine at its usual speed.
    """
    discs, some = scene.discs(radius), scene.some(segments)
    task = Task.of(discs, scene.expected, some)
    problem = SearchProblem.of(discs, len(some))
    kinds = searches(len(discs))
    built: dict[str, Gatherer] = {}
    counts: dict[str, dict[str, int]] = {}
    reasons: list[str] = []

    def build(kind: str) -> None:
        # The one before would be in the way.
        built.pop(kind, None)
        # How large its cells should be, whoever wants a grid has to find out.
        built[kind] = (Task.of(discs, scene.expected, some) if kind == "grid" else task).made(kind)

    def choose() -> None:
        built["auto"], reason = make_gatherer("auto", discs, scene.expected, some)
        reasons.append(reason)

    def search(kind: str) -> None:
        counts[kind] = counted(built[kind], some)

    building, _ = in_turn({kind: partial(build, kind) for kind in kinds} | {"auto": choose}, repeats)
    searching, machine = in_turn({kind: partial(search, kind) for kind in kinds}, repeats)
    case = {
        "scene": scene.name, "n_P": len(discs), "n_R": len(some), "n_R of a bake": scene.expected, "d": radius,
        "d/spacing": radius / scene.spacing,
    }  # fmt: skip
    rows = [
        case | {"search": kind, "build": building[kind].wall} | _times(searching[kind])
        | _predicted(kind, built[kind], task, len(some), machine) | _theory(kind, built[kind], problem)
        | {name: value / len(some) for name, value in counts[kind].items() if name != "segments"}
        for kind in kinds
    ]  # fmt: skip
    auto = built["auto"]
    took = auto.index if auto.name == "disc-index" else auto.name
    share = scene.expected / len(some)
    best = min(row["build"] + share * row["seconds"] for row in rows)
    # The search that auto takes is one of those in ``rows``, so its time is theirs.
    regret = (building["auto"].wall + share * searching[took].wall) / best
    return [*rows, case | {
        "search": "auto", "took": took, "build": building["auto"].wall, **_times(searching[took]), "regret": regret,
        "reason": reasons[-1],
    }]  # fmt: skip


def _theory(kind: str, gatherer: Gatherer, problem: SearchProblem) -> dict:
    """Comparisons of a segment by the study's formulas, as if light and points were uniform; none for brute force."""
    if kind == "brute-force":
        return {}
    if kind == "sphere-cache":
        tests = sphere_cache_tests(problem, gatherer.q, gatherer.last_radius)
    else:
        tests = disc_index_tests(problem, LEAF if kind == "tree" else 1)
    return {"theory": sum(tests) / problem.segments}


def _times(timing: Timing) -> dict:
    return {"seconds": timing.wall, "processor": timing.processor}


def _predicted(kind: str, gatherer: Gatherer, task: Task, segments: int, machine: Machine) -> dict:
    """What the cost model gives for so many segments."""
    seconds = predicted_seconds(kind, gatherer, segments, task.pilot)
    lanes = search_lanes(segments, gatherer.chunk)
    together = SHARED_OUT.get(kind, 1.0) if machine.parallel > 1.2 else 1.0
    return {
        "predicted": together * machine.wall_seconds(seconds, lanes),
        "predicted processor": machine.slowness * seconds,
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
