"""Files and places that mean a baker ill, for try_reliability.py, and whether what came out is whole."""

import io
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from PIL import Image

#: what no line of output may hold but its own end
CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f]")
LONGEST = 300.0

#: makes all scenes, in Blender: a plain and a compressed one, and others that read pipes or have names that steer
MAKE = r"""import bpy, os, sys
folder = sys.argv[1]
def opened(): bpy.ops.wm.open_mainfile(filepath=f"{folder}/plain.blend", use_scripts=False)
def saved(name, compress=False):
    bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/{name}.blend", copy=True, compress=compress, relative_remap=False)
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_grid_add(x_subdivisions=8, y_subdivisions=8, size=6)
bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 0.5))
bpy.context.object.data.materials.append(bpy.data.materials.new("paint"))
lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
lamp.data.energy, lamp.location = 100, (1, 0.5, 3)
bpy.context.collection.objects.link(lamp)
saved("plain"); saved("compressed", True)
picture = bpy.data.images.new("picture", 4, 4)
picture.source, picture.filepath = "FILE", f"{folder}/pipe"
picture.use_fake_user = True
saved("image_pipe"); saved("image_pipe_compressed", True)
picture.filepath = "/dev/zero"
saved("image_device")
opened()
library = f"{folder}/compressed.blend"
with bpy.data.libraries.load(library, link=True) as (there, wanted): wanted.objects = there.objects[:1]
bpy.context.scene.collection.objects.link(wanted.objects[0])
bpy.data.libraries[0].filepath = f"{folder}/pipe"
saved("library_pipe"); saved("library_pipe_compressed", True)
bpy.data.libraries[0].filepath = f"{folder}/\x1b]0;owned\x07\nSaved it all.blend"
saved("library_name")
opened()
for number, obj in enumerate(bpy.data.objects): obj.name = f"\x1b[2J\r\n{number}"
for material in bpy.data.materials: material.name = "\x9b31m\x1b]0;owned\x07"
bpy.context.scene.name = "\x1b[2J"
saved("names")
opened()
shown = bpy.context.scene
shown.render.filepath = f"{folder}/elsewhere/render"
if bpy.app.version < (5, 0):
    shown.use_nodes = True
    tree = shown.node_tree
else:
    tree = shown.compositing_node_group = bpy.data.node_groups.new("elsewhere", "CompositorNodeTree")
file = tree.nodes.new("CompositorNodeOutputFile")
if bpy.app.version < (5, 0):
    file.base_path = f"{folder}/elsewhere"
else:
    file.directory = f"{folder}/elsewhere"
    file.file_output_items.new("RGBA", "Image")
tree.links.new(tree.nodes.new("CompositorNodeRLayers").outputs[0], file.inputs[0])
cloth = next(each for each in shown.objects if each.type == "MESH").modifiers.new("cloth", "CLOTH")
cloth.point_cache.use_disk_cache = True
saved("elsewhere")
os._exit(0)"""


def whole_json(content: bytes) -> bool:
    try:
        return bool(json.loads(content))
    except ValueError:
        return False


def whole_png(content: bytes) -> bool:
    try:
        Image.open(io.BytesIO(content)).load()
    except (OSError, SyntaxError):
        return False
    return True


def both_kinds(folder: Path) -> tuple[Path, Path]:
    """A box on a floor, plain and compressed; all other scenes of MAKE are made in ``folder`` with them."""
    subprocess.run([sys.executable, "-c", MAKE, str(folder)], check=True, capture_output=True)
    return folder / "plain.blend", folder / "compressed.blend"


