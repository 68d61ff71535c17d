"""Takes all steps of a generator that works step by step."""

from __future__ import annotations

from collections.abc import Generator
from typing import TypeVar

from .command.terminal import say

Result = TypeVar("Result")


def printed(steps: Generator[str, None, Result]) -> Result:
    """Take all ``steps``, print the sentence that each yields, and return what they return."""
    while True:
        try:
            say(next(steps))
        except StopIteration as stop:
            return stop.value
