"""Compiled kernels: the same results as NumPy's, many times faster, where Numba is installed (``pip install .[fast]``).

Numba takes half a minute to compile them, once per machine. A bake never waits for that: while they are not compiled
it goes on with NumPy, and a process beside it compiles them for the next one. ``python -m detp.core.compiled`` compiles
them at once, and DETP_COMPILED=off in the environment leaves them out.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from . import cache

#: Seconds that importing Numba and loading the kernels takes: work is to save more than that.
LOADING = 1.2

_NAME = f"{__name__}.functions"


def kernels(saving: float = float("inf")) -> ModuleType | None:
    """The compiled functions (see functions.py) as a module, or None: then do it with NumPy.

    ``saving``: about how many seconds they would save; below LOADING they are only used if they are loaded already.
    """
    if os.environ.get("DETP_COMPILED", "") == "off":
        return None
    if _NAME in sys.modules:
        return sys.modules[_NAME]
    if saving < LOADING or find_spec("numba") is None:
        return None
    folder = cache.folder_of_kernels()
    if not cache.is_complete(folder):
        cache.fill_aside(folder)
        return None
    return _loaded(folder)


def compile_now() -> Path:
    """Compile the kernels into their folder, which is returned, unless they are there already.

    Raises ImportError without Numba, and OSError when the folder cannot be written.
    """
    folder = cache.folder_of_kernels()
    if not cache.is_complete(folder):
        folder.mkdir(parents=True, exist_ok=True)
        _imported(folder)
        cache.set_complete(folder)
    return folder


def _loaded(folder: Path) -> ModuleType | None:
    try:
        return _imported(folder)
    # As of a NumPy that Numba does not know yet: what is optional stops no bake.
    except (ImportError, OSError, RuntimeError):
        return None


def _imported(folder: Path) -> ModuleType:
    config = import_module("numba").config
    before, config.CACHE_DIR = config.CACHE_DIR, str(folder)
    try:
        return import_module(_NAME)
    finally:
        config.CACHE_DIR = before
