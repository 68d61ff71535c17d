"""The command line on scenes that the tests make: what comes out, and what is never lost."""

import errno
import json
import os
import re

import bpy
import numpy as np
import pytest
from detp.core.errors import SceneBusyError
from detp.detp_addon.command import bake_file
from detp.detp_addon.command.command import main
from detp.detp_addon.preview import render_preview as preview
from detp.detp_addon.writing.face_division import LEAST_MORE
from PIL import Image
from small_scenes import colours, cube, grid, lamp, opened, painted, saved

KEYS = (
    "scene output objects points triangles lights photons shadow_rays segments radius gatherer seconds "
    "relative_error modelled left_out warnings"
).split()
QUICK = ["--photons", "20000", "--error", "50%", "--radius", "0.3"]


@pytest.fixture(autouse=True)
def _empty_file():
    bpy.ops.wm.read_factory_settings(use_empty=True)


@pytest.fixture
def scene(tmp_path):
    """A floor, a box on it and a lamp above: the scene that most tests bake."""
    painted(grid("Floor"), (0.8, 0.4, 0.2))
    cube("Box")
    lamp()
    return saved(tmp_path / "scene.blend")


def test_a_bake_writes_a_copy_with_light_in_it(scene, tmp_path, capsys):
    before = scene.read_bytes()
    assert main(["bake", str(scene), *QUICK]) == 0
    assert scene.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene.blend", "scene_baked.blend"]
    printed = capsys.readouterr()
    assert printed.err == ""
    assert "Baked 2 objects, 40 points with 20 000 photons" in printed.out
    assert f"Saved {tmp_path / 'scene_baked.blend'}" in printed.out
    assert "scene: Reading the scene" in printed.out and "\r" not in printed.out
    opened(tmp_path / "scene_baked.blend")
    for name in ("Floor", "Box"):
        mesh = bpy.data.objects[name].data
        layer = mesh.attributes["irradiance"]
        assert (layer.data_type, layer.domain) == ("FLOAT_COLOR", "CORNER")
        assert mesh.attributes.active_color_name == mesh.attributes.default_color_name == "irradiance"
        values = colours(name)
        assert np.isfinite(values).all() and values[:, :3].max() > 0 and (values[:, 3] == 1).all()


def test_the_report_has_every_key(scene, tmp_path):
    report = tmp_path / "report.json"
    assert main(["bake", str(scene), *QUICK, "--report", str(report), "--quiet"]) == 0
    (entry,) = json.loads(report.read_text())
    assert set(KEYS) <= set(entry)
    assert set(entry["seconds"]) == {"export", "shadow", "trace", "gather", "write", "total"}
    assert (entry["scene"], entry["output"]) == (str(scene), str(tmp_path / "scene_baked.blend"))
    assert (entry["objects"], entry["points"], entry["photons"], entry["radius"]) == (2, 40, 20000, 0.3)
    assert (entry["lights"], entry["triangles"]) == (1, 30)
    assert entry["segments"] > 0
    assert 0 < entry["relative_error"] < 1
    assert any("point light" in feature for feature in entry["modelled"])


def test_a_bake_aims_at_an_error_or_ends_in_time(scene, tmp_path):
    report = tmp_path / "report.json"
    vertices = ["--fit", "vertices"]  # small scenes have more places on faces than their errors need
    assert main(["bake", str(scene), "--error", "0.5%", "--report", str(report), "--quiet", *vertices]) == 0
    (entry,) = json.loads(report.read_text())
    assert 0.002 < entry["relative_error"] <= 0.005
    assert main(["bake", str(scene), "--time", "1.5s", "--report", str(report), "--quiet"]) == 0
    (entry,) = json.loads(report.read_text())
    assert 0.5 < entry["seconds"]["total"] < 3


