"""What works step by step: where it stands, and how to take all steps."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import TypeVar

from .command.terminal import say

Result = TypeVar("Result")


@dataclass(frozen=True)
class JobProgress:
    """Where a job stands: what it is doing, the share done (0..1), and the seconds it still needs, if known.

    error   the share by which half of the lit points are likely to be off at most so far; None while it is unknown
    shown   whether colours have just been shown, which wait to be drawn
    """

    phase: str
    fraction: float
    remaining: float | None = None
    error: float | None = None
    shown: bool = False


def printed(steps: Generator[str, None, Result]) -> Result:
    """Take all ``steps``, print the sentence that each yields, and return what they return."""
    while True:
        try:
            say(next(steps))
        except StopIteration as stop:
            return stop.value
