"""Inputs and outputs: who may overwrite what, and what is no scene."""

from pathlib import Path

import pytest
from detp.core.errors import InvalidSettingError, UnreadableFileError
from detp.detp_addon.files.find_scenes import FoundScene
from detp.detp_addon.files.open_files import check_readable, plan_outputs, plan_side_files


def named(*paths):
    return [FoundScene(Path(path)) for path in paths]


def test_without_a_name_the_bake_goes_beside_its_scene():
    assert plan_outputs(named("x/a.blend", "b.blend"), None) == [Path("x/a_baked.blend"), Path("b_baked.blend")]


def test_a_file_takes_one_scene_and_a_folder_any_number(tmp_path):
    a, b = tmp_path / "a.blend", tmp_path / "b.blend"
    assert plan_outputs(named(a), str(tmp_path / "c.blend")) == [tmp_path / "c.blend"]
    assert plan_outputs(named(a), str(a)) == [a]
    for folder in (str(tmp_path), f"{tmp_path}/new/"):
        assert plan_outputs(named(a), folder) == [Path(folder) / "a_baked.blend"]
    assert plan_outputs(named(a, b), f"{tmp_path}/new") == [tmp_path / "new" / f"{name}_baked.blend" for name in "ab"]


@pytest.mark.parametrize(
    ("scenes", "output"),
    [
        (["a.blend"], "neither"),
        (["a.blend", "b.blend"], "one.blend"),
        (["a.blend", "a.blend"], None),
        (["x/a.blend", "y/a.blend"], "out/"),
        (["a.blend", "a_baked.blend"], None),
        (["x/a.blend", "out/a_baked.blend"], "out/"),
    ],
)
def test_what_would_overwrite_a_scene_or_another_bake_is_refused(scenes, output):
    with pytest.raises(InvalidSettingError):
        plan_outputs(named(*scenes), output)


def test_pictures_are_named_after_their_scenes_when_there_are_several(tmp_path):
    a, b = Path("a.blend"), Path("b.blend")
    assert plan_side_files(named(a), "p.png", "r.json") == ([Path("p.png")], Path("r.json"))
    assert plan_side_files(named(a, b), "x/p.png", None) == ([Path("x/p_a.png"), Path("x/p_b.png")], None)
    assert plan_side_files(named(a, b), None, None) == ([None, None], None)
    for scenes, preview, report in (([a], "a.blend", None), ([a], None, "a.blend"), ([a, a], "p.png", None)):
        with pytest.raises(InvalidSettingError):
            plan_side_files(named(*scenes), preview, report)


def test_each_unreadable_file_has_its_own_sentence(tmp_path):
    text, empty = tmp_path / "text.blend", tmp_path / "empty.blend"
    text.write_text("# a text")
    empty.touch()
    cases = {tmp_path / "no.blend": "does not exist", tmp_path: "folder", text: "not a .blend", empty: "empty"}
    for path, words in cases.items():
        with pytest.raises(UnreadableFileError, match=words) as raised:
            check_readable(path)
        assert str(path) in str(raised.value)
    for start in (b"BLENDER-v405", b"BLENDER17-01v0502", b"\x28\xb5\x2f\xfd...", b"\x1f\x8b\x08..."):
        text.write_bytes(start)
        check_readable(text)
