"""That a write is whole or not at all: cut short, refused, interrupted, or killed."""

import errno
import json
import os
import resource
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from detp.core.errors import DiskFullError, UnreadableFileError, UnwritableFileError
from detp.detp_addon.command.command import main
from detp.detp_addon.files.leftovers import temporary_name
from detp.detp_addon.files.whole_files import check_whole
from detp.detp_addon.files.write_files import check_writable, replace_file, write_text
from PIL import Image
from small_scenes import box_on_floor, opened, saved


def test_a_link_to_the_output_keeps_being_a_link(tmp_path):
    real, link = tmp_path / "real.json", tmp_path / "link.json"
    link.symlink_to(real)
    for text in ("old", "new"):
        write_text(link, text)
        assert link.is_symlink() and real.read_text() == text


def test_unwritable_places_are_found_before_the_work(tmp_path, monkeypatch):
    check_writable(tmp_path / "a.blend")
    check_writable(tmp_path / "new" / "folder" / "a.blend")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(UnwritableFileError, match="folder"):
        check_writable(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(UnwritableFileError):
        check_writable(tmp_path / "file" / "a.blend")
    (tmp_path / "file").chmod(0o444)  # which an administrator could write to
    with pytest.raises(UnwritableFileError, match="write-protected"):
        check_writable(tmp_path / "file")
    (tmp_path / "file").chmod(0o644)
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(UnwritableFileError, match="write-protected"):
        check_writable(tmp_path / "file")


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="needs a folder that nobody can write to")
def test_a_folder_without_permission_is_found_even_by_the_administrator():
    with pytest.raises(UnwritableFileError):
        check_writable(Path("/proc/self/a.blend"))


def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.json"
    path.write_text("old")
    path.chmod(0o640)

    def fail(made):
        made.write_text("half")
        made.with_name(made.name + "@").write_text("Blender's own temporary name")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        replace_file(path, fail)
    assert os.listdir(tmp_path) == ["a.json"] and path.read_text() == "old"
    with pytest.raises(UnwritableFileError):
        replace_file(path, lambda made: None)
    replace_file(path, lambda made: made.write_text("new"))
    assert os.listdir(tmp_path) == ["a.json"] and path.read_text() == "new"
    assert path.stat().st_mode & 0o777 == 0o640


@pytest.fixture
def scene(tmp_path):
    box_on_floor()
    return saved(tmp_path / "scene.blend")


@contextmanager
def disk(folder, size):
    """A disk of so many bytes."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size // 4096 * 4096}", "detp", str(folder)]
    if sys.platform != "linux" or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("small disks cannot be mounted here")
    try:
        yield folder
    finally:
        subprocess.run(["umount", folder], check=True)


@contextmanager
def longest_file(size):
    """A limit on the size of files, for this process."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def made_files(folder):
    """One file of each kind that bakes write."""
    box_on_floor()
    saved(folder / "plain.blend")
    saved(folder / "compressed.blend", compress=True)
    Image.effect_noise((64, 64), 50).save(folder / "picture.png")
    np.savez_compressed(folder / "arrays.npz", values=np.arange(1000.0))
    return sorted(folder.iterdir())


