"""Both searches on real scenes: time and work, measured and by the study's formulas."""

from __future__ import annotations

from functools import partial

from ..gatherers.disc_index import DiscIndex
from ..gatherers.gatherer import Gatherer
from ..gatherers.sphere_cache import SphereCache
from .fields import StudyScene
from .measure import counted, crossing, in_turn
from .theory import SearchProblem, search_tests

SEARCHES = {"disc-index": DiscIndex, "sphere-cache": SphereCache}


def scene_rows(scene: StudyScene, radius: float, segments: int, repeats: int) -> list[dict]:
    """One row for each search of so many ``segments``, for discs of ``radius`` metres.

    Seconds are those of this machine at its usual speed.
    """
    discs, some = scene.discs(radius), scene.segments.spread(segments)
    problem = SearchProblem.of(discs, len(some))
    built: dict[str, Gatherer] = {}
    counts: dict[str, dict[str, int]] = {}

    def build(name: str) -> None:
        # The one before would be in the way.
        built.pop(name, None)
        built[name] = SEARCHES[name](discs)

    def search(name: str) -> None:
        counts[name] = counted(built[name], some)

    building = in_turn({name: partial(build, name) for name in SEARCHES}, repeats)
    searching = in_turn({name: partial(search, name) for name in SEARCHES}, repeats)
    case = {
        "scene": scene.name, "n_P": len(discs), "n_R": len(some), "d": radius, "d/spacing": radius / scene.spacing,
    }  # fmt: skip
    return [
        case | {
            "search": name, "build": building[name].wall, "seconds": searching[name].wall,
            "processor": searching[name].processor, "theory": search_tests(name, problem) / len(some),
        } | {kind: value / len(some) for kind, value in counts[name].items() if kind != "segments"}
        for name in SEARCHES
    ]  # fmt: skip


def agreement(rows: list[dict]) -> dict[str, int]:
    """In how many of all cases the formulas give the search less to do that takes less time."""
    pairs = [[row for row in rows if row["search"] == name] for name in SEARCHES]
    agrees = [
        (one["theory"] < other["theory"]) == (one["processor"] < other["processor"])
        for one, other in zip(*pairs, strict=True)
    ]
    return {"right": sum(agrees), "of": len(agrees)}


def disc_index_over_sphere_cache(rows: list[dict], column: str) -> list[tuple[float, float]]:
    """(d/spacing, what Disc Indexing needs of ``column`` over what the Sphere Cache needs), by ascending radius."""
    index, needed = ({row["d/spacing"]: row[column] for row in rows if row["search"] == name} for name in SEARCHES)
    return [(d, index[d] / needed[d]) for d in sorted(index) if needed[d] > 0]


def crossover(rows: list[dict], column: str) -> float | None:
    """d in spacings from which the Sphere Cache needs less of ``column``; None: it never does in ``rows``."""
    ratios = disc_index_over_sphere_cache(rows, column)
    return crossing(*zip(*ratios, strict=True)) if ratios else None
