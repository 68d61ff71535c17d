"""Progress for people: a bar on a terminal, plain lines in a pipe, nothing when quiet."""

from __future__ import annotations

import shutil
import time
from typing import TextIO

from ..steps import JobProgress
from ..wording import duration
from .terminal import complain, escaped, put

#: seconds between two lines in a pipe, and between two redraws of the bar
LINE_INTERVAL = 3.0
BAR_INTERVAL = 0.1
BAR_WIDTH = 24


class ProgressDisplay:
    """Shows the progress of one scene after another on ``stream``, and prints the lines between them.

    Where that is no terminal a line on the progress comes every ``interval`` seconds.
    """

    def __init__(self, stream: TextIO | None, quiet: bool = False, interval: float = LINE_INTERVAL):
        self._stream = stream
        self._interval = interval
        self._quiet = quiet
        self._bar = stream is not None and not stream.closed and stream.isatty()
        self._shown = ""
        self._phases: set[str] = set()
        self._last = -float("inf")

    def show(self, title: str, progress: JobProgress) -> None:
        """Show where the job called ``title`` stands, if it is time to."""
        if self._quiet:
            return
        now = time.monotonic()
        new_phase = progress.phase not in self._phases
        if not new_phase and now - self._last < (BAR_INTERVAL if self._bar else self._interval):
            return
        self._phases.add(progress.phase)
        self._last = now
        title = escaped(title)
        left = f", {duration(progress.remaining)} left" if progress.remaining is not None else ""
        if not self._bar:
            self._write(f"{title}: {progress.phase}, {progress.fraction:.0%}{left}\n")
            return
        filled = round(progress.fraction * BAR_WIDTH)
        line = f"{title} [{'#' * filled}{'.' * (BAR_WIDTH - filled)}] {progress.fraction:4.0%} {progress.phase}{left}"
        line = line[: shutil.get_terminal_size().columns - 1]
        self._write("\r" + line.ljust(len(self._shown)))
        self._shown = line

    def end(self) -> None:
        """Take the bar away; the next job starts anew."""
        self._clear()
        self._phases = set()
        self._last = -float("inf")

    def line(self, text: str) -> None:
        """Print a line of its own."""
        if not self._quiet:
            self._clear()
            self._write(escaped(text) + "\n")

    def complain(self, text: str) -> None:
        """Print a line of its own on standard error."""
        self._clear()
        complain(text)

    def _clear(self) -> None:
        if self._shown:
            self._write("\r" + " " * len(self._shown) + "\r")
        self._shown = ""

    def _write(self, text: str) -> None:
        # When the reader has seen enough, as in "| head", or the disk behind a log is full, the bake goes on.
        self._quiet = not put(text, self._stream)
