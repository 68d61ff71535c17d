"""``detp tradeoff``: what it writes and says, on scenes of a few faces."""

import json
import sys
from importlib.util import find_spec

import bpy
import numpy as np
import pytest
from detp.core.settings import BakeSettings
from detp.detp_addon.command.command import main
from detp.detp_addon.tradeoff import candidates
from detp.detp_addon.tradeoff.candidates import Measured
from small_scenes import cube, grid, lamp, opened, painted, saved


def few(_radius, _quick, _names):
    return [
        Measured("few", "quality", BakeSettings(photons=2000), preset=True),
        Measured("many", "disc-index", BakeSettings(photons=8000)),
    ]


@pytest.fixture
def empty(tmp_path, monkeypatch):
    """An empty scene, where bakes of ours have few photons; returns the path to save it at."""
    monkeypatch.setattr(candidates, "candidates", few)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return tmp_path / "scene.blend"


def tradeoff(scene, out, *more):
    options = ("--quick", "--points", "40", "--reference-samples", "16", "--samples", "1,4")
    return main(["tradeoff", str(scene), "-o", str(out), *options, *more])


def test_it_writes_tables_and_a_report_and_takes_the_reference_from_its_file(empty, tmp_path, monkeypatch, capsys):
    painted(grid("Floor"), (0.8, 0.2, 0.2))
    first = cube("Box")
    twin = bpy.data.objects.new("Twin", first.data)
    twin.location = (1.5, 1.5, 0.5)
    bpy.context.collection.objects.link(twin)
    hidden, thick = cube("Hidden", (-1.5, 0, 0.5), 0.5), cube("Thick", (0, 1.5, 0.5), 0.5)
    hidden.hide_viewport = True
    thick.modifiers.new("Bevel", "BEVEL")
    lamp()
    saved(empty)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    out = tmp_path / "new" / "out"
    assert tradeoff(empty, out, "--runs", "2") == 0
    said = capsys.readouterr()
    assert said.err.strip() == 'detp: The plots need matplotlib: install it with pip install ".[study]".'
    found = json.loads((out / "tradeoff.json").read_text())
    assert [run["label"] for run in found["runs"]][:2] == ["few", "many"]
    assert {run["who"] for run in found["runs"]} == {"detp", "cycles", "cycles inside"}
    for run in found["runs"]:
        assert run["seconds"] > 0 and run["error"] is not None and run["points"] == found["runs"][0]["points"]
    assert {"button", "one object"} <= set(found["runs"][0]) and found["runs"][0]["runs"] == 2
    assert found["points"]["objects"] == 3 and found["points"]["hidden"] > 0  # beneath the boxes
    assert len(found["warnings"]) == 2
    for name, why in (("'Hidden'", "hidden in the viewport"), ("'Thick'", "modifiers that change its faces")):
        assert any(name in warning and why in warning for warning in found["warnings"])
    table = (out / "tradeoff.csv").read_text().splitlines()
    assert table[0].startswith("who,label") and len(table) == len(found["runs"]) + 1
    assert "detp tradeoff scene.blend" in (out / "tradeoff.md").read_text()
    assert not list(out.glob("*.png"))

    kept = next(out.glob("reference_*.npz"))
    before = kept.read_bytes()
    assert tradeoff(empty, tmp_path / "again", "--no-cycles", "--reference", str(kept)) == 0
    assert f"Reference from {kept}" in capsys.readouterr().out and kept.read_bytes() == before
    assert {run["who"] for run in json.loads((tmp_path / "again" / "tradeoff.json").read_text())["runs"]} == {"detp"}

    opened(empty)
    cube("More", (3, 3, 3))
    saved(empty)
    assert tradeoff(empty, tmp_path / "again", "--no-cycles", "--reference", str(kept)) == 1
    assert "is that of another scene" in capsys.readouterr().err


def test_a_plane_in_the_sun_is_what_it_must_be_for_all_and_is_drawn(empty, tmp_path):
    grid("Floor")
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle = 3.0, 0.0
    bpy.context.collection.objects.link(sun)
    saved(empty)
    assert tradeoff(empty, tmp_path) == 0
    kept = np.load(next(tmp_path.glob("reference_*.npz")))
    assert kept["halves"] == pytest.approx(3.0 / np.pi, rel=1e-4)
    for run in json.loads((tmp_path / "tradeoff.json").read_text())["runs"]:
        assert run["error"] < 1e-4 and run["mean ratio"] == pytest.approx(1.0, abs=1e-4)
    assert {path.name for path in tmp_path.glob("tradeoff.[ps][nv]g")} == (
        {"tradeoff.png", "tradeoff.svg"} if find_spec("matplotlib") else set()
    )


@pytest.mark.parametrize("what", ["nothing", "a lamp", "a mesh in the dark"])
def test_without_meshes_or_light_it_says_so_in_one_sentence(empty, tmp_path, capsys, what):
    if what == "a lamp":
        lamp()
    if what == "a mesh in the dark":
        cube("Box")
    saved(empty)
    assert tradeoff(empty, tmp_path / "out") == 1
    said = capsys.readouterr().err.strip()
    assert said.startswith("detp: ") and len(said.splitlines()) == 1


@pytest.mark.parametrize(
    "arguments, status, said",
    [
        (["nowhere.blend", "-o", "out"], 1, "does not exist"),
        (["scene.blend", "-o", "out", "--samples", "4,0"], 2, "whole number"),
        (["scene.blend", "-o", "out", "--bakes", "best"], 2, "unknown bakes 'best'"),
        (["scene.blend"], 2, "-o"),
        (["--help"], 0, ""),
    ],
)
def test_wrong_usage(tmp_path, monkeypatch, capsys, arguments, status, said):
    monkeypatch.chdir(tmp_path)
    assert main(["tradeoff", *arguments]) == status
    assert said in capsys.readouterr().err
