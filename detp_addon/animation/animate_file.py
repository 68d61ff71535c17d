"""Bakes the animation of one scene file in this process, where Blender is loaded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import bpy

from ..chosen_views import ViewChoice, chosen_views
from ..command.bake_file import bake_request, finished_bake
from ..command.blender_output import blender_silenced
from ..command.progress import ProgressDisplay
from ..files.open_files import check_readable, is_compressed, open_blend
from ..files.write_files import check_writable, save_blend, write_text
from ..likely import likely_bake, likely_values
from ..materials.light_in_materials import use_in_materials
from ..report import to_json
from ..request import BakeRequest
from ..wording import counted, duration, percent
from .bake_animation import bake_animation
from .frame_texture import texture_of, write_texture
from .frames import Frames


def animate_file(source: Path, output: Path, options: dict, frames: Frames, display: ProgressDisplay) -> None:
    """Bake and save one file as the command's ``options`` say, or say how long that will take. Raises DetpError."""
    request = bake_request(options)
    texture, report_file = (None if options[name] is None else Path(options[name]) for name in ("texture", "report"))
    check_readable(source)
    for path in (output, texture, report_file):
        if path is not None and not options["dry_run"]:
            check_writable(path)
    compressed = is_compressed(source)
    with blender_silenced():
        opening = open_blend(source)
    [(scene, layer)] = chosen_views(ViewChoice(options["scene"], options["view_layer"]))
    if options["dry_run"]:
        display.line(_foreseen(scene, layer, request, frames))
        return
    steps = bake_animation(scene, layer, request, frames, options["moving_only"], options["whole"])
    report = finished_bake(steps, source.stem, display)
    notes = list(opening)
    if options["use_in_material"] is not None:
        with blender_silenced():
            used = use_in_materials(scene.objects, request.attribute, options["use_in_material"])
        notes += [used.sentence(), *used.notes]
    if texture is not None:
        # The scene gets the UV map by which engines find their rows, so it is saved after that.
        pixels, description = texture_of(scene, request.attribute)
    with blender_silenced():
        save_blend(output, compressed)
        if texture is not None:
            write_texture(texture, pixels, description)
    report = replace(report, scene=str(source), output=str(output), warnings=(*notes, *report.warnings))
    if report_file is not None:
        write_text(report_file, to_json([report.as_json()]))
    for line in (f"{source}: {report.headline()}", *report.details(), f"Saved {output}"):
        display.line(line)
    if texture is not None:
        display.line(f"Saved {texture} and {texture.with_suffix('.json').name}")


def _foreseen(scene: bpy.types.Scene, layer: bpy.types.ViewLayer, request: BakeRequest, frames: Frames) -> str:
    """A line on how long the bake is likely to take."""
    values, count = likely_values(scene, layer, request), len(frames.keys)
    likely = likely_bake(scene, layer, request, values)
    return (
        f"About {duration(likely.seconds * count)} for {counted(count, 'frame')}, {duration(likely.seconds)} each; "
        f"error {percent(likely.error)}"
    )
