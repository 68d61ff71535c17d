"""Whether a bake fits into memory: predicted from its size before the work, so that it is refused and not killed."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from .errors import OutOfMemoryError

#: bytes that reading a scene takes at its peak for each triangle as it stands in the scene, for each of a mesh that may
#: stand there often, and for each face corner that will have a colour
READING_TRIANGLE, READING_MESH, READING_CORNER = 300, 600, 500

#: bytes that baking takes beside, for each triangle and each estimation point, and for records and rays in flight
BAKING_TRIANGLE, BAKING_POINT, BAKING = 400, 2650, 400_000_000

#: bytes of the scene that a worker is sent, for each triangle and each estimation point
SENT_TRIANGLE, SENT_POINT = 150, 100

#: bytes that a worker takes for each disc at which photons are looked for, and beside
SEARCHED_DISC, WORKER = 1_700, 200_000_000

#: where Linux keeps the limits of groups of processes, as containers are
GROUPS = Path("/sys/fs/cgroup")

#: Options of glibc's mallopt, and bytes: freed ones that stay, and from which on memory is apart for each array.
_TRIM, _MOST_KEPT = -1, 1 << 29
_MAP, _LARGEST = -3, 1 << 25

_GIGA = 1e9


@cache
def keep_memory() -> None:
    """Let freed memory stay with this process, which does nothing but bake.

    Else large arrays go back to the system, whose pages must be cleared anew for the next ones: that takes a twentieth
    of a bake, and half of it in Dask's workers, which give all back at once (MALLOC_TRIM_THRESHOLD_).
    """
    with suppress(OSError, AttributeError, TypeError):  # only glibc has it
        allocator = ctypes.CDLL(None).mallopt
        for option, size in ((_TRIM, _MOST_KEPT), (_MAP, _LARGEST)):
            allocator(option, size)


def check_reading(triangles: int, of_meshes: int, corners: int, free: int | None = None) -> None:
    """Raise OutOfMemoryError when a scene of so many ``triangles`` and ``corners`` to colour cannot be read.

    ``of_meshes``: those triangles of which the others are copies. ``free`` bytes are there, None for what the machine
    says.
    """
    needed = READING_TRIANGLE * triangles + READING_MESH * of_meshes + READING_CORNER * corners
    _check(needed, triangles, f"{_many(corners)} face corners", free)


def check_baking(triangles: int, points: int, free: int | None = None) -> None:
    """Raise OutOfMemoryError when ``points`` among so many ``triangles`` cannot be baked; ``free`` as above."""
    _check(_of_bake(triangles, points), triangles, f"{_many(points)} points", free)


def check_workers(triangles: int, points: int, discs: int, workers: int, free: int | None = None) -> None:
    """Raise OutOfMemoryError when so many ``workers`` on this machine cannot each hold the scene, and ``discs`` where
    photons are looked for; the rest as above."""
    _check(workers * _of_worker(triangles, points, discs), triangles, f"{workers} workers", free)


def workers_that_fit(triangles: int, points: int, discs: int, free: int | None = None) -> int:
    """How many workers fit into what is ``free`` beside the bake itself; the rest as above."""
    free = free_bytes() if free is None else free
    if free is None:
        return 0
    return max(int((free - _of_bake(triangles, points)) / _of_worker(triangles, points, discs)), 0)


def _of_bake(triangles: int, points: int) -> int:
    return BAKING + BAKING_TRIANGLE * triangles + BAKING_POINT * points


def _of_worker(triangles: int, points: int, discs: int) -> int:
    return WORKER + (BAKING_TRIANGLE + SENT_TRIANGLE) * triangles + SENT_POINT * points + SEARCHED_DISC * discs


def free_bytes() -> int | None:
    """The bytes that this process may still take without swapping, None where the system does not tell."""
    if sys.platform == "win32":
        return _free_on_windows()
    known = [_available(), *_left_to_group()]
    return min((each for each in known if each is not None), default=None)


@contextmanager
def memory_errors_named() -> Iterator[None]:
    """Raise OutOfMemoryError in the place of a MemoryError."""
    try:
        yield
    except MemoryError:
        raise OutOfMemoryError(
            "The machine has not memory enough for this: bake fewer objects, or such with fewer faces, at a time."
        ) from None


def _check(needed: int, triangles: int, others: str, free: int | None) -> None:
    free = free_bytes() if free is None else free
    if free is not None and needed > free:
        raise OutOfMemoryError(
            f"With {_many(triangles)} triangles and {others} this takes about {needed / _GIGA:.1f} GB of memory, and "
            f"{free / _GIGA:.1f} GB are free: bake fewer objects, or such with fewer faces, at a time."
        )


def _many(number: int) -> str:
    return f"{number / 1e6:.1f} M" if number >= 1e6 else f"{number:,}".replace(",", " ")


def _available() -> int | None:
    """What Linux can give without swapping; elsewhere all the memory that the machine has, a bound from above."""
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return 1024 * int(line.split()[1])
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, AttributeError):
        return None


def _left_to_group() -> Iterator[int]:
    """What is left of the limits that containers have (cgroups of version 2, and of version 1)."""
    for folder, limit, use in (
        (GROUPS, "memory.max", "memory.current"),
        (GROUPS / "memory", "memory.limit_in_bytes", "memory.usage_in_bytes"),
    ):
        try:
            most, used = int((folder / limit).read_text()), int((folder / use).read_text())
            counts = dict(line.split() for line in (folder / "memory.stat").read_text().splitlines())
        except (OSError, ValueError):
            continue
        # Files that were read and may be forgotten at any time count as used.
        yield most - used + int(counts.get("inactive_file", 0))


def _free_on_windows() -> int | None:
    class Status(ctypes.Structure):
        _fields_ = [
            ("length", ctypes.c_ulong),
            ("load", ctypes.c_ulong),
            *((name, ctypes.c_ulonglong) for name in ("all", "free", "all_paged", "free_paged", "space", "free_space")),
            ("extended", ctypes.c_ulonglong),
        ]

    status = Status(length=ctypes.sizeof(Status))
    return status.free if ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status)) else None
