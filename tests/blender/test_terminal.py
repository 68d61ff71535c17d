"""Terminals and logs: nothing out of a file steers them, and none of them ends a bake."""

import io
import json
import os
import subprocess
import sys

import pytest
from detp.detp_addon.command.command import main
from detp.detp_addon.command.progress import ProgressDisplay
from detp.detp_addon.command.terminal import complain, escaped, harmless, put, say
from detp.detp_addon.report import to_json
from small_scenes import box_on_floor, saved

PROGRAM = [sys.executable, "-c", "from detp.detp_addon.command.console import console; console()", "bake"]
QUICK = ["--photons", "2000", "--error", "50%", "--radius", "0.3"]
EVIL = "a\x1b]0;owned\x07\x1b[2J\r\nSaved it\x9b31m\u202e\u2028\udcff"


def test_what_steers_a_terminal_is_written_out():
    shown = r"a\x1b]0;owned\x07\x1b[2J\r\nSaved it\x9b31m\u202e\u2028\udcff"
    assert escaped(EVIL) == shown
    assert escaped("Zimmer 4 größer, 部屋") == "Zimmer 4 größer, 部屋"
    assert harmless("a\tb\r\n\x1b[31m\udcff\n") == "a\tb\r\n\\x1b[31m\\udcff\n"
    stream = io.StringIO()
    assert say(EVIL, stream) and stream.getvalue() == shown + "\n"
    display = ProgressDisplay(stream)
    display.line(EVIL)
    assert stream.getvalue() == 2 * (shown + "\n")


def test_an_alphabet_that_is_too_small_loses_no_line():
    kept = io.BytesIO()
    stream = io.TextIOWrapper(kept, "ascii")
    assert put("größer 部屋\n", stream)
    assert kept.getvalue() == rb"gr\xf6\xdfer \u90e8\u5c4b" + b"\n"


def test_streams_that_take_nothing_are_no_error(monkeypatch):
    closed = io.StringIO()
    closed.close()
    for stream in (None, closed):
        assert not put("x", stream)
        ProgressDisplay(stream).line("x")
    monkeypatch.setattr(sys, "stderr", None)
    complain("x")


def test_a_report_takes_any_name_and_shows_none_that_steers():
    text = to_json([{"scene": EVIL}])
    assert json.loads(text) == [{"scene": EVIL}]
    assert all(character == "\n" or character.isprintable() for character in text)
    text.encode("utf-8")


@pytest.fixture
def scene(tmp_path):
    box_on_floor()
    return saved(tmp_path / "scene.blend")


@pytest.mark.skipif(sys.platform != "linux", reason="names that are not UTF-8, and a device that is always full")
def test_names_that_steer_or_are_not_utf8_bake_and_are_reported(scene, tmp_path, capsys):
    names = [os.fsencode(tmp_path) + name for name in (b"/\xff\xfe.blend", b"/a\x1b[31m\nSaved.blend")]
    for name in names:
        with open(name, "wb") as file:
            file.write(scene.read_bytes())
    report = tmp_path / "r.json"
    assert main(["bake", *map(os.fsdecode, names), *QUICK, "--report", str(report)]) == 0
    said = capsys.readouterr().out
    assert r"\udcff\udcfe.blend" in said and r"a\x1b[31m\nSaved.blend" in said and "\x1b" not in said
    assert [os.fsencode(entry["scene"]) for entry in json.loads(report.read_text())] == names
    assert all(os.path.exists(os.fsencode(entry["output"])) for entry in json.loads(report.read_text()))


def test_wrong_usage_does_not_steer_either(capsys):
    assert main(["bake", "a.blend", "--\x1b[31m"]) == 2
    assert r"--\x1b[31m" in capsys.readouterr().err


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
@pytest.mark.parametrize("redirect", [">/dev/full", ">/dev/full 2>&1", ">&-", ">&- 2>&- <&-", "| true"])
def test_a_stream_that_is_full_closed_or_not_read_does_not_end_a_bake(scene, tmp_path, redirect):
    command = ["sh", "-c", f'"$@" {redirect}', "sh", *PROGRAM, str(scene), *QUICK, "--report", str(tmp_path / "r.json")]
    done = subprocess.run(command, capture_output=True, timeout=100)
    assert (done.returncode, done.stderr) == (0, b"")
    assert (tmp_path / "scene_baked.blend").exists() and json.loads((tmp_path / "r.json").read_text())
