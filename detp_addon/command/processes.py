"""Files baked by processes of their own, some at a time: a crash, a kill or a time limit of one touches no other.

Each process runs part.py, is sent its job as a line on its standard input, and answers with lines of JSON on its
standard output. The input stays open: its end tells the process that this one is gone.
"""

from __future__ import annotations

import json
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import BinaryIO

from ...core.errors import DetpError, InvalidSettingError
from ..files.leftovers import sweep
from ..files.open_files import check_readable
from ..steps import JobProgress
from .interrupts import ending
from .jobs import Batch, Outcome, SceneJob, done_before, failed, previews_of, skipped

#: seconds that processes have to end by themselves; bytes of their last words that are looked at
PATIENCE, LAST_WORDS = 1.0, 4096

#: signals by which a process ends that did something it must not
_CRASHES = ("SIGSEGV", "SIGABRT", "SIGBUS", "SIGILL", "SIGFPE", "SIGTRAP", "SIGSYS")

#: Ctrl-C on a terminal reaches this process alone, which ends the others in order
_GROUP = {"creationflags": 0x200} if sys.platform == "win32" else {"process_group": 0}

#: processes that bake, and what
_running: dict[subprocess.Popen, SceneJob] = {}
_starting = threading.Lock()
_ending = False


@dataclass
class Ended:
    """What became of a file, the ``lines`` that its bake had to say, and its complaints of faults of the program."""

    outcome: Outcome | None = None
    lines: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)


def outcomes_apart(batch: Batch) -> Iterator[tuple[int, JobProgress | Ended]]:
    """Bake the files of ``batch`` by processes; yields where each stands and how it ended, by the job's number.

    Closing it ends all processes. Raises InvalidSettingError when a process finds that no file can be baked with
    the options.
    """
    events: queue.SimpleQueue = queue.SimpleQueue()
    left = threading.Event()
    pool = ThreadPoolExecutor(batch.options["jobs"], thread_name_prefix="files")

    def work(number: int) -> None:
        if left.is_set():
            return
        try:
            event = _baked_apart(batch.jobs[number], batch, lambda each: events.put((number, each)))
        except BaseException as error:
            event = error
        if not _ending:  # what is ended with this process has not failed
            events.put((number, event))

    try:
        for number in range(len(batch.jobs)):
            pool.submit(work, number)
        open_ones = len(batch.jobs)
        while open_ones:
            number, event = events.get()
            if isinstance(event, BaseException):
                raise event
            open_ones -= isinstance(event, Ended)
            yield number, event
    finally:
        left.set()
        end_processes(for_good=False)
        pool.shutdown(cancel_futures=True)


def end_processes(for_good: bool = True) -> None:
    """End all processes that still bake: let them clean up first. ``for_good``: none starts any more."""
    global _ending
    with _starting:
        _ending = _ending or for_good
        running = dict(_running)
    for process in running:
        with suppress(OSError):
            process.terminate()
    until = time.monotonic() + PATIENCE
    for process, job in running.items():
        _end_until(process, until)
        _sweep_after(job)


ending.append(end_processes)


def _baked_apart(job: SceneJob, batch: Batch, tell) -> Ended:
    """Bake one file by a process, unless that was done before or there is no such file."""
    begin = time.monotonic()
    try:
        check_readable(job.scene)
    except DetpError as error:
        return Ended(failed(job, str(error)))
    entries = done_before(job, batch.options) if batch.options["resume"] else None
    if entries is not None and (batch.options["dry_run"] or all(path.exists() for path in previews_of(job, entries))):
        return Ended(skipped(entries))
    paths = {name: None if path is None else str(path) for name, path in vars(job).items()}
    message = json.dumps({**paths, "options": batch.options, "drawn": entries})
    ended, limit = Ended(), batch.options["time_limit"]
    with tempfile.TemporaryFile() as words:
        status, late = _talk(_started(job, words), message, limit, ended, tell)
        if ended.outcome is None:
            _sweep_after(job)
            why = f"It took longer than {limit:g} s, and was given up." if late else _why(status, words)
            # It may have been at the picture already.
            ended.outcome = failed(job, why, done_before(job, batch.options) or ())
    ended.outcome = replace(ended.outcome, seconds=time.monotonic() - begin)
    return ended