def tried(program: list[str], work: Path) -> Iterator[tuple[str, float, list[str]]]:
    """Bake each hostile thing; yields what it was, how long it took, and what went wrong."""
    plain = work / "plain.blend"
    os.mkfifo(work / "pipe")
    os.mkfifo(work / "pipe.blend")
    with open(work / "zeros.blend", "wb") as file:
        file.write(b"BLENDER-v405")
        file.truncate(1 << 37)
    (work / "cut.blend").write_bytes(plain.read_bytes()[:-100_000])
    name = os.fsdecode(b"\xff\xfe\x1b[31m\nSaved") + ".blend"
    (work / name).write_bytes(plain.read_bytes())
    (work / "link.json").symlink_to(work / "linked.json")
    (work / "pipe.json").symlink_to(work / "pipe")

    def run(kind: str, status: int, words: str, scene: str, *more: str, redirect="", lines=1, **variables: str):
        quick = ["--photons", "20000", "--radius", "0.3", "--indirect", "off", "--fit", "vertices"]
        arguments = [*program, str(work / scene) if scene != "-" else "-", "-o", f"{work}/out/", *quick, *more]
        begin, faults = time.perf_counter(), []
        try:
            done = subprocess.run(
                ["sh", "-c", f'"$@" {redirect}', "sh", *arguments], capture_output=True, timeout=LONGEST,
                env={**os.environ, **variables},
            )  # fmt: skip
            said = (done.stdout + done.stderr).decode("utf-8", "replace")
            faults += [] if done.returncode == status else [f"exit {done.returncode}"]
            faults += [] if words in said else [f"said: {said[-200:]!r}"]
            faults += ["control characters"] if CONTROL.search(said) or "\nSaved it" in said else []
            faults += ["more than a sentence"] if status and lines and len(said.strip().splitlines()) != lines else []
        except subprocess.TimeoutExpired:
            faults.append("hangs")
        return kind, time.perf_counter() - begin, faults

    pipe, damaged = "pipe or a device", "damaged"
    yield run("a pipe as scene", 1, pipe, "pipe.blend")
    yield run("a device as scene", 1, pipe, "/dev/zero")
    yield run("endless zeros as scene", 1, damaged, "zeros.blend")
    yield run("a scene that breaks off", 1, "cannot open", "cut.blend")
    for kind in ("image_pipe", "image_pipe_compressed", "image_device", "library_pipe", "library_pipe_compressed"):
        yield run(f"a scene that names what never ends: {kind.replace('_', ', ')}", 1, pipe, f"{kind}.blend")
    yield run("a library whose path steers terminals", 0, "was not found", "library_name.blend")
    yield run("objects whose names steer terminals", 0, "Saved", "names.blend")
    report = str(work / "names.json")
    yield run("a scene's name that is not UTF-8, with a report", 0, r"\udcff\udcfe\x1b[31m\n", name, "--report", report)
    yield "that report", 0.0, [] if whole_json((work / "names.json").read_bytes()) else ["not whole"]
    yield run("a report through a link", 0, "Saved", "plain.blend", "--report", str(work / "link.json"))
    there = (work / "link.json").is_symlink() and whole_json((work / "linked.json").read_bytes())
    yield "that link and its report", 0.0, [] if there else ["not there"]
    yield run("a report to a pipe", 1, pipe, "plain.blend", "--report", str(work / "pipe.json"))
    yield run("a full standard output", 0, "", "plain.blend", redirect=">/dev/full")
    yield run("closed standard streams", 0, "", "plain.blend", redirect=">&- 2>&- <&-")
    yield run("a terminal of ASCII", 0, "Saved", name, PYTHONIOENCODING="ascii:strict")
    (work / "home").mkdir()
    home = {"HOME": str(work / "home"), "XDG_CACHE_HOME": str(work / "home")}
    before = [path.name for path in work.iterdir()]
    picture = ["--preview", str(work / "out" / "p.png")]
    yield run("a scene whose outputs and caches lead elsewhere", 0, "Saved", "elsewhere.blend", *picture, **home)
    strays = [path.name for path in work.iterdir() if path.name not in before]
    strays += [path.name for path in (work / "home").rglob("*") if path.is_file()]
    yield "what that wrote beside the outputs", 0.0, [f"wrote {name}" for name in strays]
    (work / "list").write_bytes(b"\0".join(os.fsencode(str(work / each)) for each in ("pipe.blend", name, "cut.blend")))
    yield run(
        "a list of hostile files", 1, "1 baked, 2 failed", "-", "--report", report, lines=0,
        redirect=f"<{work}/list", PYTHONIOENCODING="ascii:strict",
    )  # fmt: skip
    yield run("a list without an end", 2, "does not end", "-", lines=0, redirect="</dev/zero")
