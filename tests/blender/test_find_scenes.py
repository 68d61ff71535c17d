"""Files, folders, patterns and lists: which scenes they mean, and where the outputs of these go."""

import io
import os
from pathlib import Path

import pytest
from detp.core.errors import InvalidSettingError
from detp.detp_addon.files.find_scenes import find_scenes
from detp.detp_addon.files.open_files import plan_outputs, plan_side_files


@pytest.fixture
def levels(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a", "a_baked", "b", "lonely_baked", ".hidden", "deep/a", ".git/x", "deep/er/c", "out/a_baked"):
        path = Path("levels", f"{name}.blend")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    Path("levels/notes.txt").touch()
    return Path("levels")


def found(*names, recursive=False, listed=b"", output=None):
    scenes = find_scenes(names, recursive, io.BytesIO(listed), output)
    return [str(scene.path) for scene in scenes], [str(scene.folder) for scene in scenes]


def test_a_folder_means_its_scenes_without_their_bakes(levels):
    assert found("levels")[0] == ["levels/a.blend", "levels/b.blend", "levels/lonely_baked.blend"]
    paths, folders = found("levels", recursive=True, output="levels/out")
    assert paths[3:] == ["levels/deep/a.blend", "levels/deep/er/c.blend"] and folders[2:] == [".", "deep", "deep/er"]


def test_patterns_and_names_and_each_scene_once(levels):
    assert found("levels/[ab]*.blend")[0] == ["levels/a.blend", "levels/b.blend"]
    assert found("levels/b.blend", "levels", "levels/../levels/b.blend")[0][:2] == ["levels/b.blend", "levels/a.blend"]
    paths, folders = found("levels/**/?.blend", recursive=True)
    assert sorted(zip(paths, folders, strict=True))[2:] == [
        ("levels/deep/a.blend", "deep"),
        ("levels/deep/er/c.blend", "deep/er"),
    ]


def test_a_list_comes_by_lines_or_zero_bytes_in_any_bytes(levels):
    strange = os.fsdecode(b"\xff\n.blend")
    assert found("-", listed=b"levels/a.blend\r\n\nlevels/deep\n")[0] == ["levels/a.blend", "levels/deep/a.blend"]
    assert found("-", listed=b"\xff\n.blend\0levels/b.blend\0")[0] == [strange, "levels/b.blend"]


@pytest.mark.parametrize(
    ("names", "words"),
    [(["empty"], "holds no .blend"), (["levels/x*.blend"], "is named like"), (["-"], "names no scene")],
)
def test_what_means_no_scene_is_said(levels, names, words):
    Path("empty").mkdir()
    with pytest.raises(InvalidSettingError, match=words):
        found(*names)


def test_outputs_and_pictures_keep_the_folders_and_never_meet(levels):
    scenes = find_scenes(["levels"], True, None, "out")
    outputs = plan_outputs(scenes, "out")
    assert Path("out/a_baked.blend") in outputs and Path("out/deep/a_baked.blend") in outputs
    assert Path("p/deep/x_a.png") in plan_side_files(scenes, "p/x.png", None)[0]
    for names in (["levels", "levels/deep"], ["levels/a.blend", "levels/deep/a.blend"]):
        with pytest.raises(InvalidSettingError, match="--recursive"):
            plan_outputs(find_scenes(names, False, None), "out")
