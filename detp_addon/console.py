"""The ``detp`` program as a process of its own; imports nothing large before signals are looked after."""

from __future__ import annotations

import os
import sys
import traceback
from contextlib import suppress
from typing import NoReturn

from .interrupts import end_on_signals, finish
from .leftovers import own_temporary_folder


def console() -> NoReturn:
    """Run the command with the process's arguments and end the process with its exit status."""
    end_on_signals(alone=True)
    _open_closed_streams()
    own_temporary_folder()
    try:
        from .command import main

        status = main()
    except BaseException:
        traceback.print_exc()
        status = 1
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
    finish(status)


def _open_closed_streams() -> None:
    """Let standard streams that are closed lead nowhere: the next file that is opened would take their place."""
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
