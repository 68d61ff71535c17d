"""Ends the process at once on Ctrl-C, SIGTERM or a closed terminal, whatever it is doing, and leaves nothing.

Outputs are made under temporary names, so there is nothing to finish. Python's own way, an exception in the main
thread, would wait for Blender, which swallows it, or crashes while it is being loaded.
"""

from __future__ import annotations

import os
import select
import signal
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import NoReturn

from ..files.leftovers import remove_all

#: taken by whoever ends the process, and never given back
_last = threading.Lock()

#: what else must end first, such as processes that this one started
ending: list[Callable[[], None]] = []


def end_on_signals(alone: bool) -> None:
    """From now on SIGINT, SIGTERM and SIGHUP end this process with 128 plus their number.

    ``alone``: the process is this program's and has no other thread yet, so that signals can be blocked in all that
    will be. Call it in the main thread. Signals that are ignored, as under nohup, stay so.
    """
    names = ("SIGINT", "SIGTERM", "SIGHUP")
    signals = {getattr(signal, name) for name in names if hasattr(signal, name)}
    signals = {each for each in signals if signal.getsignal(each) != signal.SIG_IGN}
    if alone and hasattr(signal, "pthread_sigmask"):
        # Blender puts a handler of its own in the place of any other; blocked signals reach none.
        signal.pthread_sigmask(signal.SIG_BLOCK, signals)
        # Python finds this folder by a file that it writes there, once: nobody ends it meanwhile.
        tempfile.gettempdir()
        wait = _blocked(signals)
    else:
        wait = _noted(signals)
    # Blender's messages are kept away by turning standard error elsewhere, so this one goes another way.
    terminal = None
    with suppress(OSError):
        terminal = os.dup(2)
    threading.Thread(target=_end, args=(wait, terminal), name="interrupts", daemon=True).start()


def finish(status: int) -> NoReturn:
    """End the process with ``status``, unless a signal is ending it already."""
    _last.acquire()
    remove_all()
    # Blender as a module may hang, crash or print notes on its memory at exit, after all is done.
    os._exit(status)


def end_process() -> NoReturn:
    """End the process as SIGTERM would, from any thread and without a word."""
    _last.acquire()
    _leave(signal.SIGTERM)


def _leave(number: int) -> NoReturn:
    for end in ending:
        end()
    remove_all()
    os._exit(128 + number)


def _blocked(signals: set[int]) -> Callable[[], int]:
    return lambda: signal.sigwait(signals)


def _noted(signals: set[int]) -> Callable[[], int]:
    """Handlers that only note the signal where a thread can wait for it."""
    reader, writer = os.pipe()
    if os.name != "nt":
        os.set_blocking(writer, False)
    for each in signals:
        signal.signal(each, lambda *_: None)
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    return lambda: os.read(reader, 1)[0]


def _end(wait: Callable[[], int], terminal: int | None) -> None:
    number = wait()
    _last.acquire()
    with suppress(OSError, ValueError, TypeError):
        # A pipe that is full and that nobody reads must not keep us.
        if os.name == "nt" or select.select([], [terminal], [], 0)[1]:
            os.write(terminal, b"\ndetp: cancelled\n")
    _leave(number)
