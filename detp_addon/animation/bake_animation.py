"""Bakes light at key frames, step by step, and writes how it plays at the very end."""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import replace

import bpy
import numpy as np

from ...core.errors import InvalidSettingError, NoLightError, NoMeshError
from ...core.memory import memory_errors_named
from ..chosen_objects import chosen_objects
from ..chosen_views import not_baked
from ..found_light import FoundLight, found_light
from ..materials.light_in_materials import refresh_materials
from ..report import BakeReport, Brightness
from ..request import BakeRequest
from ..steps import JobProgress
from ..updates.kept_bake import KeptBake
from ..writing.encoding import encoded, fitted_scale
from ..writing.write_attributes import write_colours
from .baked_frames import BakedFrames, first_layer
from .frames import Frames
from .moving import is_moving
from .playback import key_name, remove_playback, tidy_playback, write_playback


def bake_animation(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    request: BakeRequest,
    frames: Frames,
    moving_only: bool = False,
    whole: bool = False,
) -> Generator[JobProgress, bool | None, BakeReport]:
    """Bake the light of ``scene`` at the key frames of ``frames`` as ``request`` says, and let it play.

    Frames after the first are updates of it, as far as that goes, unless each is to be baked ``whole``; the report says
    how many were not, and why. Each has the same seed, so that what does not change does not flicker; a time or a
    number of photons is that of one frame. With ``moving_only`` objects that do not move keep the light of the first
    frame. The rest is as for :func:`.job.bake_scene`; sending True ends it once two frames are done. Objects whose
    faces come and go are named and left out. Nothing of the user's is touched before the last step, the current frame
    included. Raises DetpError.
    """
    if request.split or request.by_light:
        raise InvalidSettingError("An animation has no parts: leave the split, and the bake by light, away.")
    key_name(request.attribute, len(frames.keys))
    with memory_errors_named():
        start, baked = time.perf_counter(), BakedFrames(request.attribute)
        names, others = (scene.name, view_layer.name), not_baked(scene, view_layer)
        report = yield from _find_light(scene, view_layer, request, frames, moving_only, whole, baked, start)
        refused, frames = baked.refuse_changing(), frames.until(baked.count)
        if not baked.colours:
            raise NoMeshError(refused[0])
        yield JobProgress("Writing the colours", 1.0)
        writing = time.perf_counter()
        brightness, objects, notes = _write(request, frames, baked)
        end = time.perf_counter()
        return replace(
            report,
            objects=objects,
            frames=frames.keys,
            relative_error=float(baked.error) or float("nan"),
            seconds=report.seconds | {"write": end - writing, "total": end - start},
            brightness=brightness,
            blender_scene=names[0],
            view_layer=names[1],
            warnings=(*others, *refused, *baked.whole_frames(), *notes, *baked.warnings),
        )


def _find_light(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    request: BakeRequest,
    frames: Frames,
    moving_only: bool,
    whole: bool,
    baked: BakedFrames,
    start: float,
) -> Generator[JobProgress, bool | None, BakeReport]:
    """Add the light of all frames to what is ``baked``, or of those before it was stopped; the first one's report."""
    report, asked, keys = None, request, frames.keys
    first = None if whole else KeptBake(scene, view_layer, request)
    for number, frame in enumerate(keys):
        begin = time.perf_counter()
        steps = found_light(scene, view_layer, asked, None, begin, frame, first)
        try:
            found = yield from _of_frame(steps, number, len(keys), start)
        except NoLightError:
            if report is None and number + 1 == len(keys):
                raise
            baked.skip(dark=True)  # lamps may be switched off for a while
            continue
        except NoMeshError:
            if report is None:
                raise
            baked.skip()  # what moves may be hidden for a while
            continue
        values, colours, gone = found.colours(asked)
        report = report or found.report(scene, values, begin)
        baked.take(found, colours, (*gone, *found.doubts(scene, asked)))
        baked.error = np.fmax(baked.error, found.whole.relative_error)
        baked.whole.update({*first.reasons} if first is not None else ())
        if moving_only and asked is request:
            moving = _moving(scene, view_layer, asked)
            baked.still = {key for key in baked.colours if key[0] not in moving}
            asked = replace(asked, targets=tuple(moving))
        if found.stopped and number > 0:
            break
    return report


def _write(request: BakeRequest, frames: Frames, baked: BakedFrames) -> tuple[Brightness, int, list[str]]:
    """Write the colours and how they play: how bright they are, of how many objects, and notes on them."""
    entries, moved = baked.entries()
    if request.encoding.exposure is None and baked.scale is None:
        values = (moved.get(entry.object, [first_layer(entry)]) for entry in entries)
        baked.scale = fitted_scale([rgb for each in values for rgb in each])
    stored, brightness = encoded(entries, request.encoding, request.quantity, baked.scale)
    for rgb in moved.values():
        np.minimum(rgb * np.float32(brightness.scale), stored[0].light.get("limit", np.inf), out=rgb)
    kind = request.encoding.type, request.domain
    notes = write_colours(
        stored,
        request.domain,
        request.attribute if request.activate else None,
        lambda undo: write_playback(moved, request.attribute, frames, kind, undo),
    )
    objects = [entry.object for entry in stored]
    remove_playback([obj for obj in objects if obj not in moved], request.attribute)
    tidy_playback(moved, request.attribute)
    return brightness, len(entries), notes + refresh_materials(objects, request.attribute)


def _of_frame(
    steps: Generator[JobProgress, bool | None, FoundLight], number: int, count: int, start: float
) -> Generator[JobProgress, bool | None, FoundLight]:
    """The ``steps`` of the frame of that ``number`` of ``count``, in an animation that began at ``start``."""
    wish = None
    while True:
        try:
            step = steps.send(wish)
        except StopIteration as end:
            return end.value
        share = (number + step.fraction) / count
        passed = time.perf_counter() - start
        left = passed * (1 - share) / share if number > 0 else None
        wish = yield replace(step, phase=f"Frame {number + 1} of {count}: {step.phase}", fraction=share, remaining=left)


def _moving(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, request: BakeRequest) -> list[str]:
    """The names of the objects to bake that move. Raises NoMeshError without any."""
    chosen = chosen_objects(scene, view_layer, request.targets)
    objects = view_layer.objects if chosen is None else chosen
    names = [obj.name for obj in objects if obj.type == "MESH" and not obj.hide_render and is_moving(obj)]
    if not names:
        raise NoMeshError("No mesh to bake moves: mark those that do as moving, or bake all of them at each frame.")
    return names
