"""Many files: each in a process of its own, resumed, limited, forecast, and told in one table and one report."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import pytest
from detp.detp_addon.command import processes
from detp.detp_addon.command.command import main
from detp.detp_addon.files.bake_mark import read_mark
from detp.detp_addon.files.leftovers import sweep
from detp.detp_addon.preview import render_preview
from small_scenes import box_on_floor, opened, saved

QUICK = ["--error", "50%", "--radius", "0.3", "--indirect", "off"]
PROGRAM = [sys.executable, "-c", "from detp.detp_addon.command.console import console; console()", "bake"]

#: what a file does to the process that bakes it, by its name: crash as Blender does, or never come to an end
PLANTED = """import ctypes, sys, time
def act(event, arguments):
    if event == "open" and sys.argv[-1:] == ["part"]:
        if str(arguments[0]).endswith("crash.blend"): ctypes.string_at(0)
        if str(arguments[0]).endswith("endless.blend"): time.sleep(1000)
sys.addaudithook(act)
"""


@pytest.fixture
def library(tmp_path, monkeypatch):
    """A folder of scenes, with one of the same name below, that children of this process find to act as PLANTED."""
    (tmp_path / "planted").mkdir()
    (tmp_path / "planted" / "sitecustomize.py").write_text(PLANTED)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path / "planted"), os.environ.get("PYTHONPATH", "")]))
    (tmp_path / "lib" / "deep").mkdir(parents=True)
    box_on_floor()
    for name in ("a", "deep/a"):
        saved(tmp_path / "lib" / f"{name}.blend")
    return tmp_path / "lib"


def entries_of(report):
    return {entry["scene"]: entry for entry in json.loads(report.read_text())}


def changed(*paths):
    return [path.stat().st_mtime_ns for path in paths]


def test_what_one_file_does_harms_no_other_and_a_second_run_does_only_what_is_missing(library, tmp_path, capsys):
    whole = (library / "a.blend").read_bytes()
    (library / "crash.blend").write_bytes(whole)
    (library / "damaged.blend").write_bytes(whole[: len(whole) // 2])
    out, report = tmp_path / "out", tmp_path / "r.json"
    arguments = ["-o", str(out), "--recursive", "--report", str(report), "--jobs", "2"]
    arguments = ["bake", str(library), *QUICK, *arguments]
    assert main(arguments) == 1
    outputs = [out / "a_baked.blend", out / "deep" / "a_baked.blend"]
    assert sorted(out.rglob("*.*")) == sorted(outputs)
    told = entries_of(report)
    assert len(told) == 4
    assert told[str(library / "deep" / "a.blend")]["output"] == str(outputs[1])
    words = {"crash": "crashed on it (SIGSEGV)", "damaged": "cannot open"}
    printed = capsys.readouterr()
    for name, reason in words.items():
        assert reason in told[str(library / f"{name}.blend")]["error"]
        assert printed.err.count(f"{library / name}.blend: ") >= 2
    assert "2 baked, 2 failed" in printed.out.splitlines()[-1]

    before = changed(*outputs)
    for name in words:
        (library / f"{name}.blend").unlink()
    assert main([*arguments, "--resume", "--seed", "0"]) == 0
    assert changed(*outputs) == before
    told = entries_of(report)
    assert len(told) == 2 and all(entry["resumed"] and entry["points"] > 0 for entry in told.values())
    assert "2 done before" in capsys.readouterr().out


def test_a_file_that_takes_too_long_is_given_up(library, tmp_path, capsys):
    scene = (library / "a.blend").rename(library / "endless.blend")
    begin = time.monotonic()
    assert main(["bake", str(scene), "-o", f"{tmp_path}/out/", *QUICK, "--time-limit", "3s"]) == 1
    assert 3 < time.monotonic() - begin < 8
    assert capsys.readouterr().err == f"{scene}: It took longer than 3 s, and was given up.\n"
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").iterdir())


def test_resuming_draws_a_picture_that_is_missing_and_bakes_nothing(library, tmp_path, monkeypatch):
    monkeypatch.setattr(render_preview, "WIDTH", 64)
    monkeypatch.setattr(render_preview, "HEIGHT", 36)
    arguments = ["bake", str(library / "a.blend"), *QUICK]
    assert main(arguments) == 0
    before, picture = changed(library / "a_baked.blend"), tmp_path / "p.png"
    assert main([*arguments, "--resume", "--preview", str(picture)]) == 0
    assert changed(library / "a_baked.blend") == before and picture.exists()


def test_resuming_bakes_again_what_changed_in_content_or_options(library, tmp_path, capsys):
    scene, output, report = library / "a.blend", library / "a_baked.blend", tmp_path / "r.json"
    arguments = ["bake", str(scene), *QUICK, "--resume", "--report", str(report)]
    assert main(arguments) == 0
    (first,) = entries_of(report).values()
    before = changed(output)
    capsys.readouterr()
    assert main([*arguments, "--quiet", "--jobs", "2"]) == 0 and changed(output) == before
    (again,) = entries_of(report).values()
    assert again == {**first, "resumed": True} and capsys.readouterr().out == ""
    assert main([*arguments, "--seed", "1"]) == 0 and changed(output) != before
    before = changed(output)
    box_on_floor()
    opened(scene)
    saved(scene, compress=True)
    assert main([*arguments, "--seed", "1"]) == 0 and changed(output) != before
    assert read_mark(output) and read_mark(scene) is None
    output.write_bytes(output.read_bytes()[:-100])
    assert read_mark(output) is None and main([*arguments, "--seed", "1"]) == 0


def test_a_file_that_is_named_inside_a_scene_counts_as_content(library, tmp_path):
    import bpy
    from detp.detp_addon.files.bake_mark import fingerprint

    opened(library / "a.blend")
    image = bpy.data.images.new("wall", 4, 4)
    image.filepath_raw, image.file_format = str(library / "wall.png"), "PNG"
    image.save()
    image.source, image.use_fake_user = "FILE", True
    scene = saved(library / "b.blend")
    found = [fingerprint(scene, {"seed": 0}), fingerprint(scene, {"seed": 1})]
    (library / "wall.png").write_bytes(b"another")
    found.append(fingerprint(scene, {"seed": 0}))
    (library / "wall.png").unlink()
    found.append(fingerprint(scene, {"seed": 0}))
    assert len(set(found)) == 4 and found[-1] == fingerprint(scene, {"seed": 0})


def test_a_dry_run_says_how_long_and_writes_nothing(library, tmp_path, capsys):
    before, report = sorted(library.rglob("*")), tmp_path / "r.json"
    assert main(["bake", str(library / "a.blend"), "--quality", "final", "--dry-run", "--report", str(report)]) == 0
    assert sorted(library.rglob("*")) == before
    (entry,) = json.loads(report.read_text())
    assert entry["forecast"]["points"] == 40 and entry["forecast"]["relative_error"] == pytest.approx(0.02)
    assert entry["forecast"]["seconds"] > 0
    assert "1 forecast: about" in capsys.readouterr().out


def test_options_that_no_file_can_be_baked_with_end_the_batch(library, capsys):
    assert main(["bake", str(library / "a.blend"), "--time-limit", "60s", "--attribute", ".x"]) == 2
    assert "starts with a dot" in capsys.readouterr().err
    for wrong in (["--jobs", "0"], ["--time-limit", "0s"]):
        assert main(["bake", str(library), *wrong]) == 2


def test_inside_blender_parts_are_baked_by_blender(monkeypatch):
    assert processes.command()[0] == sys.executable
    app = SimpleNamespace(module=False, binary_path="/opt/blender")
    monkeypatch.setitem(sys.modules, "bpy", SimpleNamespace(app=app))
    monkeypatch.setattr(sys, "argv", ["blender", "--factory-startup", "--command", "detp", "bake", "a.blend"])
    assert processes.command() == ["/opt/blender", "--factory-startup", "--command", "detp", "part"]


@pytest.mark.skipif(os.name == "nt", reason="Windows sends a console's signals to all its processes")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_batch_that_is_ended_leaves_no_process_and_nothing_half_written(library, tmp_path, number):
    (library / "endless.blend").write_bytes((library / "a.blend").read_bytes())
    report, temporary = tmp_path / "r.json", tmp_path / "tmp"
    temporary.mkdir()
    process = subprocess.Popen(
        [*PROGRAM, str(library), "-o", f"{tmp_path}/out/", *QUICK, "--report", str(report), "--jobs", "2"],
        env={**os.environ, "TMPDIR": str(temporary)}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: [signal.signal(each, signal.SIG_DFL) for each in (signal.SIGINT, signal.SIGTERM)],
    )  # fmt: skip
    for line in process.stdout:
        if line.startswith("Saved"):
            break
    begin = time.monotonic()
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == (-number if number == signal.SIGKILL else 128 + number)
    assert said.strip() == ("" if number == signal.SIGKILL else "detp: cancelled")
    while time.monotonic() - begin < 15.0 and alive(tmp_path):  # those that are still starting see it when they have
        time.sleep(0.05)
    assert not alive(tmp_path)
    sweep(temporary)  # as the next run does
    assert not list(temporary.iterdir()) and not list((tmp_path / "out").glob(".*"))
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["a_baked.blend"]
    assert read_mark(tmp_path / "out" / "a_baked.blend") is not None
    if number != signal.SIGKILL:  # which may come between the line and the report
        assert str(library / "a.blend") in entries_of(report)


def alive(folder):
    """The processes that were started with this folder in their environment, on systems that tell."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            found += [process.name] if f"TMPDIR={folder}".encode() in (process / "environ").read_bytes() else []
    return found