@pytest.mark.parametrize("time", [[], ["--time", "3s"]], ids=["to its error", "in a time"])
def test_faces_of_the_output_are_divided_where_light_changes(scene, tmp_path, time, monkeypatch):
    asked, real = [], bake_file.bake_scene
    monkeypatch.setattr(bake_file, "bake_scene", lambda *args: asked.append(args[2].settings) or real(*args))
    direct = ["--indirect", "off", "--error", "5%", "--quiet"]
    assert main(["bake", str(scene), *direct, "--subdivide", "2", *time, "--report", str(tmp_path / "a.json")]) == 0
    opened(tmp_path / "scene_baked.blend")
    meshes = [bpy.data.objects[name].data for name in ("Floor", "Box")]
    assert 24 < sum(len(mesh.vertices) for mesh in meshes) <= 24 + LEAST_MORE
    assert all(len(mesh.attributes["irradiance"].data) == len(mesh.loops) for mesh in meshes)
    (note,) = [
        warning
        for warning in json.loads((tmp_path / "a.json").read_text())[0]["warnings"]
        if warning.startswith("Divided")
    ]
    after, before = (float(share) for share in re.findall(r"([0-9.]+) %", note))
    assert after < before
    # The rough bakes have half of the time, and then end as drafts do.
    assert [each.target_error for each in asked] == [0.08, 0.08, 0.05]
    assert [each.seconds for each in asked] == ([0.75, 0.75, 3.0] if time else [None] * 3)


def test_quantities_are_the_same_light_in_other_units(scene, tmp_path):
    baked = {}
    for quantity in ("lighting", "irradiance", "shaded"):
        out = tmp_path / f"{quantity}.blend"
        assert main(["bake", str(scene), *QUICK, "-o", str(out), "--quantity", quantity, "--quiet"]) == 0
        opened(out)
        baked[quantity] = colours("Floor")[:, :3]
    assert baked["lighting"].max() > 0
    np.testing.assert_allclose(baked["irradiance"], baked["lighting"] * np.pi, rtol=1e-6)
    np.testing.assert_allclose(baked["shaded"], baked["lighting"] * [0.8, 0.4, 0.2], rtol=1e-5)


def test_domain_attribute_and_objects_are_as_asked(scene, tmp_path):
    arguments = ["--domain", "point", "--attribute", "Glow", "--objects", "Floor", "--quiet"]
    assert main(["bake", str(scene), *QUICK, *arguments]) == 0
    opened(tmp_path / "scene_baked.blend")
    layer = bpy.data.objects["Floor"].data.attributes["Glow"]
    assert (layer.data_type, layer.domain) == ("FLOAT_COLOR", "POINT")
    assert "Glow" not in bpy.data.objects["Box"].data.attributes


def test_the_same_seed_gives_the_same_light(scene, tmp_path):
    for name, seed in (("a", "5"), ("b", "5"), ("c", "6")):
        assert main(["bake", str(scene), *QUICK, "-o", str(tmp_path / f"{name}.blend"), "--seed", seed, "--quiet"]) == 0
    values = {}
    for name in "abc":
        opened(tmp_path / f"{name}.blend")
        values[name] = colours("Floor")
    np.testing.assert_array_equal(values["a"], values["b"])
    assert (values["a"] != values["c"]).any()


def test_other_layers_modes_and_layout_are_kept(tmp_path):
    mesh = grid("Floor").data
    lamp()
    paint = mesh.color_attributes.new("paint", "BYTE_COLOR", "POINT")
    paint.data.foreach_set("color", np.linspace(0, 1, 64, dtype=np.float32))
    mesh.attributes.new("weights", "FLOAT", "FACE")
    bpy.data.workspaces[0].name = "My own layout"
    bpy.data.texts.new("notes").write("keep me")
    image = Image.new("RGB", (4, 4))
    (tmp_path / "textures").mkdir()
    image.save(tmp_path / "textures" / "wall.png")
    bpy.data.images.load(str(tmp_path / "textures" / "wall.png")).use_fake_user = True
    path = saved(tmp_path / "scene.blend", compress=True)
    opened(path)
    bpy.data.images["wall.png"].filepath = "//textures/wall.png"
    bpy.ops.wm.save_mainfile(compress=True)
    before = colours("Floor", "paint")
    assert main(["bake", str(path), *QUICK, "-o", f"{tmp_path}/out/", "--quiet"]) == 0
    output = tmp_path / "out" / "scene_baked.blend"
    assert not output.read_bytes().startswith(b"BLENDER")
    opened(output)
    np.testing.assert_array_equal(colours("Floor", "paint"), before)
    assert "weights" in bpy.data.objects["Floor"].data.attributes
    assert "My own layout" in bpy.data.workspaces
    assert bpy.data.texts["notes"].as_string().strip() == "keep me"
    assert bpy.path.abspath(bpy.data.images["wall.png"].filepath).endswith("wall.png")
    assert bpy.data.images["wall.png"].filepath.startswith("//") and bpy.data.images["wall.png"].size[0] == 4
    assert len(bpy.data.scenes) == 1 and len(bpy.data.cameras) == 0


