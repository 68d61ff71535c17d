"""Workers of a Dask cluster: the one place that imports dask.distributed, and only when it is asked for.

Dask pickles the name of one function of this package and its arguments, which are rows of bytes and text. Of what is
sent once each worker has a copy, which late ones fetch from the others; pieces go wherever there is room, and when
their worker is lost, to another.
"""

from __future__ import annotations

import logging
import re
import time
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import count
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ClusterError
from .bench import code_identity, worked

if TYPE_CHECKING:
    from distributed import Client, Future

#: Seconds to reach a scheduler, and that a bake waits for workers when there are none.
CONNECT, WAIT = 10.0, 60.0

#: Pieces that are under way for each thread of the workers, so that none waits for the next, nor for the oldest, whose
#: result comes first.
AHEAD = 4

#: How often one thing is sent anew, or one piece handed out again, after workers were lost; Dask itself hands a piece
#: out four times before that counts.
MOST_LOSSES = 5

#: Seconds after which it is looked again how many workers there are.
_LOOK = 1.0


@contextmanager
def hands_at(address: str, wait: float = WAIT) -> Iterator[DaskHands]:
    """The workers themselves, of which there must be some within ``wait`` seconds."""
    try:
        from dask import config
        from distributed import Client
    except ModuleNotFoundError:
        raise ClusterError('To bake over many workers takes Dask: pip install "detp[cluster]".') from None
    if not __name__.startswith("detp."):
        raise ClusterError("Workers know detp only as pip installs it: bake with the program 'detp', not in Blender.")
    # What befalls workers is told by errors of this bake alone.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    # Dask watches its processes all the time, which takes a twentieth of it.
    quiet = {
        "distributed.admin.large-graph-warning-threshold": "1GiB",
        "distributed.comm.timeouts.connect": CONNECT,
        "distributed.worker.profile.enabled": False,
        "distributed.admin.system-monitor.interval": "10s",
        "distributed.admin.tick.interval": "1s",
    }
    with config.set(quiet):
        try:
            client = Client(address, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError, TimeoutError):
            raise ClusterError(
                f"No Dask scheduler answers at '{address}': start one with 'dask scheduler', or mend the address."
            ) from None
        with client:
            hands = DaskHands(client, address, wait)
            hands.check()
            yield hands


class DaskHands:
    """The workers that a ``client`` of the scheduler at ``address`` has; waits for some so many seconds at most."""

    def __init__(self, client: Client, address: str, wait: float = WAIT):
        self._client, self._address, self._wait, self._code = client, address, wait, code_identity()
        self._data: dict[str, np.ndarray] = {}
        self._futures: dict[str, Future] = {}
        self._looked, self._threads = 0.0, 0
        self._seen = time.monotonic()

    def check(self) -> None:
        """Raise ClusterError when there are no workers, or one that is not like this process."""
        self._wait_for_workers()
        told = {f"worker at {at}": code for at, code in self._client.run(code_identity, on_error="return").items()}
        try:
            told["scheduler"] = self._client.run_on_scheduler(code_identity)
        except Exception as error:
            told["scheduler"] = error
        for who, code in told.items():
            missing = re.search("No module named '([^']+)'", str(code))
            if missing is not None:
                raise ClusterError(f"The {who} has no {missing[1]}: install this detp there too.")
            if isinstance(code, OSError):
                continue  # on its way out: others get its pieces, as those of any that is lost
            if isinstance(code, Exception):
                raise ClusterError(f"The {who} cannot run detp: {code}")
            if code != self._code:
                raise ClusterError(f"The {who} has another version of detp: install the same on all.")

    def give(self, key: str, data: np.ndarray) -> None:
        """Send ``data`` to all workers that there are."""
        self._data[key] = data
        for losses in count(1):
            self._wait_for_workers()
            try:
                self._futures[key] = self._client.scatter(data, broadcast=True, hash=False)
                return
            except (OSError, TimeoutError, ValueError) as error:  # workers went meanwhile; all of them: ValueError
                self._check_loss(losses, error)

    def drop(self, key: str) -> None:
        """Let the workers forget it."""
        del self._data[key], self._futures[key]

    def map(self, task: str, keys: tuple[str, ...], pieces: Iterable[np.ndarray]) -> Iterator[np.ndarray]:
        """Hand out the ``pieces`` and yield what comes back, in order; lost ones are done again."""
        waiting: deque[tuple[np.ndarray, Future]] = deque()
        for piece in pieces:
            waiting.append((piece, self._handed(task, keys, piece)))
            while len(waiting) >= AHEAD * max(self._room(), 1):
                yield self._done(task, keys, *waiting.popleft())
        while waiting:
            yield self._done(task, keys, *waiting.popleft())

    def _handed(self, task: str, keys: tuple[str, ...], piece: np.ndarray) -> Future:
        shared = (self._futures[key] for key in keys)
        return self._client.submit(worked, task, self._code, keys, piece, *shared, pure=False, retries=0)

    def _done(self, task: str, keys: tuple[str, ...], piece: np.ndarray, future: Future) -> np.ndarray:
        """What came of a ``piece`` that was handed out."""
        from distributed import CancelledError, KilledWorker

        losses = 0
        while True:
            try:
                return future.result(timeout=_LOOK)
            except TimeoutError:
                self._room()
            except (CancelledError, KilledWorker) as error:
                losses += 1
                self._check_loss(losses, error)
                self._give_lost()
                future = self._handed(task, keys, piece)

    def _give_lost(self) -> None:
        """Send all anew what lost workers were the only ones to have."""
        for key, given in list(self._futures.items()):
            if given.status != "finished":
                self.give(key, self._data[key])

    def _check_loss(self, losses: int, error: Exception) -> None:
        """Raise ClusterError when workers were lost for the ``losses``-th time at one thing, and that is too often."""
        self._looked = 0.0
        if self._client.status != "running":
            raise ClusterError(f"The Dask scheduler at '{self._address}' is gone.") from error
        if losses > MOST_LOSSES:
            raise ClusterError("Workers are lost again and again: they may have too little memory.") from error

    def _wait_for_workers(self) -> None:
        while not self._room():
            time.sleep(0.1)

    def _room(self) -> int:
        """Threads that the workers have now. Raises ClusterError when there have been none for too long."""
        now = time.monotonic()
        if now - self._looked < _LOOK and self._threads:
            return self._threads
        try:
            self._threads = sum(self._client.nthreads().values())
        except (OSError, ValueError, TimeoutError) as error:
            raise ClusterError(f"The Dask scheduler at '{self._address}' is gone.") from error
        self._looked = now
        if self._threads:
            self._seen = now
        elif now - self._seen > self._wait:
            raise ClusterError(
                f"The Dask scheduler at '{self._address}' has no workers: start some with "
                f"'dask worker {self._address}'."
            )
        return self._threads