def _sweep_after(job: SceneJob) -> None:
    """Remove what a process has left, if it was killed."""
    for folder in {path.parent for path in (job.output, job.preview) if path is not None}:
        sweep(folder)
    sweep(Path(tempfile.gettempdir()))


def _talk(process: subprocess.Popen, message: str, limit: float | None, ended: Ended, tell) -> tuple[int, bool]:
    """Send a process the ``message``, and hear what it says; its exit status, and whether it was too late."""
    late = threading.Event()
    timer = threading.Timer(0.0 if limit is None else limit, lambda: (late.set(), _end(process)))
    try:
        if limit is not None:
            timer.start()
        with suppress(OSError):  # it is gone already
            process.stdin.write(message.encode("ascii") + b"\n")
            process.stdin.flush()
        for line in process.stdout:
            if line.endswith(b"\n"):  # and is not the last of a process that ended in the middle of it
                _heard(json.loads(line), ended, tell)
        status = process.wait()
    finally:
        timer.cancel()
        _end(process)
        with _starting:
            _running.pop(process, None)
        process.stdout.close()
        with suppress(OSError):
            process.stdin.close()
    return status, late.is_set()


def _started(job: SceneJob, words: BinaryIO) -> subprocess.Popen:
    with _starting:
        if _ending:
            raise KeyboardInterrupt
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": words}
        process = subprocess.Popen(command(), **pipes, **_GROUP)
        _running[process] = job
    return process


def command() -> list[str]:
    """The program that bakes a part of a batch, as Blender itself or as Python with Blender as a module."""
    bpy = sys.modules.get("bpy")
    if bpy is not None and not getattr(bpy.app, "module", True):
        before = sys.argv[1 : sys.argv.index("--command")] if "--command" in sys.argv else ["--background"]
        return [bpy.app.binary_path, *before, "--command", "detp", "part"]
    # Without the folder that this program was started in, which may be full of strangers' files.
    console = f"from {__package__}.console import console; console()"
    return [sys.executable, "-P", "-c", console, "part"]


def _heard(said: dict, ended: Ended, tell) -> None:
    """Take what a process says."""
    if "progress" in said:
        tell(JobProgress(*said["progress"]))
    elif "line" in said:
        ended.lines.append(said["line"])
    elif "complaint" in said:
        ended.complaints.append(said["complaint"])
    elif "usage" in said:
        raise InvalidSettingError(said["usage"])
    elif "outcome" in said:
        ended.outcome = Outcome(**said["outcome"])


def _end(process: subprocess.Popen) -> None:
    if process.poll() is None:
        with suppress(OSError):
            process.terminate()
        _end_until(process, time.monotonic() + PATIENCE)


def _end_until(process: subprocess.Popen, until: float) -> None:
    try:
        process.wait(max(0.0, until - time.monotonic()))
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _last_words(words: BinaryIO) -> str:
    """The last line that a process wrote to its standard error."""
    words.seek(0, 2)
    words.seek(max(0, words.tell() - LAST_WORDS))
    lines = words.read().decode("utf-8", "replace").split("\n")
    return next((line.strip() for line in reversed(lines) if line.strip()), "")


def _why(status: int, words: BinaryIO) -> str:
    """Why a process ended without an outcome."""
    number = -status if status < 0 else status - 128 if status > 128 else 0
    name = signal.Signals(number).name if number in set(signal.Signals) else ""
    if name in _CRASHES or status >= 0xC0000000:  # as Windows tells it
        return f"Blender crashed on it ({name or hex(status)}): the file may be damaged."
    if name == "SIGKILL":
        return "Its process was killed, by somebody or for want of memory."
    if name:
        return f"Its process was ended by {name}."
    said = _last_words(words)
    return f"Its process ended with status {status}, without a result" + (f": {said}" if said else ".")