def test_the_input_is_overwritten_only_when_it_is_named(scene):
    assert main(["bake", str(scene), *QUICK, "-o", str(scene), "--quiet"]) == 0
    opened(scene)
    assert colours("Floor").max() > 0


def test_objects_that_share_a_mesh_hold_different_light(tmp_path, capsys):
    near = grid("Near")
    far = bpy.data.objects.new("Far", near.data)
    far.location = (20, 0, 0)
    bpy.context.collection.objects.link(far)
    lamp()
    path = saved(tmp_path / "scene.blend")
    assert main(["bake", str(path), *QUICK]) == 0
    assert "'Far' shared its mesh" in capsys.readouterr().out
    opened(tmp_path / "scene_baked.blend")
    assert bpy.data.objects["Near"].data != bpy.data.objects["Far"].data
    assert colours("Near")[:, :3].mean() > 10 * colours("Far")[:, :3].mean()


def test_linked_meshes_shade_and_reflect_but_are_not_written(tmp_path, capsys):
    cube("Linked", location=(0, 0, 1), size=1.0)
    library = saved(tmp_path / "library.blend")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    grid("Floor")
    lamp(location=(0, 0, 3))
    free = saved(tmp_path / "free.blend")
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.objects = ["Linked"]
    bpy.context.collection.objects.link(wanted.objects[0])
    shaded = saved(tmp_path / "shaded.blend")
    before = library.read_bytes()
    assert main(["bake", str(free), *QUICK]) == main(["bake", str(shaded), *QUICK]) == 0
    printed = capsys.readouterr().out
    assert printed.count("'Linked' is linked from the library") == 1
    assert library.read_bytes() == before
    light = {}
    for name in ("free", "shaded"):
        opened(tmp_path / f"{name}_baked.blend")
        light[name] = colours("Floor")[:, :3].mean()
    assert light["shaded"] < 0.8 * light["free"]


def test_several_scenes_share_a_folder_a_report_and_a_preview_name(scene, tmp_path, capsys):
    lamp(location=(-1, 0, 2))
    second = saved(tmp_path / "second.blend")
    out, report, picture = tmp_path / "out", tmp_path / "r.json", tmp_path / "p.png"
    missing = tmp_path / "missing.blend"
    arguments = ["-o", str(out), "--report", str(report), "--preview", str(picture)]
    assert main(["bake", str(scene), str(missing), str(second), *QUICK, *arguments]) == 1
    assert sorted(path.name for path in out.iterdir()) == ["scene_baked.blend", "second_baked.blend"]
    first, failed, last = json.loads(report.read_text())
    assert first["output"] == str(out / "scene_baked.blend") and last["lights"] == 2
    assert failed == {"scene": str(missing), "output": None, "error": f"The file '{missing}' does not exist."}
    printed = capsys.readouterr()
    assert printed.err.splitlines() == [
        f"{missing}: The file '{missing}' does not exist.",
        "1 of 3 scenes failed:",
        f"  {missing}: The file '{missing}' does not exist.",
    ]
    for name in ("scene", "second"):
        assert Image.open(tmp_path / f"p_{name}.png").size == (preview.WIDTH, preview.HEIGHT)
        assert f"Drew {tmp_path / f'p_{name}.png'}, exposed by " in printed.out
    opened(out / "second_baked.blend")
    assert len(bpy.data.materials) == 1 and len(bpy.data.worlds) == 0 and len(bpy.data.cameras) == 0


def test_quiet_prints_errors_only(scene, tmp_path, capfd):
    assert main(["bake", str(scene), *QUICK, "--quiet"]) == 0
    printed = capfd.readouterr()
    assert (printed.out, printed.err) == ("", "")
    assert main(["bake", str(tmp_path / "no.blend"), "--quiet"]) == 1
    printed = capfd.readouterr()
    assert printed.out == "" and len(printed.err.splitlines()) == 1


def test_blender_itself_stays_silent(scene, capfd):
    assert main(["bake", str(scene), *QUICK]) == 0
    printed = capfd.readouterr()
    assert printed.err == ""
    for word in ("Read blend", "Info:", "Fra:", "Saved as", "Saved copy"):
        assert word not in printed.out


def test_scripts_in_a_scene_are_not_run(tmp_path, capsys):
    grid("Floor")
    lamp()
    flag = tmp_path / "ran"
    text = bpy.data.texts.new("evil.py")
    text.write(f"open({str(flag)!r}, 'w')")
    text.use_module = True
    path = saved(tmp_path / "scene.blend")
    assert main(["bake", str(path), *QUICK]) == 0
    assert not flag.exists()
    assert "scripts were not run" in capsys.readouterr().out


