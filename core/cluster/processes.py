"""Processes on this machine: threads share one interpreter, and much of NumPy in it, so that two are hardly faster.

They are started by this Python, know the core by its folder alone, and talk through sockets of this machine that none
but they can join. One that is lost has its pieces done by others, or by this process when none is left.
"""

from __future__ import annotations

import json
import os
import secrets
import selectors
import socket
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

import numpy as np

from .bench import done, forget
from .packing import exactly, received, send

#: Pieces that each process has at hand, so that none waits for the next.
AHEAD = 2

#: Pieces for each process that are begun before the oldest is done, whose result comes first: some take long.
BEGUN = 6

#: Seconds after which a process that has not yet come is not waited for any longer.
PATIENCE = 30.0

#: Seconds after which it is looked again whether processes that are to come are still there.
_LOOK = 0.2

#: Libraries that NumPy calls are not to start threads of their own in each process.
_ALONE = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)  # fmt: skip

_WORKER = Path(__file__).with_name("worker.py")


@contextmanager
def processes_at_hand(count: int) -> Iterator[ProcessHands | None]:
    """So many processes, or None where none can be started."""
    try:
        hands = ProcessHands(count)
    except OSError:  # no sockets are allowed here
        yield None
        return
    with hands:
        yield hands if hands.started else None


class ProcessHands:
    """So many ``processes`` of one thread each; none at all: this process does everything, from the same bytes.

    To be closed in the end, as a context. Attribute ``started``: those that there are.
    """

    def __init__(self, processes: int):
        self._held: dict[str, np.ndarray] = {}
        # Pieces by number: all that are under way, with what to do; those that nobody is at; and what came of the rest.
        self._numbers = count()
        self._tasks: dict[int, tuple[str, tuple[str, ...], np.ndarray]] = {}
        self._waiting: deque[int] = deque()
        self._found: dict[int, np.ndarray] = {}
        self._workers: dict[socket.socket, deque[int]] = {}
        self._lost, self._until = 0, time.monotonic() + PATIENCE
        self._token = secrets.token_bytes(32)
        self._door = socket.create_server(("127.0.0.1", 0), backlog=max(processes, 1))
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._door, selectors.EVENT_READ)
        self.started: list[subprocess.Popen] = []
        for _ in range(processes):
            self._start()

    def __enter__(self) -> ProcessHands:
        return self

    def __exit__(self, *_) -> None:
        for worker in self._workers:
            worker.close()
        self._selector.close()
        self._door.close()
        for process in self.started:
            process.kill()
        for process in self.started:
            process.wait()
        for key in self._held:
            forget(key)

    def give(self, key: str, data: np.ndarray) -> None:
        """Give all of them ``data``, also those that come later."""
        self._held[key] = data
        self._tell("give", key, data)

    def drop(self, key: str) -> None:
        """Let them forget it."""
        del self._held[key]
        self._tell("drop", key)

    def map(self, task: str, keys: tuple[str, ...], pieces: Iterable[np.ndarray]) -> Iterator[np.ndarray]:
        """Do the ``task`` for each of the ``pieces``, in order; lost ones are done again."""
        mine: deque[int] = deque()
        try:
            for piece in pieces:
                number = next(self._numbers)
                self._tasks[number] = task, keys, piece
                self._waiting.append(number)
                mine.append(number)
                self._hand_out()
                while len(mine) >= BEGUN * max(len(self.started), 1):
                    yield self._result(mine.popleft())
            while mine:
                yield self._result(mine.popleft())
        finally:
            for number in mine:
                self._tasks.pop(number, None)
                self._found.pop(number, None)

    def _start(self) -> None:
        """Start a process; where that cannot be, the others do its part.

        A Blender without a Python beside it calls itself that, and would open another window.
        """
        if not Path(sys.executable or "").name.lower().startswith("python"):
            return
        port = self._door.getsockname()[1]
        told = {"path": sys.path, "port": port, "token": self._token.hex()}
        # Ctrl-C in a terminal is for this process alone, which ends the others; on Windows no window is to open.
        group = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {"start_new_session": True}
        try:
            process = subprocess.Popen(
                [sys.executable, "-I", str(_WORKER)], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL, env={**os.environ, **_ALONE}, **group,
            )  # fmt: skip
        except (OSError, ValueError):
            return
        self.started.append(process)
        with suppress(OSError):  # it is gone already
            process.stdin.write(json.dumps(told).encode())
            process.stdin.close()

    def _tell(self, *message) -> None:
        for worker in list(self._workers):
            self._send(worker, *message)

    def _send(self, worker: socket.socket, *message) -> None:
        try:
            send(worker, message)
        except OSError:
            self._lose(worker)

    def _hand_out(self) -> None:
        """Let processes that have little at hand have the pieces that nobody is at."""
        while self._waiting and self._workers:
            worker = min(self._workers, key=lambda each: len(self._workers[each]))
            if len(self._workers[worker]) >= AHEAD:
                return
            number = self._waiting.popleft()
            if number in self._tasks:
                self._workers[worker].append(number)
                self._send(worker, "do", *self._tasks[number])

    def _result(self, number: int) -> np.ndarray:
        while number not in self._found:
            if self._workers or self._coming():
                self._look()
                self._hand_out()
            else:
                task, keys, piece = self._tasks.pop(number)
                self._found[number] = done(task, keys, piece, *(self._held[key] for key in keys))
        return self._found.pop(number)

    def _coming(self) -> bool:
        """Whether a process may still come."""
        if len(self._workers) + self._lost >= len(self.started) or time.monotonic() > self._until:
            return False
        return sum(process.poll() is None for process in self.started) > len(self._workers)

    def _look(self) -> None:
        """Take what has come, or wait a little."""
        for key, _ in self._selector.select(_LOOK):
            if key.fileobj is self._door:
                self._welcome()
                continue
            try:
                found = received(key.fileobj)
            except (OSError, EOFError):
                self._lose(key.fileobj)
                continue
            number = self._workers[key.fileobj].popleft()
            if self._tasks.pop(number, None) is not None:
                self._found[number] = found[0]

    def _welcome(self) -> None:
        """Let a process in, and give it what the others have."""
        worker, _ = self._door.accept()
        worker.settimeout(1.0)
        try:
            known = secrets.compare_digest(exactly(worker, len(self._token)), self._token)
        except (OSError, EOFError):
            known = False
        if not known:
            worker.close()
            return
        worker.settimeout(None)
        worker.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._workers[worker] = deque()
        self._selector.register(worker, selectors.EVENT_READ)
        for key, data in self._held.items():
            self._send(worker, "give", key, data)

    def _lose(self, worker: socket.socket) -> None:
        """A process is gone: what it was at is for others."""
        if worker in self._workers:
            self._selector.unregister(worker)
            worker.close()
            self._lost += 1
            self._waiting.extendleft(reversed(self._workers.pop(worker)))
