"""Fifty scenes of which five are planted: what becomes of the others, and of a batch that is killed and resumed.

    python tools/try_batches.py -o docs/batches.md [--files 50] [--limit 60s]

The planted ones: a texture that is missing, bytes that make Blender crash, a bake that outlasts the time limit, a file
that breaks off, and an output that is write-protected.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from detp.detp_addon.tables import markdown_table

PROGRAM = [sys.executable, "-c", "from detp.detp_addon.command.console import console; console()", "bake"]
QUICK = ["--photons", "20000", "--radius", "0.3"]

#: makes all scenes, in Blender: rooms of other lamps, one with a texture that is not there, one of four million faces
MAKE = """import bpy, os, sys
folder, count = sys.argv[1], int(sys.argv[2])
def saved(name): bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/{name}.blend", copy=True)
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_grid_add(x_subdivisions=8, y_subdivisions=8, size=6)
floor = bpy.context.object
bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 0.5))
lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
lamp.data.energy = 100
bpy.context.collection.objects.link(lamp)
for number in range(count):
    lamp.location = (1 + 0.02 * number, 0.5, 3)
    os.makedirs(f"{folder}/level{number % 3}", exist_ok=True)
    saved(f"level{number % 3}/scene{number:02}")
image = bpy.data.images.new("wall", 4, 4)
image.source, image.filepath = "FILE", "//gone.png"
material = bpy.data.materials.new("wall")
if bpy.app.version < (5, 0): material.use_nodes = True
node = material.node_tree.nodes.new("ShaderNodeTexImage")
node.image = image
material.node_tree.links.new(node.outputs[0], material.node_tree.nodes["Principled BSDF"].inputs["Base Color"])
floor.data.materials.append(material)
saved("untextured")
floor.data.materials.clear()
for levels in (4, 4):
    modifier = floor.modifiers.new("Subdivision", "SUBSURF")
    modifier.render_levels = levels
    modifier.subdivision_type = "SIMPLE"
saved("endless")
os._exit(0)"""

#: whether Blender can open a file, as exit status
OPEN = "import bpy, os, sys; bpy.ops.wm.open_mainfile(filepath=sys.argv[1], use_scripts=False); os._exit(0)"

PLANTED = ("untextured", "crash", "endless", "broken", "protected")


def crashing(whole: bytes, folder: Path, chance: random.Random) -> bytes:
    """The file with bytes of its scene's block changed so that Blender crashes on it."""
    trial, start = folder / "trial.blend", whole.index(b"SC\0\0")
    for _ in range(20):
        content = bytearray(whole)
        for place in range(start + 150, start + 4000):
            content[place] = chance.choice((content[place],) * 4 + (chance.randrange(256),))
        trial.write_bytes(content)
        if subprocess.run([sys.executable, "-c", OPEN, str(trial)], capture_output=True).returncode < 0:
            return bytes(content)
    raise RuntimeError("no damage made Blender crash")


