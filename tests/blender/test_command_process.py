"""The command as a process of its own: exit status, what it prints where, Ctrl-C."""

import os
import signal
import subprocess
import sys
import time

import bpy
import pytest
from small_scenes import grid, lamp, saved

PROGRAM = [sys.executable, "-c", "from detp.detp_addon.command.console import console; console()", "bake"]


@pytest.fixture
def scene(tmp_path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    grid("Floor")
    lamp()
    return saved(tmp_path / "scene.blend")


def run(*arguments, **options):
    return subprocess.run([*PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=100, **options)


def test_done_and_failed_and_wrong_usage_have_their_own_status(scene, tmp_path):
    done = run(scene, "--photons", 20000, "--radius", 0.3)
    assert (done.returncode, done.stderr) == (0, "")
    assert "Baked 1 object" in done.stdout and "Read blend" not in done.stdout
    failed = run(tmp_path / "none.blend")
    assert (failed.returncode, failed.stdout) == (1, "")
    assert len(failed.stderr.splitlines()) == 1
    wrong = run(scene, "--photons", 0)
    assert (wrong.returncode, wrong.stdout) == (2, "")


def test_wrong_usage_is_found_without_loading_blender():
    command = "from detp.detp_addon.command.command import main; main(sys.argv[1:])"
    check = f"import sys; {command}; sys.exit('bpy' in sys.modules)"
    for arguments in (["bake", "--help"], ["bake", "a.blend", "--radius", "0"], ["bake", "a.blend", "-o", "x"]):
        assert subprocess.run([sys.executable, "-c", check, *arguments], capture_output=True).returncode == 0


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C cannot be sent to one process of a console alone")
def test_ctrl_c_ends_with_130_and_leaves_everything_as_it_was(scene, tmp_path):
    output = tmp_path / "out.blend"
    output.write_bytes(b"older")
    before = scene.read_bytes()
    arguments = [
        scene,
        "-o",
        output,
        "--indirect",
        "photons",
        "--photons",
        10**10,
        "--radius",
        0.1,
        "--report",
        tmp_path / "r.json",
    ]
    # Who runs the tests in the background has Ctrl-C ignored, and so would the bake.
    process = subprocess.Popen(
        [*PROGRAM, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    try:
        for line in process.stdout:
            if "Tracing" in line:
                break
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130
    assert errors.strip() == "detp: cancelled"
    assert output.read_bytes() == b"older" and scene.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.blend", "scene.blend"]


def test_a_reader_that_stops_listening_does_not_stop_the_bake(scene, tmp_path):
    process = subprocess.Popen(
        [*PROGRAM, str(scene), "--photons", "20000", "--radius", "0.3"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    process.stdout.close()
    _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (0, b"")
    assert (tmp_path / "scene_baked.blend").exists()
