"""Threads for work that releases the interpreter lock, joined before anything is returned."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import islice
from typing import TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")

#: Seconds after which no more tasks are begun before the results so far are handed out.
TOGETHER = 0.3

_thread = threading.local()


def worker_count() -> int:
    """Threads to use: the processors this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def slices(count: int, size: int) -> list[slice]:
    """Consecutive slices of ``size`` rows each, the last of what is left, that make up ``count``."""
    return [slice(start, min(start + size, count)) for start in range(0, count, size)]


@contextmanager
def alone() -> Iterator[None]:
    """Work in this thread alone, as one of many that work side by side."""
    before, _thread.works = getattr(_thread, "works", False), True
    try:
        yield
    finally:
        _thread.works = before


def ordered_map(function: Callable[[Task], Result], tasks: Iterable[Task]) -> Iterator[Result]:
    """Yield ``function(task)`` in the tasks' order, worked on in parallel, for TOGETHER seconds at a time.

    No thread is alive while the caller holds a result: all are joined before any results are handed out, as Blender
    demands of threads inside an operator. Tasks that call this do their own part alone.
    """
    workers = 1 if getattr(_thread, "works", False) else worker_count()
    remaining = iter(tasks)
    while group := list(islice(remaining, workers)):
        if len(group) == 1:
            yield function(group[0])
            continue
        yield from _worked_together(function, group, remaining)


def _worked_together(
    function: Callable[[Task], Result], group: list[Task], remaining: Iterator[Task]
) -> Iterator[Result]:
    """What ``function`` makes of a ``group``, a thread for each, and of what these threads take from ``remaining``."""
    found: dict[int, Result] = {}
    more, until, turn = enumerate(remaining, len(group)), time.perf_counter() + TOGETHER, threading.Lock()

    def work(task: tuple[int, Task] | None) -> None:
        while task is not None:
            number, own = task
            found[number] = function(own)
            with turn:
                task = next(more, None) if time.perf_counter() < until else None

    with ThreadPoolExecutor(len(group), initializer=setattr, initargs=(_thread, "works", True)) as pool:
        list(pool.map(work, enumerate(group)))
    return map(found.pop, range(len(found)))


def interleaved(streams: Iterable[Iterator[Result]]) -> Iterator[Result]:
    """Yield an item of each stream in turn, a few at a time in parallel, until all have ended.

    The order depends on the streams alone, not on the number of threads. No stream may share state with
    another that a step changes.
    """
    streams = list(streams)
    while streams:
        remaining = []
        for stream, item in zip(streams, ordered_map(_advanced, streams), strict=True):
            if item is not _END:
                remaining.append(stream)
                yield item
        streams = remaining


_END = object()


def _advanced(stream: Iterator):
    return next(stream, _END)