def planted(folder: Path, count: int) -> None:
    """All scenes in ``folder``/scenes, and the output that nobody may write."""
    scenes = folder / "scenes"
    scenes.mkdir()
    subprocess.run(
        [sys.executable, "-c", MAKE, str(scenes), str(count - len(PLANTED))], check=True, capture_output=True
    )
    whole = (scenes / "level0" / "scene00.blend").read_bytes()
    (scenes / "crash.blend").write_bytes(crashing(whole, folder, random.Random(1)))
    (scenes / "broken.blend").write_bytes(whole[: len(whole) // 2])
    (scenes / "protected.blend").write_bytes(whole)


def protect(out: Path) -> None:
    out.mkdir()
    (out / "protected_baked.blend").write_bytes(b"mine")
    (out / "protected_baked.blend").chmod(0o444)


def command(folder: Path, out: Path, options) -> list[str]:
    names = [str(folder / "scenes"), "--recursive", "-o", str(out), "--report", str(folder / "report.json")]
    return [*PROGRAM, *names, *QUICK, "--jobs", str(options.jobs), "--time-limit", options.limit]


def all_at_once(folder: Path, options) -> list[tuple[str, str]]:
    """Bake them all; rows of what was found."""
    out = folder / "out"
    protect(out)
    begin = time.perf_counter()
    done = subprocess.run(command(folder, out, options), capture_output=True, text=True)
    seconds = time.perf_counter() - begin
    print(done.stdout[-6000:], done.stderr, sep="\n")
    entries = {Path(entry["scene"]).stem: entry for entry in json.loads((folder / "report.json").read_text())}
    failed = {name: entry["error"] for name, entry in entries.items() if "error" in entry}
    baked = [name for name in entries if name not in failed]
    rows = [
        ("files, baked, failed, exit status", f"{len(entries)}, {len(baked)}, {len(failed)}, {done.returncode}"),
        ("files beside the planted ones that did not bake", str(sum(name not in PLANTED for name in failed))),
        ("time in all", f"{seconds:.0f} s"),
    ]
    for name in PLANTED:
        said = failed.get(name) or "baked; warning: " + "; ".join(
            each for each in entries[name]["warnings"] if "missing" in each
        )
        rows.append((name, said.replace(str(folder) + "/", "")))
    protected = (out / "protected_baked.blend").read_bytes() == b"mine"
    rows.append(("the protected file is what it was", "yes" if protected else "**no**"))
    return rows


def killed_and_resumed(folder: Path, options) -> list[tuple[str, str]]:
    """Begin the batch, end it at random moments, resume it; count how often each file was saved."""
    out = folder / "again"
    protect(out)
    chance, ends, made, saves = random.Random(options.seed), [], {}, {}
    temporary = folder / "tmp"
    temporary.mkdir()
    resumed = [*command(folder, out, options), "--resume"]
    for number in (signal.SIGKILL, signal.SIGTERM, signal.SIGKILL, signal.SIGINT, None):
        process = subprocess.Popen(
            resumed, env={**os.environ, "TMPDIR": str(temporary)}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        if number is None:
            status = process.wait()
        else:
            time.sleep(chance.uniform(0.08, 0.2) * options.whole)
            process.send_signal(number)
            begin = time.perf_counter()
            process.wait()
            ends.append(f"{number.name} after {len(made)} files, over in {time.perf_counter() - begin:.2f} s")
            time.sleep(3.0)  # the processes that it started end by themselves when it is killed
        for path in out.rglob("*.blend"):
            if not path.name.startswith("."):
                stamp = path.stat().st_mtime_ns
                saves[path] = saves.get(path, 0) + (made.get(path) != stamp)
                made[path] = stamp
        made.pop(out / "protected_baked.blend", None)
    entries = {Path(entry["scene"]).stem: entry for entry in json.loads((folder / "report.json").read_text())}
    left = [path.name for path in (*out.rglob(".*"), *temporary.iterdir())]
    return [
        ("ended by", "; ".join(ends)),
        ("exit status of the last run", str(status)),
        ("outputs, and the most often that one was saved", f"{len(made)}, {max(saves[path] for path in made)}"),
        ("entries of the last report, of these resumed", f"{len(entries)}, "
         f"{sum('resumed' in entry for entry in entries.values())}"),
        ("left behind", ", ".join(left) or "nothing"),
    ]  # fmt: skip


def page(options, tables: dict[str, list[tuple[str, str]]]) -> str:
    """The page docs/batches.md."""
    lines = ["# Batches", "", f"Made by `python tools/try_batches.py --files {options.files} --jobs {options.jobs} "
             f"--limit {options.limit}`, {os.cpu_count()} cores.", ""]  # fmt: skip
    for title, rows in tables.items():
        lines += [f"## {title}", "", markdown_table(("what", "found"), rows), ""]
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--files", type=int, default=50)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--limit", default="60s", help="a file's time limit, long enough for all but one")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, signal.default_int_handler)  # a shell's background job would hand down that it ignores them
    tables = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        planted(folder, options.files)
        begin = time.perf_counter()
        tables["Five planted failures"] = all_at_once(folder, options)
        options.whole = time.perf_counter() - begin
        options.output.write_text(page(options, tables), encoding="utf-8")
        tables["Ended and resumed"] = killed_and_resumed(folder, options)
        options.output.write_text(page(options, tables), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
