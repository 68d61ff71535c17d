"""A kept bake beside its .blend: Update goes on from it when that is opened again, and what is of no use is said."""

import json
import os

import bpy
import numpy as np
import pytest
from detp.core.errors import NotUpdatableError
from detp.detp_addon.command.command import main
from detp.detp_addon.panel import session
from detp.detp_addon.updates import kept_file, latest_kept
from small_scenes import colours, cube, grid, lamp, painted, saved

NAMES, PLACE, AWAY = ("Floor", "Wall", "Box"), (0.5, 0.5, 0.25), (0.0, 0.9, 0.5)


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """The bytes of a saved .blend and of the bake that was kept beside it, and the first and an updated light."""
    from detp import detp_addon

    bpy.ops.wm.read_factory_settings(use_empty=True)
    detp_addon.register()
    grid("Floor")
    grid("Wall", (0, 2, 2)).rotation_euler.x = np.pi / 2
    painted(cube("Box", PLACE, 0.5), (0.8, 0.2, 0.1))
    lamp((-1, -0.5, 2.5))
    blend = tmp_path_factory.mktemp("kept") / "room.blend"
    assert bpy.ops.detp.bake(quality="DRAFT", keep=True, keep_on_disk=True) == {"FINISHED"}
    assert latest_kept.note_of_file(bpy.context.scene).startswith("Save the file")
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    assert " MB" in latest_kept.note_of_file(bpy.context.scene)
    first = light()
    update(AWAY)
    files = {path.name: path.read_bytes() for path in blend.parent.iterdir() if path.suffix != ".blend1"}
    assert sorted(files) == ["room.blend", "room.detp"]
    yield files, first, light()
    detp_addon.unregister()


@pytest.fixture
def reopened(room, tmp_path):
    """Opens the file again, beside which the kept bake's bytes may be others."""

    def open_again(kept=lambda data: data, name="room"):
        for suffix, change in ((".blend", lambda data: data), (".detp", kept)):
            data = change(room[0]["room" + suffix])
            if data is not None:
                (tmp_path / (name + suffix)).write_bytes(data)
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / f"{name}.blend"))

    return open_again


def light():
    return np.concatenate([colours(name)[:, :3] for name in NAMES])


def update(to=None):
    if to is not None:
        bpy.data.objects["Box"].location = to
    assert bpy.ops.detp.update() == {"FINISHED"}
    return session.latest().outcome.report


def test_an_update_after_reopening_is_what_it_would_have_been_before(room, reopened):
    _, first, moved = room
    reopened()
    assert latest_kept.may_be_read(bpy.context.scene)
    assert update(AWAY).updated
    assert light() == pytest.approx(moved, rel=1e-6)
    assert update(PLACE).updated
    assert np.array_equal(light(), first)


def test_it_is_written_again_when_it_is_another_bake_or_another_file_and_only_then(reopened, tmp_path):
    reopened()
    update(AWAY)
    kept = tmp_path / "room.detp"
    before = kept.stat().st_mtime_ns
    bpy.ops.wm.save_mainfile()
    assert kept.stat().st_mtime_ns == before
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "copy.blend"), copy=True)
    assert not (tmp_path / "copy.detp").exists()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other.blend"))
    assert (tmp_path / "other.detp").exists()
    bpy.context.scene.objects["Lamp"].location.x += 0.3
    assert not update().updated
    bpy.ops.wm.save_mainfile()
    assert (tmp_path / "other.detp").stat().st_mtime_ns > before
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "other.blend"))
    assert update(AWAY).updated


def test_a_bake_that_is_not_to_be_kept_there_is_no_longer_looked_for(reopened):
    reopened()
    bpy.ops.detp.bake(quality="DRAFT")
    assert not latest_kept.may_be_read(bpy.context.scene)


def other_version(data):
    head = json.loads(data[len(kept_file._MAGIC) : kept_file._HEAD])
    changed = kept_file._MAGIC + json.dumps(head | {"version": "0.0.1"}).encode()
    return changed.ljust(kept_file._HEAD) + data[kept_file._HEAD :]


def flipped(data):
    middle = len(data) // 2
    return data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda _: None, "which was kept for it, is missing"),
        (lambda data: data[: len(data) // 2], "is damaged"),
        (lambda data: data[:-1], "is damaged"),
        (flipped, "is damaged"),
        (lambda data: data + b"more", "is damaged"),
        (lambda _: b"", "is no kept bake"),
        (lambda data: b"PK" + data, "is no kept bake"),
        (other_version, "was kept by another version"),
    ],
)
def test_what_is_of_no_use_is_refused(change, reason, reopened):
    reopened(change)
    with pytest.raises(NotUpdatableError, match=f"'room.detp',? {reason}"):
        latest_kept.read_again(bpy.context.scene, bpy.context.view_layer)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_in_its_place_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "room.detp")
    with pytest.raises(NotUpdatableError, match="is no kept bake"):
        kept_file.read_kept(tmp_path / "room.detp", "any")


def test_where_it_belongs_to_another_file_all_light_is_baked_and_that_is_said(reopened):
    reopened()
    bpy.context.scene[kept_file.KEPT_MARK] = "another"
    bpy.context.scene.detp.quality = "DRAFT"
    report = update()
    assert not report.updated
    assert "All light was baked anew, since 'room.detp' was kept of another bake." in report.warnings


def test_a_file_from_a_stranger_makes_nothing_but_what_a_kept_bake_is_made_of(tmp_path):
    path = tmp_path / "room.detp"
    kept_file.write_kept(path, kept_file.BakeRequest(), "mine")
    with pytest.raises(NotUpdatableError, match="damaged"):
        kept_file.read_kept(path, "mine")


def test_a_full_disk_is_named_and_leaves_what_was_there(reopened, tmp_path, monkeypatch):
    reopened()
    update(AWAY)
    monkeypatch.setattr(latest_kept, "_written", None)
    monkeypatch.setattr(kept_file, "_compressed", lambda _: (_ for _ in ()).throw(OSError(28, "No space left")))
    before = (tmp_path / "room.detp").read_bytes()
    bpy.ops.wm.save_mainfile()
    assert "disk is full" in latest_kept.note_of_file(bpy.context.scene)
    assert (tmp_path / "room.detp").read_bytes() == before


def test_the_command_keeps_beside_its_output_and_its_next_run_updates(tmp_path, capsys):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    grid("Floor")
    cube("Box", (-1.6, -1.6, 0.15), 0.2)
    lamp()
    scene, kept = saved(tmp_path / "scene.blend"), tmp_path / "scene_baked.detp"
    arguments = ["bake", str(scene), "--quality", "draft", "--keep"]
    assert main(arguments) == 0 and f"Kept {kept}" in capsys.readouterr().out
    before = kept.read_bytes()
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    bpy.data.objects["Box"].location.x = -1.0
    bpy.ops.wm.save_mainfile()
    assert main(arguments) == 0 and "Updated 2 objects" in capsys.readouterr().out
    assert kept.read_bytes() == before
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene_baked.blend"))
    assert latest_kept.read_again(bpy.context.scene, bpy.context.view_layer)
    # Other options are another bake.
    assert main([*arguments, "--seed", "1"]) == 0
    assert "since 'scene_baked.detp' was kept of another bake" in capsys.readouterr().out
    assert kept.read_bytes() != before
    assert main(["bake", str(scene), "--keep", "--all-scenes"]) == 2
