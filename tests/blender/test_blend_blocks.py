"""Scenes from strangers: what would never end, or never start, is refused by a sentence."""

import gzip
import io
import os
import struct

import bpy
import pytest
from detp.core.errors import UnreadableFileError
from detp.detp_addon.command.command import main
from detp.detp_addon.files.blend_blocks import CutShortError, blocks, check_sound
from detp.detp_addon.files.open_files import check_readable, open_blend
from small_scenes import box_on_floor, cube, saved

zstandard = pytest.importorskip("zstandard")
pytestmark = pytest.mark.skipif(os.name == "nt", reason="pipes have no names in folders there")


@pytest.fixture
def pipe(tmp_path):
    box_on_floor()
    os.mkfifo(tmp_path / "pipe")
    return str(tmp_path / "pipe")


def refused(path, capsys):
    assert main(["bake", str(path), "--photons", "2000", "--quiet"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    return line


def test_pipes_and_devices_are_no_scenes(pipe):
    for path in (pipe, os.devnull, "/dev/zero"):
        with pytest.raises(UnreadableFileError, match="pipe or a device"):
            check_readable(path)


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("device", [False, True])
def test_an_image_that_is_read_from_a_pipe_or_a_device(tmp_path, pipe, capsys, compress, device):
    image = bpy.data.images.new("picture", 4, 4)
    image.source, image.filepath, image.use_fake_user = "FILE", "/dev/zero" if device else pipe, True
    said = refused(saved(tmp_path / "scene.blend", compress), capsys)
    assert f"reads '{'/dev/zero' if device else pipe}', which is a pipe or a device" in said


def test_the_tiles_of_an_image(tmp_path, capsys):
    box_on_floor()
    os.mkfifo(tmp_path / "tile.1002.png")
    image = bpy.data.images.new("picture", 4, 4, tiled=True)
    image.filepath, image.use_fake_user = f"{tmp_path}/tile.<UDIM>.png", True
    assert "tile.1002.png" in refused(saved(tmp_path / "scene.blend"), capsys)


def linked_to(library, path, compress=False, name="Box"):
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.objects = [name]
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    return saved(path, compress)


@pytest.mark.parametrize("compress", [False, True])
def test_a_library_that_is_a_pipe_or_never_ends(tmp_path, capsys, compress):
    library = tmp_path / "library.blend"
    box_on_floor()
    saved(library)
    bpy.data.objects.remove(bpy.data.objects["Box"])
    scene = linked_to(library, tmp_path / "scene.blend", compress)
    open_blend(scene)
    library.write_bytes(b"BLENDER-v405" + bytes(100))
    assert "library.blend' is damaged" in refused(scene, capsys)
    library.unlink()
    os.mkfifo(library)
    assert "library.blend', which is a pipe or a device" in refused(scene, capsys)


def test_a_library_of_a_library(tmp_path, capsys):
    far, near = tmp_path / "far.blend", tmp_path / "near.blend"
    bpy.ops.wm.read_factory_settings(use_empty=True)
    cube("Box")
    saved(far)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    cube("Near")
    linked_to(far, near)
    box_on_floor()
    scene = linked_to(near, tmp_path / "scene.blend", name="Near")
    far.unlink()
    os.mkfifo(far)
    assert "far.blend', which is a pipe or a device" in refused(scene, capsys)


@pytest.mark.parametrize("packed", [bytes, gzip.compress, zstandard.compress])
def test_zeros_without_an_end(tmp_path, packed):
    path = tmp_path / "zeros.blend"
    path.write_bytes(packed(b"BLENDER-v405" + bytes(1 << 20)))
    if packed is bytes:
        os.truncate(path, 1 << 37)
    with pytest.raises(UnreadableFileError, match="damaged: it holds what is no block"):
        check_sound(path)


def test_small_files_that_unpack_without_an_end(tmp_path, monkeypatch):
    monkeypatch.setattr("detp.detp_addon.files.blend_blocks._LARGEST_SMALL", 1 << 20)
    path = tmp_path / "bomb.blend"
    block = struct.pack("<4siQii", b"DATA", 1 << 28, 1, 0, 1) + bytes(1 << 28)
    path.write_bytes(zstandard.compress(b"BLENDER-v405" + block))
    with pytest.raises(UnreadableFileError, match="unpacks to more than 1000 times its size"):
        check_sound(path)


def whole(header, heads):
    return io.BytesIO(header + b"".join(head + b"abcdefgh" for head in heads[:-1]) + heads[-1])


@pytest.mark.parametrize(
    ("header", "layout"),
    [
        (b"BLENDER-v405", lambda code, length: struct.pack("<4siQii", code, length, 7, 7, 7)),
        (b"BLENDER_V248", lambda code, length: struct.pack(">4siIii", code, length, 7, 7, 7)),
        (b"BLENDER17-01v0502", lambda code, length: struct.pack("<4siQqq", code, 7, 7, length, 7)),
    ],
)
def test_blocks_of_all_formats(header, layout):
    heads = [layout(b"REND", 8), layout(b"IM\0\0", 8), layout(b"ENDB", 0)]
    assert list(blocks(whole(header, heads), {b"IM\0\0"})) == [(b"IM\0\0", b"abcdefgh")]
    with pytest.raises(CutShortError):
        list(blocks(whole(header, [*heads[:2], b""])))
    with pytest.raises(UnreadableFileError, match="no block"):
        list(blocks(whole(header, [layout(b"DATA", -1), heads[-1]])))


def test_a_format_of_the_future_is_left_to_blender():
    assert list(blocks(io.BytesIO(b"BLENDER17-99v0990" + bytes(100)))) == []
