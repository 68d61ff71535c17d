"""Bad input: one clear sentence each, and nothing lost."""

import bpy
import numpy as np
import pytest
from detp.detp_addon.command.command import main
from small_scenes import colours, cube, grid, lamp, opened, painted, saved

QUICK = ["--photons", "20000", "--error", "50%", "--radius", "0.3"]


@pytest.fixture(autouse=True)
def _empty_file():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def refused(path, capsys, *arguments):
    """Bake the scene, which must fail and leave nothing; return the one sentence that says why."""
    before = sorted(path.parent.iterdir()) if path.parent.exists() else []
    assert main(["bake", str(path), *QUICK, *arguments]) == 1
    assert (sorted(path.parent.iterdir()) if before else []) == before
    printed = capsys.readouterr()
    lines = printed.err.splitlines()
    assert len(lines) == 1 and lines[0].startswith(f"{path}: ") and lines[0].endswith((".", "?"))
    assert "Traceback" not in printed.out
    return lines[0].removeprefix(f"{path}: ")


def warned(path, capsys, *arguments):
    """Bake the scene, which must work; return what was printed."""
    assert main(["bake", str(path), *QUICK, *arguments]) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    return printed.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--photons", "0"], "At least 1 photon"),
        (["--photons", "many"], "--photons"),
        (["--radius", "0"], "radius must be a finite number above 0"),
        (["--radius", "-1"], "radius must be a finite number above 0"),
        (["--radius", "nan"], "radius must be a finite number above 0"),
        (["--radius", "inf"], "radius must be a finite number above 0"),
        (["--error", "0"], "between 0 and 100 %"),
        (["--error", "120%"], "between 0 and 100 %"),
        (["--error", "small"], "say 5% or 0.05"),
        (["--time", "0s"], "time to bake must be"),
        (["--time", "soon"], "say 10s"),
        (["--bounces", "-1"], "bounces"),
        (["--seed", "-1"], "seed"),
        (["--gatherer", "magic"], "invalid choice: 'magic'"),
        (["--domain", "face"], "invalid choice: 'face'"),
        (["--attribute", ""], "needs a name"),
        (["--attribute", ".x"], "starts with a dot"),
        (["-o", "nowhere"], "neither a .blend file nor a folder"),
        (["--preview", "a.jpg"], "must end in .png"),
        (["--report", "a.blend"], "must end in .json"),
    ],
)
def test_wrong_usage_is_said_before_any_work(arguments, words, capsys):
    assert main(["bake", "does_not_matter.blend", *arguments]) == 2
    printed = capsys.readouterr()
    assert words in printed.err and printed.out == ""


def test_a_command_and_a_scene_are_needed(capsys):
    assert main([]) == 2
    assert main(["bake"]) == 2
    assert main(["bake", "--help"]) == 0
    assert "--gatherer" in capsys.readouterr().out


def test_missing_file(tmp_path, capsys):
    assert "does not exist" in refused(tmp_path / "none.blend", capsys)


def test_folder(tmp_path, capsys):
    (tmp_path / "folder.blend").mkdir()
    assert "is a folder" in refused(tmp_path / "folder.blend", capsys)


def test_not_a_blend(tmp_path, capsys):
    path = tmp_path / "text.blend"
    path.write_text("hello")
    assert "is not a .blend file" in refused(path, capsys)


@pytest.mark.parametrize("compress", [False, True])
def test_damaged_blend(tmp_path, capsys, compress):
    path = saved(tmp_path / "cut.blend", compress)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    assert "cannot open" in refused(path, capsys)


def test_a_format_of_the_future(tmp_path, capsys):
    path = tmp_path / "future.blend"
    path.write_bytes(b"BLENDER17-99v0990" + b"REND" + bytes(4000))
    assert f"Blender {bpy.app.version_string} cannot open" in refused(path, capsys)


def test_no_permission_is_found_before_the_bake(tmp_path, capsys):
    grid("Floor")
    lamp()
    path = saved(tmp_path / "scene.blend")
    (tmp_path / "file").touch()
    for output in (tmp_path / "file" / "x.blend", tmp_path / "file" / "deeper" / "x.blend"):
        assert "Cannot write" in refused(path, capsys, "-o", str(output))
    assert "Reading the scene" not in capsys.readouterr().out
    assert main(["bake", str(path), *QUICK, "--report", str(tmp_path / "file" / "r.json")]) == 1
    printed = capsys.readouterr()
    assert "Cannot write" in printed.err and printed.out == ""


