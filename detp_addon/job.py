"""One bake of one Blender scene, step by step: read it, bake it, write the colours at the very end.

The command line and the panel's operator drive the same generator. Only the panel shows the colours before.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from dataclasses import replace

import bpy

from ..core.memory import memory_errors_named
from .animation.playback import hidden_by_playback
from .chosen_views import not_baked
from .found_light import found_light
from .materials.light_in_materials import refresh_materials
from .mixing.mix import gains_of, remix
from .report import BakeReport
from .request import BakeRequest
from .steps import JobProgress
from .updates.kept_bake import KeptBake
from .writing.encoding import encoded
from .writing.live_colours import LiveColours
from .writing.write_attributes import write_colours


def bake_scene(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    request: BakeRequest,
    live: LiveColours | None = None,
    spent: float = 0.0,
    scenes_too: Sequence[bpy.types.Scene] = (),
    kept: KeptBake | None = None,
) -> Generator[JobProgress, bool | None, BakeReport]:
    """Bake ``scene`` as ``request`` says; yields a JobProgress often and returns the BakeReport.

    Sending True ends the bake at once with what it has found, as soon as that is something. ``live`` shows the
    colours meanwhile, and takes them back before the last step. ``spent`` seconds count against the time of the bake.
    ``scenes_too`` are those that are baked with it; of others the report has a word. What is ``kept`` of an earlier
    bake of the scene is updated, and if it is still empty, this bake is kept there.

    Nothing else of the user's is touched before the last step, so closing the generator leaves everything as it was;
    if that step fails, what it wrote is taken back. An object that cannot be written becomes a warning; when none can,
    its error is raised. Raises DetpError.
    """
    with memory_errors_named():
        start = time.perf_counter() - spent
        names, updates = (scene.name, view_layer.name), bool(kept)
        others = not_baked(scene, view_layer, scenes_too)
        found = yield from found_light(scene, view_layer, request, live, start, kept=kept)

        yield JobProgress("Writing the colours", 1.0)
        writing = time.perf_counter()
        values, colours, gone = found.colours(request)
        report, doubts = found.report(scene, values, start), found.doubts(scene, request)
        said = (*(kept.notes if kept is not None else ()), *others, *found.export.warnings, *found.refusals)
        stored, brightness = encoded(
            colours, request.encoding, request.quantity, found.scales[0], report.relative_error
        )
        objects = [entry.object for entry in stored]
        mixture = gains_of(objects, request.attribute) if updates else {}
        notes = write_colours(stored, request.domain, request.attribute if request.activate else None)
        remix(objects, request.attribute, mixture)
        notes += refresh_materials(objects, request.attribute) + hidden_by_playback(objects, request.attribute)
        end = time.perf_counter()
        return replace(
            report,
            objects=len(colours),
            seconds=report.seconds | {"write": end - writing, "total": end - start},
            brightness=brightness,
            blender_scene=names[0],
            view_layer=names[1],
            updated=kept is not None and kept.updated,
            warnings=(*said, *gone, *notes, *doubts),
        )
