"""The extension as a user gets it: built, validated, installed by Blender's own installer, and baked with."""

import importlib.util
import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from hashlib import sha256
from pathlib import Path

import pytest
from scipy.stats import norm

ROOT = Path(__file__).parents[2]
BUILDER = ROOT / "tools" / "build_extension.py"
#: everything an archive may hold
SHIPPED = re.compile(
    r"blender_manifest\.toml|__init__\.py|README\.md|CHANGELOG\.md|LICENSE"
    r"|(core|detp_addon)/(\w+/)?\w+\.py"
    r"|wheels/embreex-[\w.]+-cp3\d\d-cp3\d\d-\w+(\.\w+)*\.whl"
)

#: Installs the archive, bakes a square floor under a point light through the installed operator, prints what it found.
INSTALL_AND_BAKE = """
import json, os, sys
from importlib.machinery import PathFinder
import bpy

class WheelOnly:
    # The Python module Blender puts the wheels' folder behind this environment's packages, where embreex is as well.
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == "embreex":
            resources = os.environ["BLENDER_USER_RESOURCES"]
            return PathFinder.find_spec(name, [folder for folder in sys.path if folder.startswith(resources)])

sys.meta_path.insert(0, WheelOnly)
archive, particles, radius = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
addon = sys.modules["bl_ext.user_default.detp"]
addon.unregister()
addon.register()

bpy.ops.mesh.primitive_grid_add(x_subdivisions=2, y_subdivisions=2, size=8)
floor = bpy.context.object
lamp = bpy.data.lights.new("Lamp", "POINT")
lamp.energy, lamp.shadow_soft_size = 100.0, 0.0
holder = bpy.data.objects.new("Lamp", lamp)
holder.location = (0.0, 0.0, 2.0)
bpy.context.collection.objects.link(holder)
result = bpy.ops.detp.bake(photons=particles, radius=radius, fit="VERTICES")
layer = floor.data.attributes[bpy.context.scene.detp.attribute]
middle = [loop.index for loop in floor.data.loops if floor.data.vertices[loop.vertex_index].co.length < 1e-6]

import embreex
print("FOUND " + json.dumps({
    "result": sorted(result),
    "addon": addon.__file__,
    "embreex": embreex.__file__,
    "strays": [name for name in sys.modules if name.partition(".")[0] in ("detp", "core", "detp_addon")],
    "middle": [list(layer.data[index].color) for index in middle],
}), flush=True)
addon.unregister()
os._exit(0)  # Blender as a module may hang at exit
"""


def run_builder(folder, *options):
    return subprocess.run(
        [sys.executable, BUILDER, "--output-dir", folder, *options], capture_output=True, text=True, timeout=300
    )


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("extension")
    done = run_builder(folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Success parsing TOML" in done.stdout  # Blender's validator has had its say
    [path] = folder.glob("*.zip")
    assert done.stdout.splitlines()[-1] == str(path)
    return path


def blender_extension(*arguments):
    """Blender's own command for extensions, as the bpy module brings it along."""
    blender = Path(importlib.util.find_spec("bpy").origin).parent
    [script] = blender.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    return subprocess.run([sys.executable, script, *arguments], check=True, capture_output=True)


def contents(path):
    """The archive's files by name, but for folders."""
    with zipfile.ZipFile(path) as opened:
        return {name: opened.read(name) for name in opened.namelist() if not name.endswith("/")}


def test_archive_holds_the_add_on_and_nothing_else(archive):
    found = contents(archive)
    manifest = tomllib.loads(found["blender_manifest.toml"].decode())
    assert [name for name in found if not SHIPPED.fullmatch(name)] == []
    wheels = {name for name in found if name.startswith("wheels/")}
    assert {re.search(r"cp\d+", name)[0] for name in wheels} == {"cp311", "cp313", "cp314"}
    assert {f"./{name}" for name in wheels} == set(manifest["wheels"])
    assert len(manifest["platforms"]) == 1
    assert archive.name == f"detp-{manifest['version']}-{manifest['platforms'][0].replace('-', '_')}.zip"


def test_without_wheels_it_fits_every_platform_and_is_what_blender_builds(tmp_path):
    assert run_builder(tmp_path, "--no-wheels").returncode == 0
    [path] = tmp_path.glob("*.zip")
    blender_extension("build", "--source-dir", ROOT, "--output-filepath", tmp_path / "blenders.zip")
    found = contents(path)
    assert found == contents(tmp_path / "blenders.zip")
    manifest = tomllib.loads(found["blender_manifest.toml"].decode())
    assert not {"wheels", "platforms"} & set(manifest)
    assert path.name == f"detp-{manifest['version']}.zip"


def test_the_repository_is_the_one_that_blender_makes(archive):
    folder = archive.parent
    ours = json.loads((folder / "index.json").read_text())
    sums = dict(line.split("  ")[::-1] for line in (folder / "SHA256SUMS").read_text().splitlines())
    assert sums == {name: sha256((folder / name).read_bytes()).hexdigest() for name in (archive.name, "index.json")}
    blender_extension("server-generate", "--repo-dir", folder)
    theirs = json.loads((folder / "index.json").read_text())
    for package in theirs["data"]:
        if "python_versions" not in package:  # which Blender tells since 4.5
            ours["data"][0].pop("python_versions")
    assert ours == theirs


def test_installed_add_on_bakes(archive, tmp_path):
    resources = tmp_path / "resources"
    for name in ("config", "scripts", "extensions", "datafiles"):
        (resources / name).mkdir(parents=True)  # Blender takes the user's own for each that is missing
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    environment["BLENDER_USER_RESOURCES"] = str(resources)
    particles, radius, height, power = 400_000, 0.3, 2.0, 100.0
    command = [sys.executable, "-c", INSTALL_AND_BAKE, archive, str(particles), str(radius)]
    done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    lines = [line for line in done.stdout.splitlines() if line.startswith("FOUND ")]
    assert lines, done.stdout + done.stderr
    found = json.loads(lines[-1].removeprefix("FOUND "))

    assert found["result"] == ["FINISHED"]
    assert Path(found["addon"]).is_relative_to(resources)
    assert Path(found["embreex"]).is_relative_to(resources)
    assert found["strays"] == []

    # The disc sees the light in this share of all directions, so that many particles cross it, binomially spread.
    share = 0.5 * (1 - height / (height**2 + radius**2) ** 0.5)
    expected = power * share / (3.141592653589793**2 * radius**2)
    deviation = expected * ((1 - share) / (share * particles)) ** 0.5
    assert len(found["middle"]) == 4
    for red, green, blue, alpha in found["middle"]:
        assert red == green == blue and alpha == 1
        assert abs(red - expected) < norm.isf(1e-4) * deviation
