"""Makes a small animated scene, bakes it, and draws a strip of its frames, with what it took.

    python tools/animation_strip.py -o STRIP.png [--blend ANIMATED.blend] [--frames 48] [--every 4] [--quality preview]

A box turns as it crosses a room with a red and a green wall, and a lamp swings the other way. Then the box alone is
baked at each key frame (`--moving-only`), to tell what that saves. The frames in the strip are not all key frames.
"""

import argparse
import math
import sys
import tempfile
import time
from pathlib import Path

import bpy
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.detp_addon.animation.bake_animation import bake_animation
from detp.detp_addon.animation.frames import Frames
from detp.detp_addon.files.write_files import save_blend
from detp.detp_addon.job import bake_scene
from detp.detp_addon.preview.render_preview import render_preview
from detp.detp_addon.request import BakeRequest
from made_objects import diffuse, put
from PIL import Image

GAP, CUTS = 4, 24


def main() -> int:
    arguments = parse(sys.argv[1:])
    scene = room(arguments.frames)
    layer, frames = bpy.context.view_layer, Frames(1, arguments.frames, arguments.every)
    request = BakeRequest(BakeSettings(arguments.quality), attribute="light", quantity="shaded")
    begin = time.perf_counter()
    finished(bake_scene(scene, layer, request))
    still = time.perf_counter() - begin
    moving = finished(bake_animation(scene, layer, request, frames, moving_only=True))
    report = finished(bake_animation(scene, layer, request, frames))
    if arguments.blend:
        save_blend(Path(arguments.blend), False)
    shown = [1 + round(number * (arguments.frames - 1) / 5) for number in range(6)]
    with tempfile.TemporaryDirectory() as folder:
        pictures = []
        for frame in shown:
            scene.frame_set(frame)
            path = Path(folder) / f"{frame}.png"
            render_preview(scene, layer, "light", path)
            pictures.append(Image.open(path).convert("RGB").resize((arguments.width, arguments.width), Image.LANCZOS))
    side = arguments.width
    strip = Image.new("RGB", (3 * side + 2 * GAP, 2 * side + GAP), "white")
    for number, picture in enumerate(pictures):
        strip.paste(picture, ((number % 3) * (side + GAP), (number // 3) * (side + GAP)))
    strip.save(arguments.output, optimize=True)
    count = len(frames.keys)
    print(report.headline())
    print(f"A still bake: {still:.2f} s; a key frame: {report.seconds['total'] / count:.2f} s, of the box alone "
          f"{moving.seconds['total'] / count:.2f} s; {count} keys. Drew frames {shown}.")  # fmt: skip
    return 0


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", dest="output", required=True)
    parser.add_argument("--blend")
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--every", type=int, default=4)
    parser.add_argument("--quality", default="preview")
    parser.add_argument("--width", type=int, default=224)
    return parser.parse_args(arguments)


def room(last: int) -> bpy.types.Scene:
    """A room of 4 m without its front wall, a box and a lamp in it that move, and a camera before it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, last
    turn = math.pi / 2
    walls = (
        ("floor", (0, 0, 0), (0, 0, 0), (0.7, 0.7, 0.7)), ("ceiling", (0, 0, 4), (2 * turn, 0, 0), (0.7, 0.7, 0.7)),
        ("back", (0, 2, 2), (turn, 0, 0), (0.7, 0.7, 0.7)), ("left", (-2, 0, 2), (0, turn, 0), (0.7, 0.12, 0.08)),
        ("right", (2, 0, 2), (0, -turn, 0), (0.12, 0.5, 0.1)),
    )  # fmt: skip
    for name, place, rotation, colour in walls:
        bpy.ops.mesh.primitive_grid_add(
            x_subdivisions=CUTS, y_subdivisions=CUTS, size=4, location=place, rotation=rotation
        )
        painted(bpy.context.object, name, colour)
    bpy.ops.mesh.primitive_cube_add(size=1.1, location=(-1, 0, 0.7))
    box = bpy.context.object
    painted(box, "box", (0.75, 0.75, 0.75))
    cut(box)
    lamp = put("lamp", bpy.data.lights.new("lamp", "POINT"))
    lamp.data.energy, lamp.data.shadow_soft_size = 120.0, 0.15
    for frame, share in ((1, -1.0), (last, 1.0)):
        box.location, box.rotation_euler = (1.1 * share, 0.2, 0.56), (0.0, 0.0, 1.2 * share)
        lamp.location = (-1.2 * share, -0.6, 3.2)
        for path in ("location", "rotation_euler"):
            box.keyframe_insert(path, frame=frame)
        lamp.keyframe_insert("location", frame=frame)
    scene.camera = put("camera", bpy.data.cameras.new("camera"))
    scene.camera.location, scene.camera.rotation_euler = (0, -7.6, 2), (turn, 0, 0)
    scene.render.resolution_x = scene.render.resolution_y = 540
    scene.frame_set(1)
    return scene


def painted(obj, name: str, colour) -> None:
    obj.name = obj.data.name = name
    obj.data.materials.append(diffuse(name, colour))


def cut(obj) -> None:
    """Give each face of a box vertices enough for soft shadows."""
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide(number_cuts=7)
    bpy.ops.object.mode_set(mode="OBJECT")


if __name__ == "__main__":
    sys.exit(main())
