"""Builds the extension that Blender installs: ``python tools/build_extension.py [--output-dir FOLDER]``.

Blender's own builder and validator do the work (they come with the bpy module), so what ships is decided in one place,
the ``[build]`` table of the manifest. This tool adds what the repository does not hold: embreex as wheels, one for each
Python that a supported Blender brings; Blender unpacks the one that fits. NumPy is Blender's own and never added.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import platform
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
EMBREEX = "embreex==4.4.0.post1"
#: of Blender 4.2 to 5.0, of 5.1 and later, and of Blenders that Linux distributions build
PYTHONS = ("3.11", "3.13", "3.14")

_SYSTEMS = {"darwin": "macos"}
_MACHINES = {"x86_64": "x64", "amd64": "x64", "aarch64": "arm64"}


def main() -> None:
    """Build, validate, and print the archive's path."""
    parser = argparse.ArgumentParser(description="Build the extension for this platform and validate it.")
    parser.add_argument("--output-dir", type=Path, default=ROOT / "dist", metavar="FOLDER", help="default: dist")
    parser.add_argument(
        "--python-versions", nargs="+", default=PYTHONS, metavar="X.Y", help=f"default: {' '.join(PYTHONS)}"
    )
    parser.add_argument("--no-wheels", action="store_true", help="for Blenders that have embreex already")
    arguments = parser.parse_args()
    versions = () if arguments.no_wheels else arguments.python_versions
    try:
        print(build(arguments.output_dir.resolve(), versions))
    except subprocess.CalledProcessError as error:
        sys.exit(error.returncode)  # what failed has said why


def build(output: Path, python_versions) -> Path:
    """Build and validate the archive in the folder ``output`` and return its path."""
    (ROOT / "build").mkdir(exist_ok=True)
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=ROOT / "build") as folder:
        stage, bare = Path(folder, "stage"), Path(folder, "bare.zip")
        blender_extension("build", "--source-dir", ROOT, "--output-filepath", bare)
        with zipfile.ZipFile(bare) as archive:
            archive.extractall(stage)
        manifest = stage / "blender_manifest.toml"
        stated = tomllib.loads(manifest.read_text(encoding="utf-8"))
        name = f"{stated['id']}-{stated['version']}"
        if python_versions:
            wheels = download(python_versions, stage / "wheels")
            manifest.write_text(with_wheels(manifest.read_text(encoding="utf-8"), wheels), encoding="utf-8")
            name += "-" + this_platform().replace("-", "_")
        path = output / f"{name}.zip"
        blender_extension("build", "--source-dir", stage, "--output-filepath", path)
    blender_extension("validate", path)
    return path


def download(python_versions, folder: Path) -> list[str]:
    """Fetch embreex's wheels of this platform into ``folder`` and return their names."""
    for version in python_versions:
        pip = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check"]
        which = ["--only-binary", ":all:", "--no-deps", "--python-version", version, "--dest", folder]
        subprocess.run([*pip, *which, EMBREEX], check=True)
    return sorted(path.name for path in folder.glob("*.whl"))


def with_wheels(manifest: str, wheels: list[str]) -> str:
    """The manifest's text with the wheels and the one platform that they are for, ahead of its first table."""
    head, bracket, tables = manifest.partition("\n[")
    stated = {"platforms": [this_platform()], "wheels": [f"./wheels/{name}" for name in wheels]}
    lines = [f"{key} = {json.dumps(value)}\n" for key, value in stated.items()]
    return f"{head}\n{''.join(lines)}{bracket}{tables}"


def this_platform() -> str:
    """This platform as Blender's manifests name it, such as linux-x64."""
    system, machine = platform.system().lower(), platform.machine().lower()
    return f"{_SYSTEMS.get(system, system)}-{_MACHINES.get(machine, machine)}"


def blender_extension(*arguments) -> None:
    """Run Blender's own command for extensions, as the bpy module brings it along."""
    bpy = importlib.util.find_spec("bpy")
    if bpy is None:
        sys.exit("The bpy module is needed, which holds Blender's builder of extensions: pip install bpy")
    [script] = Path(bpy.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    subprocess.run([sys.executable, script, *arguments], check=True)


if __name__ == "__main__":
    main()
