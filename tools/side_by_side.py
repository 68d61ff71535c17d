"""Draws a baked scene beside Cycles' own picture of it, from the same camera and with the same exposure.

    python tools/side_by_side.py SCENE.blend -o PICTURE.png [--quality final] [--samples 256] [--width 640]

Left: the colours that a bake of the quantity `shaded` gives, interpolated over the faces. Right: Cycles' paths.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import bpy
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.detp_addon.files.open_files import open_blend
from detp.detp_addon.job import bake_scene
from detp.detp_addon.preview.camera import frame
from detp.detp_addon.preview.render_preview import HEIGHT, WIDTH, render_preview
from detp.detp_addon.request import BakeRequest
from detp.detp_addon.tradeoff.cycles_bake import set_up_cycles
from PIL import Image

GAP = 8


def main() -> int:
    arguments = parse(sys.argv[1:])
    open_blend(Path(arguments.scene))
    scene, view_layer = bpy.context.scene, bpy.context.view_layer
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        scene.collection.objects.link(scene.camera)
        view_layer.update()
        meshes = [obj for obj in view_layer.objects if obj.type == "MESH" and not obj.hide_render]
        frame(scene.camera, meshes, scene, view_layer, WIDTH / HEIGHT)
        scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    request = BakeRequest(BakeSettings(arguments.quality), attribute="light", quantity="shaded")
    report = finished(bake_scene(scene, view_layer, request))
    with tempfile.TemporaryDirectory() as folder:
        baked, traced = Path(folder) / "baked.png", Path(folder) / "traced.png"
        stops = render_preview(scene, view_layer, "light", baked)
        size = Image.open(baked).size
        render_with_cycles(scene, size, stops, arguments.samples, traced)
        joined = Image.new("RGB", (2 * size[0] + GAP, size[1]), "white")
        joined.paste(Image.open(baked), (0, 0))
        joined.paste(Image.open(traced).convert("RGB"), (size[0] + GAP, 0))
        height = round(joined.height * arguments.width / size[0])
        joined.resize((2 * arguments.width + GAP, height), Image.LANCZOS).save(arguments.output)
    print(f"{report.headline()} Drew {arguments.output}, exposed by {stops:+.1f} stops.")
    return 0


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("-o", dest="output", required=True)
    parser.add_argument("--quality", default="final")
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--width", type=int, default=640)
    return parser.parse_args(arguments)


def render_with_cycles(scene: bpy.types.Scene, size: tuple[int, int], stops: float, samples: int, path: Path) -> None:
    """What Cycles sees, without denoising or a look."""
    set_up_cycles(scene)
    scene.cycles.samples = samples
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.pixel_aspect_x = scene.render.pixel_aspect_y = 1.0
    scene.render.use_compositing = scene.render.use_sequencer = False
    scene.render.filepath = str(path)
    if hasattr(scene.render.image_settings, "media_type"):  # since Blender 5.0
        scene.render.image_settings.media_type = "IMAGE"
    scene.render.image_settings.file_format = "PNG"
    scene.view_settings.view_transform, scene.view_settings.look = "Standard", "None"
    scene.view_settings.exposure, scene.view_settings.gamma = stops, 1.0
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    sys.exit(main())
