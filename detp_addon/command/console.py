"""The ``detp`` program as a process of its own; imports nothing before signals are held back."""

from __future__ import annotations

import os
import signal
import sys


def console() -> None:
    """Run the command with the process's arguments and end the process with its exit status."""
    try:
        if hasattr(signal, "pthread_sigmask"):
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP})
    except KeyboardInterrupt:
        # Ctrl-C came before it could be held back; nothing has begun.
        os.write(2, b"\ndetp: cancelled\n")
        os._exit(128 + signal.SIGINT)
    from contextlib import suppress

    from ..files.leftovers import own_temporary_folder
    from .interrupts import end_on_signals, finish

    end_on_signals(alone=True)
    _open_closed_streams()
    own_temporary_folder()
    try:
        from .command import main

        status = main()
    except BaseException:
        sys.excepthook(*sys.exc_info())
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
