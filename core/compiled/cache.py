"""Where the compiled kernels are kept: in the user's cache, one folder for each Python, Numba and processor."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
import sys
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

#: After so many seconds a process that compiles counts as dead.
LONGEST = 900.0

_HERE = Path(__file__).parent

#: What the process beside does. It makes this package anew, alone and from its path, since inside Blender no process
#: could import it by its name; but under that name, by which Numba's stored kernels ask for their modules. If it fails,
#: its lock stays, so that the next bakes do not try again and again.
_FILL = """
import os, sys
from importlib.util import module_from_spec, spec_from_file_location
from types import ModuleType
folder, name, lock = sys.argv[1:]
if hasattr(os, "nice"):
    os.nice(19)
parents = name.split(".")[:-1]
for end in range(1, len(parents) + 1):
    parent = ModuleType(".".join(parents[:end]))
    parent.__path__ = []
    sys.modules[parent.__name__] = parent
spec = spec_from_file_location(name, folder + "/__init__.py", submodule_search_locations=[folder])
package = module_from_spec(spec)
sys.modules[name] = package
spec.loader.exec_module(package)
package.compile_now()
os.remove(lock)
"""

_running: list[subprocess.Popen] = []


def folder_of_kernels() -> Path:
    """The folder of the kernels of this source, for this Python, Numba and processor; it need not exist.

    Numba itself compiles anew when a source file's time differs, so that is part of the key too.
    """
    sources = [(path.name, path.stat().st_mtime_ns, path.read_bytes()) for path in sorted(_HERE.glob("*.py"))]
    key = [
        sys.implementation.cache_tag,
        sys.version,
        __package__,
        str(_HERE),
        platform.machine(),
        _processor(),
        sources,
    ]
    key += [_version(name) for name in ("numba", "llvmlite", "numpy")]
    return _users_cache() / hashlib.sha256(repr(key).encode()).hexdigest()[:24]


def is_complete(folder: Path) -> bool:
    """Whether all kernels have been compiled into ``folder``."""
    return (folder / "complete").exists()


def set_complete(folder: Path) -> None:
    """Say that all kernels are in ``folder``."""
    (folder / "complete").touch()


def fill_aside(folder: Path) -> None:
    """Start a process of low priority that compiles the kernels, unless one is at it; nothing happens if that fails."""
    lock = folder / "compiling"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if lock.exists() and time.time() - lock.stat().st_mtime > LONGEST:
            lock.unlink()
        lock.touch(exist_ok=False)
    except OSError:
        return
    options: dict = {"start_new_session": True}
    if sys.platform == "win32":
        flags = subprocess.BELOW_NORMAL_PRIORITY_CLASS | subprocess.CREATE_NO_WINDOW
        options = {"creationflags": flags | subprocess.CREATE_NEW_PROCESS_GROUP}
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    nothing = subprocess.DEVNULL
    try:
        _running.append(
            subprocess.Popen(
                [sys.executable, "-c", _FILL, str(_HERE), __package__, str(lock)],
                stdin=nothing, stdout=nothing, stderr=nothing, env=environment, cwd=folder, **options,
            )
        )  # fmt: skip
    except OSError:
        lock.unlink(missing_ok=True)


def _users_cache() -> Path:
    if folder := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(folder) / "detp"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "detp" / "cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "detp"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "detp"


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def _processor() -> str:
    """What this processor is and can do, as far as the system says: a home folder may serve several machines."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
        return "".join(line for line in lines[:64] if line.startswith(("model name", "flags", "Features", "CPU part")))
    except OSError:
        return platform.processor()
