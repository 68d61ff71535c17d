"""What the reading before has found, taken again where all that it follows from is the same, to the last bit."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Protocol, TypeVar

import numpy as np

Result = TypeVar("Result")


class HasDigest(Protocol):
    """What knows how it is told from all others."""

    digest: bytes


class Recollection:
    """Results of one reading for the next."""

    def __init__(self):
        self._results: dict[bytes, object] = {}

    def forget(self) -> None:
        """Let all results go."""
        self._results = {}

    @contextmanager
    def used(self) -> Iterator[None]:
        """While this is open, :func:`recalled` knows what it found when this was open before, and only that is kept
        which is asked for again."""
        global _open
        before, self._results = self._results, {}
        _open = before, self._results
        try:
            yield
        finally:
            _open = None


#: results of the reading before, and of the one that goes on; None where none are kept
_open: tuple[dict, dict] | None = None


def recalled(find: Callable[[], Result], *given: np.ndarray | str | float | HasDigest) -> Result:
    """What ``find`` returns, or did in the reading before, if it follows from what is ``given`` alone; the result must
    not be changed."""
    return recalled_each(lambda _: [find()], [lambda: given])[0]


def recalled_each(
    find: Callable[[list[int]], list[Result]], given: Sequence[Callable[[], tuple | None]]
) -> list[Result]:
    """As :func:`recalled`, of several things: ``find`` returns the results of those of these numbers, and the functions
    ``given`` tell what each follows from, None where that is not known."""
    every = list(range(len(given)))
    if _open is None:
        return find(every)
    before, now = _open
    keys = [None if each is None else digest(*each) for each in (tell() for tell in given)]
    found = {number: now.get(key, before.get(key)) for number, key in enumerate(keys) if key in now or key in before}
    unknown = [number for number in every if number not in found]
    found |= zip(unknown, find(unknown) if unknown else [], strict=True)
    now |= {key: found[number] for number, key in enumerate(keys) if key is not None}
    return [found[number] for number in every]


def digest(*given: np.ndarray | str | float | HasDigest) -> bytes:
    """128 bits that tell all else that is ``given`` from this, in all likelihood."""
    found = hashlib.blake2b(digest_size=16)
    for each in given:
        each = getattr(each, "digest", each)
        if isinstance(each, np.ndarray):
            found.update(repr((each.dtype.str, each.shape)).encode())
            found.update(np.ascontiguousarray(each))
        else:
            found.update(repr(each).encode() + b"\0")
    return found.digest()
