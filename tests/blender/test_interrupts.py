"""Signals at any moment: the process ends with them, soon, and leaves nothing behind."""

import os
import signal
import subprocess
import sys
import time

import pytest
from small_scenes import box_on_floor, saved

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows sends a console's signals to all its processes")

#: says when its first line is reached: until then signals are Python's, which even loses one while it loads a file
BEGUN = "from detp.detp_addon.command.console import console; print(flush=True); console()"
QUICK = ["--photons", "20000", "--error", "50%", "--radius", "0.3"]
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
#: a child of the tests starts with the signals as a terminal would give them
FRESH = {"preexec_fn": lambda: [signal.signal(each, signal.SIG_DFL) for each in SIGNALS]}


@pytest.fixture
def started(tmp_path):
    """Starts a bake of a small scene over older outputs, as a process that has reached its first line and ends with the
    test at the latest; its temporary files go to tmp_path / "tmp"."""
    box_on_floor()
    (tmp_path / "tmp").mkdir()
    for name in ("out.blend", "r.json", "p.png"):
        (tmp_path / name).write_bytes(b"older")
    outputs = ["-o", tmp_path / "out.blend", "--report", tmp_path / "r.json"]
    command = [sys.executable, "-c", BEGUN, "bake", saved(tmp_path / "scene.blend"), *outputs]
    before, processes = sorted(path.name for path in tmp_path.iterdir()), []

    def start(*arguments, **options):
        environment = {**os.environ, "TMPDIR": str(tmp_path / "tmp")}
        process = subprocess.Popen(
            [str(part) for part in (*command, *arguments)], env=environment, stdout=subprocess.PIPE, text=True,
            **{"stderr": subprocess.PIPE, **FRESH, **options},
        )  # fmt: skip
        processes.append(process)
        process.stdout.readline()
        return process

    start.clean = lambda: (
        sorted(path.name for path in tmp_path.iterdir()) == before and not any((tmp_path / "tmp").iterdir())
    )
    yield start
    for process in processes:
        process.kill()


def ended(process, number):
    """Send the signal; return the exit status, what was said, and whether it ended in time."""
    begin = time.monotonic()
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    return process.returncode, said.strip(), time.monotonic() - begin < 2.0


# All signals take one way: each is tried, and each moment and each phase with one or two of them.
@pytest.mark.parametrize(
    "number, moment", [*zip(4 * SIGNALS[:2], [0.0, 0.1, 0.3, 0.45, 0.6, 0.8, 1.1, 1.5], strict=True)]
)
def test_a_signal_while_blender_is_loaded_is_not_swallowed(started, number, moment):
    process = started("--photons", 10**10)
    time.sleep(moment)
    status, said, prompt = ended(process, number)
    # The program's own files are being loaded still, which a busy machine may delay.
    early = status == -number and moment < 0.3
    assert prompt and (early or (status, said) == (128 + number, "detp: cancelled"))
    assert started.clean()


@pytest.mark.parametrize(
    "number, phase",
    [*zip([*SIGNALS, *SIGNALS[:2]], ["Reading", "Tracing", "Saved", "Saved", "Reading"], strict=False)],
)
def test_a_signal_in_each_phase_ends_the_bake(started, tmp_path, number, phase):
    process = started(*(("--photons", 10**10) if phase == "Tracing" else QUICK), "--preview", tmp_path / "p.png")
    for line in process.stdout:
        if phase in line:
            break
    assert ended(process, number) == (128 + number, "detp: cancelled", True)
    # After "Saved" the preview is drawn: the scene is there, and the picture is the older one.
    assert ((tmp_path / "out.blend").read_bytes() == b"older") == (phase != "Saved")
    assert (tmp_path / "p.png").read_bytes() == b"older" and started.clean()


def test_a_signal_that_is_ignored_stays_so(started):
    process = started(*QUICK, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    process.stdout.readline()
    assert ended(process, signal.SIGHUP)[0] == 0


def test_left_overs_of_a_killed_bake_are_swept_by_the_next(started, tmp_path):
    process = started("--photons", 10**10)
    process.stdout.readline()
    assert ended(process, signal.SIGKILL)[0] == -signal.SIGKILL
    assert any((tmp_path / "tmp").iterdir())
    process = started(*QUICK)
    assert (process.wait(60), started.clean()) == (0, True)


NOTED = """import os, signal, time
from detp.detp_addon.command.interrupts import end_on_signals
end_on_signals(alone=False)
os.kill(os.getpid(), signal.{})
time.sleep(30)"""


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_inside_blender_whose_threads_run_already_signals_end_it_too(name):
    done = subprocess.run([sys.executable, "-c", NOTED.format(name)], capture_output=True, text=True, **FRESH)
    assert (done.returncode, done.stderr.strip()) == (128 + getattr(signal, name), "detp: cancelled")


def test_a_pipe_that_nobody_reads_does_not_hold_up_the_end(started):
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    try:
        while os.write(writer, bytes(4096)):
            pass
    except BlockingIOError:
        os.set_blocking(writer, True)
    process = started("--photons", 10**10, stderr=writer)
    process.stdout.readline()
    assert ended_silently(process) == (128 + signal.SIGTERM, True)
    os.close(reader)
    os.close(writer)


def ended_silently(process):
    begin = time.monotonic()
    process.send_signal(signal.SIGTERM)
    return process.wait(60), time.monotonic() - begin < 2.0
