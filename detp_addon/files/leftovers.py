"""Temporary files that do not outlive their process: removed at its end, or by the next run when it was killed."""

from __future__ import annotations

import os
import re
import secrets
import shutil
import stat
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: nothing is marked as ours, so nothing of a killed run is swept
    fcntl = None

_LOCK = re.compile(r"\.detp-[0-9a-f]{8}\.lock")
#: the locks of this process, which are open as long as it lives; None where there are no locks
_ours: dict[Path, int | None] = {}
_making = threading.Lock()


@contextmanager
def temporary_name(folder: Path, suffix: str) -> Iterator[Path]:
    """A name in ``folder`` for something that is made and then renamed; what is left of it afterwards is removed.

    Beside it lies a locked file, by which others see that this process lives. Raises OSError.
    """
    sweep(folder)
    lock = _locked(folder)
    try:
        yield lock.with_suffix(suffix)
    finally:
        _remove(lock)


def own_temporary_folder() -> None:
    """Let Blender, when it is loaded later, make its temporary files where they are swept if this process is killed."""
    with suppress(OSError):
        folder = Path(tempfile.gettempdir())
        sweep(folder)
        made = _locked(folder).with_suffix(".tmp")
        made.mkdir(mode=0o700)
        os.environ["TMPDIR"] = str(made)


def remove_all() -> None:
    """Remove everything temporary of this process, which must end then: any other thread that makes more waits here."""
    _making.acquire()
    # None while Blender is half loaded
    blenders = getattr(getattr(sys.modules.get("bpy"), "app", None), "tempdir", None)
    if blenders:
        shutil.rmtree(blenders, ignore_errors=True)
    for lock in list(_ours):  # files last: what writes to one goes on until the end
        _remove(lock)


def sweep(folder: Path) -> None:
    """Remove what killed runs of this user left in ``folder``: a lock that can be taken is no living process's."""
    if fcntl is None:
        return
    with suppress(OSError):
        for name in os.listdir(folder):
            if _LOCK.fullmatch(name):
                _sweep(folder / name)


def _sweep(lock: Path) -> None:
    with suppress(OSError):
        descriptor = os.open(lock, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            found = os.fstat(descriptor)
            if stat.S_ISREG(found.st_mode) and found.st_uid == os.geteuid():
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                _unlink(lock)
        finally:
            os.close(descriptor)


def _locked(folder: Path) -> Path:
    """A new locked file in ``folder``, if the system and the disk know locks."""
    with _making:
        while (lock := _tried(folder)) is None:
            pass
    return lock


def _tried(folder: Path) -> Path | None:
    """One attempt at :func:`_locked`; None when another run swept in this very moment."""
    lock = folder / f".detp-{secrets.token_hex(4)}.lock"
    if fcntl is None:
        _ours[lock] = None
        return lock
    descriptor = os.open(lock, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.path.samestat(os.stat(lock), os.fstat(descriptor)):
            _ours[lock] = descriptor
            return lock
    except (BlockingIOError, FileNotFoundError):
        pass
    except OSError:  # no locks there: without a lock file nobody will take what is made for left-overs
        os.close(descriptor)
        lock.unlink()
        _ours[lock] = None
        return lock
    os.close(descriptor)
    return None


def _remove(lock: Path) -> None:
    """Remove what belongs to a lock of ours, and the lock."""
    _unlink(lock)
    descriptor = _ours.pop(lock, None)
    if descriptor is not None:
        os.close(descriptor)


def _unlink(lock: Path) -> None:
    """Remove all that is named like ``lock``, itself as the last; Blender writes to a name that ends in @ first."""
    with suppress(OSError):
        mine = [name for name in os.listdir(lock.parent) if name.startswith(f"{lock.stem}.") and name != lock.name]
        for name in sorted(mine, key=lambda name: not name.endswith("@")):
            path = lock.with_name(name)
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
    with suppress(OSError):
        lock.unlink(missing_ok=True)