def test_no_mesh(tmp_path, capsys):
    lamp()
    assert "nothing to bake" in refused(saved(tmp_path / "scene.blend"), capsys)


def test_meshes_without_faces(tmp_path, capsys):
    lamp()
    mesh = bpy.data.meshes.new("points")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
    bpy.context.collection.objects.link(bpy.data.objects.new("Points", mesh))
    bpy.context.collection.objects.link(bpy.data.objects.new("Empty", bpy.data.meshes.new("empty")))
    path = saved(tmp_path / "scene.blend")
    refused(path, capsys)
    grid("Floor")
    assert "Baked 1 object" in warned(saved(path), capsys)


def test_no_light(tmp_path, capsys):
    grid("Floor")
    assert "light" in refused(saved(tmp_path / "scene.blend"), capsys)


def test_unknown_objects_are_named_with_what_was_meant(tmp_path, capsys):
    grid("Floor")
    lamp()
    path = saved(tmp_path / "scene.blend")
    assert "'Flor'" in refused(path, capsys, "--objects", "Flor")
    assert "did you mean 'Floor'?" in refused(path, capsys, "--objects", "floor")
    assert "'Lamp' is not a mesh but a light" in refused(path, capsys, "--objects", "Floor", "Lamp")


def test_a_taken_attribute_name_costs_only_its_object(tmp_path, capsys):
    for name in ("Taken", "Free"):
        grid(name)
    bpy.data.objects["Taken"].data.attributes.new("irradiance", "FLOAT", "POINT").data.foreach_set("value", [0.5] * 16)
    lamp()
    path = saved(tmp_path / "scene.blend")
    printed = warned(path, capsys)
    assert "Baked 1 object" in printed and "Warning: 'Taken' already has an attribute named 'irradiance'" in printed
    opened(tmp_path / "scene_baked.blend")
    values = np.empty(16, np.float32)
    bpy.data.objects["Taken"].data.attributes["irradiance"].data.foreach_get("value", values)
    assert (values == 0.5).all() and colours("Free").max() > 0
    assert "'Taken' already has" in refused(path, capsys, "--objects", "Taken", "-o", str(path))


def test_edit_mode_is_left_and_said(tmp_path, capsys):
    grid("Free")
    obj = grid("Open")
    lamp()
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    path = saved(tmp_path / "scene.blend")
    printed = warned(path, capsys)
    assert "Baked 2 objects" in printed and "Edit Mode" in printed and "Open" in printed
    assert "Baked 1 object" in warned(path, capsys, "--objects", "Open")


def test_vertices_that_are_not_numbers(tmp_path, capsys):
    broken = grid("Broken")
    broken.data.vertices[5].co = (float("nan"), 0, float("inf"))
    grid("Whole", location=(3, 0, 0.5))
    lamp()
    path = saved(tmp_path / "scene.blend")
    assert "Broken" in warned(path, capsys)
    opened(tmp_path / "scene_baked.blend")
    for name in ("Broken", "Whole"):
        assert np.isfinite(colours(name)).all() and colours(name)[:, :3].max() > 0


def test_faces_without_area(tmp_path, capsys):
    flat = grid("Flat")
    for vertex in (0, 1, 4, 5):
        flat.data.vertices[vertex].co = (0, 0, 0)
    lamp()
    warned(saved(tmp_path / "scene.blend"), capsys)
    opened(tmp_path / "scene_baked.blend")
    assert np.isfinite(colours("Flat")).all()


def test_a_light_inside_solid_geometry(tmp_path, capsys):
    cube("Solid")
    grid("Floor", location=(0, 0, -1))
    lamp(location=(0, 0, 0.5))
    assert "inside solid geometry" in warned(saved(tmp_path / "scene.blend"), capsys)
    opened(tmp_path / "scene_baked.blend")
    assert (colours("Floor")[:, :3] == 0).all()


@pytest.mark.parametrize("albedo", [0.0, 1.0])
def test_black_and_perfectly_white_surfaces(tmp_path, capsys, albedo):
    room = cube("Room", location=(0, 0, 0), size=4)
    room.data.flip_normals()
    painted(room, (albedo, albedo, albedo))
    lamp(location=(0.5, 0, 0))
    printed = warned(saved(tmp_path / "scene.blend"), capsys, "--bounces", "8")
    assert ("limit on bounces" in printed) == (albedo == 1)
    opened(tmp_path / "scene_baked.blend")
    values = colours("Room")[:, :3]
    assert np.isfinite(values).all() and values.max() > 0