def test_a_failed_save_keeps_the_older_output(scene, tmp_path, capsys, monkeypatch):
    output = tmp_path / "out.blend"
    output.write_bytes(b"older")

    def full_disk(source, target):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full_disk)
    assert main(["bake", str(scene), *QUICK, "-o", str(output)]) == 1
    assert output.read_bytes() == b"older"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.blend", "scene.blend"]
    reason = "the disk is full, or a quota or limit is reached"
    assert capsys.readouterr().err == f"{scene}: Cannot write '{output}': {reason}.\n"


def test_a_scene_that_renders_films_is_baked_and_drawn(scene, tmp_path):
    opened(scene)
    settings = bpy.context.scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "VIDEO"
    settings.file_format = "FFMPEG"
    film = saved(tmp_path / "film.blend")
    assert main(["bake", str(film), *QUICK, "--preview", str(tmp_path / "p.png")]) == 0
    assert Image.open(tmp_path / "p.png").size == (preview.WIDTH, preview.HEIGHT)
    opened(tmp_path / "film_baked.blend")
    assert colours("Floor").max() > 0.0
    assert bpy.context.scene.render.is_movie_format


def test_a_preview_that_fails_does_not_hide_the_bake(scene, tmp_path, capsys, monkeypatch):
    def no_picture(*_):
        raise SceneBusyError("Blender could not draw.")

    monkeypatch.setattr(bake_file, "render_preview", no_picture)
    report = tmp_path / "r.json"
    arguments = ["--preview", str(tmp_path / "p.png"), "--report", str(report)]
    assert main(["bake", str(scene), *QUICK, *arguments]) == 1
    (entry,) = json.loads(report.read_text())
    assert entry["output"] == str(tmp_path / "scene_baked.blend") and entry["error"] == "Blender could not draw."
    assert (tmp_path / "scene_baked.blend").exists() and not (tmp_path / "p.png").exists()


def test_direct_and_indirect_light_apart_add_up(scene, tmp_path):
    assert main(["bake", str(scene), *QUICK, "--split", "--quantity", "shaded", "--quiet"]) == 0
    opened(tmp_path / "scene_baked.blend")
    whole, direct, indirect = (colours("Floor", f"irradiance{part}")[:, :3] for part in ("", "_direct", "_indirect"))
    np.testing.assert_allclose(whole, direct + indirect, rtol=1e-5, atol=1e-7)
    assert direct.max() > 0 and indirect.max() > 0
    assert bpy.data.objects["Floor"].data.attributes.active_color_name == "irradiance"


def test_only_the_light_that_is_asked_for(scene, tmp_path):
    baked = {}
    ways = {
        "both": (),
        "direct": ("--indirect", "off"),
        "indirect": ("--direct", "none"),
        "photons": ("--direct", "photons"),
    }
    for name, arguments in ways.items():
        out = tmp_path / f"{name}.blend"
        # What faces show of a part of the light is fitted to that part alone, and need not add up.
        assert main(["bake", str(scene), *QUICK, "-o", str(out), "--quiet", "--fit", "vertices", *arguments]) == 0
        opened(out)
        baked[name] = colours("Floor")[:, :3]
    # Each bake aims its rays by what it has to find.
    assert (baked["direct"] + baked["indirect"]).sum() == pytest.approx(baked["both"].sum(), rel=0.02)
    # 20 000 photons are noisy, but their sum over the floor is not.
    assert baked["photons"].sum() == pytest.approx(baked["both"].sum(), rel=0.1)


def test_ambient_occlusion_needs_no_light(tmp_path):
    grid("Floor")
    cube("Box")
    path = saved(tmp_path / "scene.blend")
    assert main(["bake", str(path), "--quantity", "ambient-occlusion", "--ao-distance", "0.5", "--quiet"]) == 0
    opened(tmp_path / "scene_baked.blend")
    floor = colours("Floor")[:, :3]
    assert floor.max() == pytest.approx(1, abs=1e-5) and 0.1 < floor.min() < 0.95


def test_ambient_occlusion_has_no_parts(scene, capsys):
    assert main(["bake", str(scene), "--quantity", "ambient-occlusion", "--split"]) == 2
    assert "no direct and indirect part" in capsys.readouterr().err
