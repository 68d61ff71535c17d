"""This process as the only worker: to see that what travels is all that it takes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from .bench import code_identity, worked


class OwnHands:
    """Does all itself, from the same bytes as a worker. Attribute ``sent``: how many bytes went each way."""

    def __init__(self):
        self._held: dict[str, np.ndarray] = {}
        self.sent = 0

    def give(self, key: str, data: np.ndarray) -> None:
        """Keep ``data``."""
        self._held[key] = data
        self.sent += len(data)

    def drop(self, key: str) -> None:
        """Forget it."""
        del self._held[key]

    def map(self, task: str, keys: tuple[str, ...], pieces: Iterable[np.ndarray]) -> Iterator[np.ndarray]:
        """Do the ``task`` for each of the ``pieces``."""
        for piece in pieces:
            done = worked(task, code_identity(), keys, piece, *(self._held[key] for key in keys))
            self.sent += len(piece) + len(done)
            yield done
