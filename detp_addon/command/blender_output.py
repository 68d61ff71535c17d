"""Keeps Blender's own messages off the terminal, so that a command's are seen."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress


@contextmanager
def blender_silenced() -> Iterator[None]:
    """Send what is written to the process's standard output and error to nowhere, Blender's C code included."""
    try:
        kept = [(descriptor, os.dup(descriptor)) for descriptor in (1, 2)]
    except OSError:  # no terminal at all
        yield
        return
    _flush()
    try:
        with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):
            for descriptor, _ in kept:
                os.dup2(nowhere.fileno(), descriptor)
            yield
    finally:
        _flush()
        for descriptor, copy in kept:
            os.dup2(copy, descriptor)
            os.close(copy)


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):  # full, closed, or none at all
            stream.flush()
    try:
        # Blender prints through C, whose buffer would otherwise empty itself when the terminal is back.
        ctypes.CDLL(None).fflush(None)
    except (OSError, TypeError, AttributeError):  # no such library to name on Windows
        return
