"""One bake of one Blender scene, step by step: read it, bake it, write the colours at the very end.

The command line and the panel's operator drive the same generator. Only the panel shows the colours before.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import replace

import bpy
import numpy as np

from ..core.bake import bake
from ..core.cluster.dask_hands import crew_of
from ..core.direct.ambient_occlusion import ambient_occlusion
from ..core.errors import NoLightError, NoMeshError
from ..core.memory import check_baking, memory_errors_named
from ..core.points import Points
from ..core.result import BakeResult, Progress
from .causes import why_no_light, why_nothing_to_bake
from .chosen_objects import chosen_objects
from .chosen_views import not_baked
from .colours import colours_of, usual_scales, writable_targets
from .doubts import dark_in_front, doubts_of
from .materials.use_light import refresh_materials
from .reading.read_scene import ExportedScene, read_scene
from .report import BakeReport
from .request import BakeRequest
from .steps import JobProgress
from .values import BakedPoints, known_rows, lossy_faces, points_of, values_of
from .writing.encoding import encoded
from .writing.live_colours import LiveColours
from .writing.write_attributes import write_colours

#: seconds to write the colour of one point, and the least time that is left to the bake itself
WRITING, LEAST_SECONDS = 4e-6, 0.05


def bake_scene(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    request: BakeRequest,
    live: LiveColours | None = None,
    spent: float = 0.0,
    scenes_too: Sequence[bpy.types.Scene] = (),
) -> Generator[JobProgress, bool | None, BakeReport]:
    """Bake ``scene`` as ``request`` says; yields a JobProgress often and returns the BakeReport.

    Sending True ends the bake at once with what it has found, as soon as that is something. ``live`` shows the
    colours meanwhile, and takes them back before the last step. ``spent`` seconds count against the time of the bake.
    ``scenes_too`` are those that are baked with it; of others the report has a word.

    Nothing else of the user's is touched before the last step, so closing the generator leaves everything as it was;
    if that step fails, what it wrote is taken back. An object that cannot be written becomes a warning; when none can,
    its error is raised. Raises DetpError.
    """
    with memory_errors_named():
        return (yield from _steps(scene, view_layer, request, live, spent, scenes_too))


def _steps(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    request: BakeRequest,
    live: LiveColours | None,
    spent: float,
    scenes_too: Sequence[bpy.types.Scene],
) -> Generator[JobProgress, bool | None, BakeReport]:
    """The steps of :func:`bake_scene`."""
    start = time.perf_counter() - spent
    names = scene.name, view_layer.name
    others = not_baked(scene, view_layer, scenes_too)
    yield JobProgress("Reading the scene", 0.0)
    chosen = chosen_objects(scene, view_layer, request.targets)
    try:
        export = read_scene(scene, view_layer, chosen, request.domain, request.attributes, request.fit)
    except NoMeshError as error:
        raise NoMeshError(why_nothing_to_bake(scene, chosen) or str(error)) from None
    targets, refusals = writable_targets(export.targets, request)
    targets, points = points_of(targets, export)
    check_baking(len(export.scene.triangles), len(points.centres))
    exported = time.perf_counter()

    scales = usual_scales(scene, targets, request)
    found, stopped = None, False
    with live or nullcontext():
        for progress in _bake_steps(scene, export, points, request, start):
            found = progress.found or found
            shown = progress.found is not None and live is not None and live.due
            if shown:
                begin = time.perf_counter()
                colours, _ = colours_of(targets, values_of(points, found), request, scales[1])
                live.show(encoded(colours, request.encoding, request.quantity, scales[0])[0], begin)
            wish = yield _job_progress(progress, found, time.perf_counter() - exported, shown)
            stopped = stopped or bool(wish)
            if stopped and found is not None:
                break
    result = found

    yield JobProgress("Writing the colours", 1.0)
    writing = time.perf_counter()
    values = values_of(points, result)
    colours, gone = colours_of(targets, values, request, scales[1])
    lossy = lossy_faces(export, points, values, result)
    turned = dark_in_front(targets, export.scene, points, result) if request.quantity != "ambient-occlusion" else []
    stored, brightness = encoded(colours, request.encoding, request.quantity, scales[0])
    notes = write_colours(stored, request.domain, request.attribute if request.activate else None)
    notes += refresh_materials([entry.object for entry in stored], request.attribute)
    end = time.perf_counter()
    doubts = doubts_of(result, request.settings, stopped, scene, export.scene)
    return BakeReport(
        scene=names[0],
        objects=len(colours),
        points=len(values.known),
        filled=sum(int((known_rows(target, values.known) < 0).sum()) for target in targets),
        triangles=len(export.scene.triangles),
        lights=export.lights,
        photons=result.photons,
        shadow_rays=result.shadow_rays,
        segments=result.segments,
        radius=result.radius,
        gatherer=result.gatherer,
        gatherer_reason=result.reason,
        seconds={
            "export": exported - start,
            "shadow": result.seconds["shadow"],
            "trace": result.seconds["radius"] + result.seconds["trace"],
            "gather": result.seconds["place"] + result.seconds["gather"],
            "write": end - writing,
            "total": end - start,
        },
        relative_error=result.relative_error,
        high_error=result.high_error,
        brightness=brightness,
        lossy_faces=lossy,
        modelled=tuple(export.modelled),
        left_out=tuple(export.left_out),
        blender_scene=names[0],
        view_layer=names[1],
        warnings=(*others, *export.warnings, *refusals, *gone, *notes, *doubts, *turned),
    )


def _bake_steps(
    scene: bpy.types.Scene, export: ExportedScene, points: BakedPoints, request: BakeRequest, start: float
) -> Iterator[Progress]:
    """The steps of the core's bake, the last of which has the result; ``start`` is when the job began."""
    surfaces, settings = export.scene, request.settings
    if request.quantity == "ambient-occlusion":
        surfaces, settings = ambient_occlusion(surfaces, settings)
    if settings.seconds is not None:
        # Writing takes about as long as reading did, and the core gets what is left between.
        reading = time.perf_counter() - start
        left = settings.seconds - reading - WRITING * len(points.centres)
        settings = replace(settings, seconds=max(left, LEAST_SECONDS))
    try:
        places = Points(points.centres, points.normals, points.inward, points.facing)
        with crew_of(request.cluster, surfaces, places, settings) as crew:
            result = yield from bake(surfaces, places, settings, points.fit, crew)
    except NoLightError as error:
        raise NoLightError(why_no_light(scene, export.warnings) or str(error)) from None
    yield Progress("Writing the colours", 1.0, result)


def _job_progress(progress: Progress, found: BakeResult | None, passed: float, shown: bool) -> JobProgress:
    share = progress.fraction
    remaining = passed * (1 - share) / share if 0.01 < share < 1 else None
    error = None if found is None or not np.isfinite(found.relative_error) else found.relative_error
    return JobProgress(progress.phase, share, remaining, error, shown)
