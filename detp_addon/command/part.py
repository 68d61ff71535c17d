"""One file of a batch, in the process that processes.py started for it: a job comes in as JSON, and messages go out."""

from __future__ import annotations

import argparse
import json
import os
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

from ...core.errors import InvalidSettingError
from ..steps import JobProgress
from .blender_output import blender_silenced
from .interrupts import end_process
from .jobs import SceneJob

#: seconds between two messages on the progress
INTERVAL = 0.25


def add_part(commands) -> None:
    """Add the subcommand, which is not for people, to argparse's ``commands``."""
    commands.add_parser("part").set_defaults(run=_part)


def _part(_arguments: argparse.Namespace) -> int:
    messages = Messages(_own_channel())
    job = json.loads(sys.stdin.buffer.readline())
    threading.Thread(target=_end_with_parent, name="parent", daemon=True).start()
    paths = (None if job[name] is None else Path(job[name]) for name in ("scene", "output", "preview"))
    with blender_silenced():
        from .bake_file import bake_file
    try:
        outcome = bake_file(SceneJob(*paths), job["options"], messages, job["drawn"])
    except InvalidSettingError as error:
        messages.send("usage", str(error))
        return 2
    messages.send("outcome", vars(outcome))
    return int(outcome.failure is not None)


class Messages:
    """Tells the process that started this one how the bake goes, by lines of JSON on a file's descriptor."""

    def __init__(self, channel: int):
        self._channel = channel
        self._last = -float("inf")

    def show(self, _title: str, progress: JobProgress) -> None:
        """Tell where the bake stands, if it is time to."""
        if time.monotonic() - self._last > INTERVAL:
            self._last = time.monotonic()
            self.send("progress", [progress.phase, progress.fraction, progress.remaining])

    def line(self, text: str) -> None:
        """Tell a line for people."""
        self.send("line", text)

    def complain(self, text: str) -> None:
        """Tell a line on a fault."""
        self.send("complaint", text)

    def send(self, kind: str, content) -> None:
        """Send one message."""
        line = json.dumps({kind: content}).encode("ascii") + b"\n"
        with suppress(OSError):  # nobody listens any more, and the end of the input will say so
            while line:
                line = line[os.write(self._channel, line) :]


def _own_channel() -> int:
    """Standard output, from now on for messages alone: what Blender or a file's names may print goes nowhere."""
    channel = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.close(nowhere)
    return channel


def _end_with_parent() -> None:
    """End this process when nobody holds the other end of its standard input any more."""
    with suppress(OSError, ValueError):
        while os.read(0, 1):
            pass
    end_process()