def test_whole_files_are_known_from_those_cut_anywhere(tmp_path):
    for path in made_files(tmp_path):
        check_whole(path)
        whole = path.read_bytes()
        for length in {0, 1, 7, 12, 30, len(whole) // 3, len(whole) // 2, len(whole) - 4096, *range(-40, 0)}:
            if 0 <= length < len(whole) or -len(whole) < length < 0:
                path.write_bytes(whole[:length])
                with pytest.raises((UnreadableFileError, OSError)):
                    check_whole(path)
        if path.suffix == ".png":
            path.write_bytes(whole[:600] + bytes(100) + whole[700:])  # a page that never arrived
            with pytest.raises(UnreadableFileError):
                check_whole(path)


@pytest.mark.parametrize("share", [0.0, 0.03, 0.3, 0.7, 0.97])
@pytest.mark.parametrize("compress", [False, True])
def test_a_disk_that_fills_keeps_the_older_files_and_is_named(scene, tmp_path, capsys, compress, share):
    saved(scene, compress)
    with disk(tmp_path / "disk", int(share * scene.stat().st_size) + 4096) as folder:
        output = folder / "out.blend"
        output.write_bytes(b"older")
        assert main(["bake", str(scene), "-o", str(output), "--photons", "2000", "--quiet"]) == 1
        said = capsys.readouterr().err
        assert said.startswith(f"{scene}: Cannot write '{output}': the disk is full") and said.count("\n") == 1
        assert output.read_bytes() == b"older" and os.listdir(folder) == ["out.blend"]


def test_a_full_disk_is_named_for_a_preview_and_a_report_too(scene, tmp_path, capsys):
    with disk(tmp_path / "disk", 8192) as folder:
        for name in ("p.png", "r.json"):
            (folder / name).write_bytes(b"older")
        side = ["--preview", str(folder / "p.png"), "--report", str(folder / "r.json")]
        assert main(["bake", str(scene), "--photons", "2000", "--quiet", *side]) == 1
        said = capsys.readouterr().err.splitlines()
        assert [line.partition("': ")[2][:16] for line in said] == ["the disk is full"] * 2
        assert [(folder / name).read_bytes() for name in ("p.png", "r.json")] == [b"older"] * 2
        assert len(os.listdir(folder)) == 2
    opened(tmp_path / "scene_baked.blend")


@pytest.mark.parametrize("compress", [False, True])
def test_a_limit_on_files_is_a_full_disk(scene, tmp_path, capsys, compress):
    saved(scene, compress)
    with longest_file(scene.stat().st_size // 2):
        assert main(["bake", str(scene), "--photons", "2000", "--quiet"]) == 1
    assert "the disk is full, or a quota or limit is reached" in capsys.readouterr().err
    assert {path.suffix for path in tmp_path.iterdir()} <= {".blend", ".blend1"}
    assert not (tmp_path / "scene_baked.blend").exists()


@pytest.mark.parametrize("kind", ["plain.blend", "compressed.blend", "picture.png", "arrays.npz"])
def test_what_a_share_swallowed_replaces_nothing(tmp_path, kind):
    (tmp_path / "made").mkdir()
    made_files(tmp_path / "made")
    content = (tmp_path / "made" / kind).read_bytes()
    path = tmp_path / kind
    path.write_bytes(b"older")
    with pytest.raises(UnwritableFileError, match="not whole"):
        replace_file(path, lambda made: made.write_bytes(content[: len(content) * 2 // 3]))
    assert path.read_bytes() == b"older"
    replace_file(path, lambda made: made.write_bytes(content))
    assert path.read_bytes() == content and sorted(os.listdir(tmp_path)) == sorted(["made", kind])


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
def test_every_way_to_say_that_there_is_no_room_is_understood(tmp_path, number):
    def fail(_):
        raise OSError(number, os.strerror(number))

    with pytest.raises(DiskFullError, match="the disk is full"):
        replace_file(tmp_path / "a.json", fail)
    assert os.listdir(tmp_path) == []


def test_text_that_does_not_read_back_is_not_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "write_bytes", lambda self, content: open(self, "wb").write(content[:-1]))
    with pytest.raises(UnwritableFileError, match="not whole"):
        write_text(tmp_path / "a.json", "[]")
    assert os.listdir(tmp_path) == []


def test_pipes_and_devices_are_never_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe.json")
    (tmp_path / "link.json").symlink_to(tmp_path / "pipe.json")
    for name in ("pipe.json", "link.json"):
        for attempt in (check_writable, lambda path: write_text(path, "[]")):
            with pytest.raises(UnwritableFileError, match="pipe or a device"):
                attempt(tmp_path / name)
    assert (tmp_path / "pipe.json").is_fifo()


def test_a_report_goes_through_links_and_keeps_the_scenes_before_a_fault(scene, tmp_path):
    report, link = tmp_path / "there" / "real.json", tmp_path / "r.json"
    link.symlink_to(report)
    names = [str(scene), str(tmp_path / "none.blend")]
    assert main(["bake", *names, "--photons", "2000", "--quiet", "--report", str(link)]) == 1
    assert link.is_symlink()
    first, second = json.loads(report.read_text())
    assert first["objects"] == 2 and "does not exist" in second["error"]


HOLDER = """import sys, time; from pathlib import Path
from detp.detp_addon.files.leftovers import temporary_name
with temporary_name(Path(sys.argv[1]), ".blend") as made:
    made.write_text("half"); made.with_name(made.name + "@").write_text("half"); print(flush=True); time.sleep(60)"""


def test_left_overs_of_the_dead_are_swept_and_those_of_the_living_are_not(tmp_path):
    others = [tmp_path / name for name in (".detp-0000000g.lock", ".detp-1.lock", ".detp-12345678.blend", "a.lock")]
    for path in others:
        path.touch()
    (tmp_path / ".detp-87654321.lock").symlink_to(tmp_path / "a.lock")
    command = [sys.executable, "-c", HOLDER, str(tmp_path)]
    dead, living = (subprocess.Popen(command, stdout=subprocess.PIPE) for _ in range(2))
    try:
        for process in (dead, living):
            process.stdout.readline()
        assert len(os.listdir(tmp_path)) == 11
        dead.send_signal(signal.SIGKILL)
        dead.wait()
        with temporary_name(tmp_path, ".json"):
            assert len(os.listdir(tmp_path)) == 9
    finally:
        living.kill()
        living.wait()
    assert len(os.listdir(tmp_path)) == 8
    write_text(tmp_path / "a.json", "[]")
    assert sorted(os.listdir(tmp_path)) == sorted([".detp-87654321.lock", "a.json", *(path.name for path in others)])


def test_where_there_are_no_locks_files_are_made_and_removed_all_the_same(tmp_path, monkeypatch):
    def no_locks(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("fcntl.flock", no_locks)
    with temporary_name(tmp_path, ".json") as made:
        made.write_text("half")
        assert os.listdir(tmp_path) == [made.name]
    assert os.listdir(tmp_path) == []
    write_text(tmp_path / "a.json", "[]")
    assert os.listdir(tmp_path) == ["a.json"]
