"""Builds the extension that Blender installs, and what a place on the web needs for Blender to update it.

    python tools/build_extension.py [--platforms linux-x64 ... | all] [--output-dir FOLDER]

writes into FOLDER (dist): a zip for each platform; ``index.json``, a repository of them as Blender reads one (add the
folder's address under Preferences > Get Extensions > Repositories); and ``SHA256SUMS``. A zip holds the add-on and what
the repository does not: embreex as wheels, one for each Python that a supported Blender brings, of which Blender
unpacks the one that fits. NumPy is Blender's own and never added. Equal sources give equal zips.

Nothing but Python and pip is needed. Where there is the bpy module, Blender's own validator has its say on each zip.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import json
import platform
import re
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WHEELS = ROOT / "tools" / "embreex_wheels.txt"

#: of Blender 4.2 to 5.0, of 5.1 and later, and of Blenders that Linux distributions build
PYTHONS = ("3.11", "3.13", "3.14")

#: Blender's name of each platform that embreex has wheels for, and pip's names of what runs there.
PLATFORMS = {
    "linux-x64": ("manylinux_2_28_x86_64",),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_13_0_arm64",),
    "macos-x64": ("macosx_13_0_x86_64",),
}

#: What the add-on is made of; everything else in the repository is for those who work on it.
PARTS = ("blender_manifest.toml", "__init__.py", "README.md", "CHANGELOG.md", "LICENSE", "core", "detp_addon")

#: Of the manifest, what a repository's index tells of a package.
TOLD = (
    "schema_version", "id", "name", "tagline", "version", "type", "maintainer", "license", "blender_version_min",
    "website", "permissions", "tags", "platforms",
)  # fmt: skip


def main() -> None:
    """Build, validate, and print each archive's path."""
    parser = argparse.ArgumentParser(description="Build the extension, a repository of it, and checksums.")
    parser.add_argument("--output-dir", type=Path, default=ROOT / "dist", metavar="FOLDER", help="default: dist")
    parser.add_argument(
        "--platforms", nargs="+", default=[this_platform()], metavar="NAME", choices=[*PLATFORMS, "all"],
        help=f"all, or some of {', '.join(PLATFORMS)}; default: this one",
    )  # fmt: skip
    parser.add_argument("--no-wheels", action="store_true", help="one zip, for Blenders that have embreex already")
    arguments = parser.parse_args()
    names = PLATFORMS if "all" in arguments.platforms else arguments.platforms
    output = arguments.output_dir.resolve()
    output.mkdir(parents=True, exist_ok=True)
    try:
        paths = [build(output, name) for name in ([None] if arguments.no_wheels else names)]
    except subprocess.CalledProcessError as error:
        sys.exit(error.returncode)  # what failed has said why
    (output / "index.json").write_text(json.dumps(index(paths), indent=2) + "\n", encoding="utf-8")
    sums = [f"{sha256(path)}  {path.name}\n" for path in [*paths, output / "index.json"]]
    (output / "SHA256SUMS").write_text("".join(sums), encoding="utf-8")
    for path in paths:
        validate(path)
        print(path)


def build(output: Path, name: str | None) -> Path:
    """Write the archive for the platform of that ``name``, None for any, into ``output``, and return its path."""
    files = {path.relative_to(ROOT).as_posix(): path.read_bytes() for path in sources()}
    stated = tomllib.loads(files["blender_manifest.toml"].decode())
    path = output / f"{stated['id']}-{stated['version']}.zip"
    if name is not None:
        path = path.with_name(f"{path.stem}-{name.replace('-', '_')}.zip")
        wheels = download(name)
        files["blender_manifest.toml"] = with_wheels(files["blender_manifest.toml"].decode(), name, wheels).encode()
        files |= {f"wheels/{wheel}": content for wheel, content in wheels.items()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for each in sorted(files):
            # Without the time of day, so that equal sources give equal bytes.
            archive.writestr(zipfile.ZipInfo(each), files[each], zipfile.ZIP_DEFLATED)
    return path


def sources() -> list[Path]:
    """The repository's files that go into an archive."""
    found = [ROOT / part for part in PARTS]
    return [file for part in found for file in (sorted(part.rglob("*.py")) if part.is_dir() else [part])]


def download(name: str) -> dict[str, bytes]:
    """Embreex's wheels for that platform, one for each Python, by their names; pip checks their hashes."""
    with tempfile.TemporaryDirectory() as folder:
        for version in PYTHONS:
            pip = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
            which = ["--only-binary", ":all:", "--python-version", version, "--dest", folder]
            which += [part for tag in PLATFORMS[name] for part in ("--platform", tag)]
            subprocess.run([*pip, *which, "--require-hashes", "-r", WHEELS], check=True)
        return {path.name: path.read_bytes() for path in sorted(Path(folder).glob("*.whl"))}


def with_wheels(manifest: str, name: str, wheels) -> str:
    """The manifest's text with the wheels and the one platform that they are for, ahead of its first table."""
    head, bracket, tables = manifest.partition("\n[")
    stated = {"platforms": [name], "wheels": [f"./wheels/{wheel}" for wheel in wheels]}
    lines = [f"{key} = {json.dumps(value)}\n" for key, value in stated.items()]
    return f"{head}\n{''.join(lines)}{bracket}{tables}"


def index(paths: list[Path]) -> dict:
    """A repository of these archives, as ``blender --command extension server-generate`` writes one."""
    data = []
    for path in paths:
        with zipfile.ZipFile(path) as archive:
            stated = tomllib.loads(archive.read("blender_manifest.toml").decode())
        told = {key: stated[key] for key in TOLD if key in stated}
        pythons = {re.search(r"-cp(\d)(\d+)-", wheel).groups() for wheel in stated.get("wheels", ())}
        if pythons:
            told["python_versions"] = [f"{major}.{minor}" for major, minor in sorted(pythons)]
        where = {"archive_url": f"./{path.name}", "archive_size": path.stat().st_size}
        data.append(told | where | {"archive_hash": f"sha256:{sha256(path)}"})
    return {"version": "v1", "blocklist": [], "data": data}


def sha256(path: Path) -> str:
    """The file's checksum."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def this_platform() -> str:
    """This platform as Blender's manifests name it, such as linux-x64."""
    system, machine = platform.system().lower(), platform.machine().lower()
    machine = {"x86_64": "x64", "amd64": "x64", "aarch64": "arm64"}.get(machine, machine)
    return f"{'macos' if system == 'darwin' else system}-{machine}"


def validate(path: Path) -> None:
    """Let Blender's own command for extensions look at the archive, if the bpy module is there, which holds it."""
    bpy = importlib.util.find_spec("bpy")
    if bpy is not None:
        [script] = Path(bpy.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
        subprocess.run([sys.executable, script, "validate", path], check=True)


if __name__ == "__main__":
    main()
