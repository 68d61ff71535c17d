"""Extremes and random broken scenes, for try_reliability.py: is the light right, or is there one clear sentence?"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

from fuzz.watch import trials

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "analytic"))

import extent_cases  # noqa: F401 the folder has just been made known; it adds its cases
from extreme_cases import CASES

#: seconds of a processor that a broken scene may take
LONGEST = 60.0


def extremes() -> Iterator[tuple[str, float, list[str]]]:
    """The kind, seconds and faults of each of the extremes, with as many photons as the tests use."""
    for case in CASES:
        begin = time.perf_counter()
        measured, right = case.run(1.0)
        yield f"light, {case.name}: {measured}", time.perf_counter() - begin, [] if right else [f"not {case.expected}"]


def broken_scenes(first: int, count: int) -> Iterator[tuple[str, float, list[str]]]:
    """The same of ``count`` scenes of tools/fuzz_scenes.py from number ``first`` on."""
    for outcome in trials(range(first, first + count), LONGEST):
        verdict, seconds = outcome["verdict"], sum(outcome["seconds"].values())
        kind = {"refused": "refused with a sentence", "blender": "Blender alone fails"}.get(verdict, verdict)
        failed = verdict not in ("baked", "refused", "blender")
        yield f"broken scene, {kind}", seconds, [f"scene {outcome['seed']}"] if failed else []
