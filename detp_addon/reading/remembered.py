"""Results that are remembered by key, and found however deep they depend on each other: deeper than Python's stack."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

#: results inside results, before the innermost one is found first and on its own
DEEPEST = 40


class _TooDeepError(Exception):
    """The result of this key must be found before those that need it."""

    def __init__(self, key, find):
        super().__init__(key)
        self.task = key, find


class Remembered:
    """Finds each result once. A chain of any length is found in stretches of DEEPEST, from its far end.

    ``in_a_loop`` takes the place of a result that would need itself.
    """

    def __init__(self, in_a_loop: Any):
        self._known: dict = {}
        self._in_a_loop = in_a_loop
        self._open: set = set()

    def of(self, key, find: Callable[[], Any]) -> Any:
        """The result of ``key``, by ``find`` when it is not known yet; ``find`` may ask for others."""
        if key in self._known:
            return self._known[key]
        if key in self._open:
            return self._in_a_loop
        if len(self._open) >= DEEPEST:
            raise _TooDeepError(key, find)
        if self._open:
            return self._found(key, find)
        waiting = {key: find}
        while waiting:
            last = next(reversed(waiting))
            try:
                self._found(last, waiting[last])
            except _TooDeepError as error:
                deeper, find_deeper = error.task
                if deeper in waiting:
                    self._known[deeper] = self._in_a_loop
                waiting[deeper] = find_deeper
            waiting = {name: task for name, task in waiting.items() if name not in self._known}
        return self._known[key]

    def _found(self, key, find: Callable[[], Any]) -> Any:
        self._open.add(key)
        try:
            self._known[key] = find()
        finally:
            self._open.remove(key)
        return self._known[key]
