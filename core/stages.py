"""Work in stages: what it says of its progress, and wall time by stage.

A stage is a generator that yields often, so that whoever runs it may show how far it is, or close it to cancel.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

Step = TypeVar("Step")
Result = TypeVar("Result")


def finished(steps: Generator[object, None, Result]) -> Result:
    """Take all ``steps`` and return what they return."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def collected(parts: Iterable[Step]) -> Generator[Step, None, list[Step]]:
    """The ``parts``; returns them all."""
    held = []
    for part in parts:
        held.append(part)
        yield part
    return held


class Stopwatch:
    """Adds up wall time by stage: ``with stopwatch("trace"): ...``, or of all that an iterator does between items.

    Attribute ``seconds``: the time of each of ``stages`` so far.
    """

    def __init__(self, *stages: str):
        self.seconds = dict.fromkeys(stages, 0.0)

    @contextmanager
    def __call__(self, stage: str):
        """A context whose time counts for ``stage``."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] += time.perf_counter() - start

    def timed(self, stage: str, steps: Iterator[Step]) -> Generator[Step, None, Any]:
        """The items of ``steps``; making them counts for ``stage``, what the caller does with them does not.

        Returns what ``steps`` returns, if it is a generator.
        """
        while True:
            with self(stage):
                try:
                    step = next(steps)
                except StopIteration as end:
                    return end.value
            yield step
