"""Progress: a bar that redraws one line on a terminal, lines now and then in a pipe."""

import io

import pytest
from detp.detp_addon.command import progress
from detp.detp_addon.command.progress import ProgressDisplay
from detp.detp_addon.steps import JobProgress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    class Clock:
        now = 0.0

    monkeypatch.setattr(progress.time, "monotonic", lambda: Clock.now)
    return Clock


def test_in_a_pipe_each_phase_is_named_and_then_a_line_now_and_then(clock):
    stream = io.StringIO()
    display = ProgressDisplay(stream)
    for step in range(100):
        clock.now = step / 8
        display.show("room", JobProgress(("Tracing", "Gathering")[step % 2], step / 100, 125 - step))
    assert stream.getvalue().splitlines() == [
        "room: Tracing, 0%, 2 min 5 s left",
        "room: Gathering, 1%, 2 min 4 s left",
        "room: Gathering, 25%, 1 min 40 s left",
        "room: Gathering, 49%, 1 min 16 s left",
        "room: Gathering, 73%, 52 s left",
        "room: Gathering, 97%, 28 s left",
    ]


def test_a_terminal_sees_one_line_that_goes_away(clock):
    stream = Terminal()
    display = ProgressDisplay(stream)
    display.show("room", JobProgress("Tracing", 0.5))
    clock.now = 1.0
    display.show("room", JobProgress("Gathering", 1.0))
    display.end()
    display.line("Done.")
    text = stream.getvalue()
    assert "[############............]  50% Tracing" in text and "[########################] 100% Gathering" in text
    assert text.count("\n") == 1 and text.endswith("\rDone.\n")
    assert all(len(part) < 80 for part in text.split("\r"))


def test_quiet_says_nothing():
    stream = Terminal()
    display = ProgressDisplay(stream, quiet=True)
    display.show("room", JobProgress("Tracing", 0.5))
    display.line("Done.")
    display.end()
    assert stream.getvalue() == ""
