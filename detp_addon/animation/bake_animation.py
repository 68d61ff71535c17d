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
from ..materials.use_light import refresh_materials
from ..report import BakeReport, Brightness
from ..request import BakeRequest
from ..steps import JobProgress
from ..updates.kept_bake import KeptBake
from ..writing.encoding import encoded, fitted_scale
from ..writing.write_attributes import write_colours
from .baked_frames import BakedFrames, Key, first_layer
from .frames import Frames
from .moving import is_moving
from .playback import key_name, remove_playback, tidy_playback, write_playback

#: why frames are baked as a whole that could be updates
_DEAR = "so much is seen of what moves that an update takes as long"


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
        return (yield from _Animation(scene, view_layer, request, frames, moving_only, whole).steps())


class _Animation:
    """The bake of an animation; the rest is as for :func:`bake_animation`."""

    def __init__(
        self,
        scene: bpy.types.Scene,
        view_layer: bpy.types.ViewLayer,
        request: BakeRequest,
        frames: Frames,
        moving_only: bool,
        whole: bool,
    ):
        self._scene, self._view_layer, self._request, self._frames = scene, view_layer, request, frames
        self._moving_only = moving_only
        self._start = time.perf_counter()
        self._baked = BakedFrames(request.attribute)
        self._still: set[Key] = set()
        self._first: KeptBake | None = None if whole else KeptBake(scene, view_layer, request)

    def steps(self) -> Generator[JobProgress, bool | None, BakeReport]:
        """All of it."""
        scene, view_layer = self._scene, self._view_layer
        names, others = (scene.name, view_layer.name), not_baked(scene, view_layer)
        report = yield from self._find_light()
        self._first = None  # what it holds is not needed while all frames are written
        refused = self._baked.refuse_changing()
        if not self._baked.colours:
            raise NoMeshError(refused[0])
        yield JobProgress("Writing the colours", 1.0)
        writing = time.perf_counter()
        brightness, objects, notes = self._write()
        end = time.perf_counter()
        return replace(
            report,
            objects=objects,
            frames=self._frames.keys,
            relative_error=float(self._baked.error) or float("nan"),
            seconds=report.seconds | {"write": end - writing, "total": end - self._start},
            brightness=brightness,
            blender_scene=names[0],
            view_layer=names[1],
            warnings=(*others, *refused, *self._baked.whole_frames(), *notes, *self._baked.warnings),
        )

    def _find_light(self) -> Generator[JobProgress, bool | None, BakeReport]:
        """Find the light of all frames, or of those before it was stopped; the report of the first of them."""
        report, asked, dear, baked, keys = None, self._request, False, self._baked, self._frames.keys
        for number, frame in enumerate(keys):
            begin = time.perf_counter()
            steps = found_light(self._scene, self._view_layer, asked, None, begin, frame, self._first)
            try:
                found = yield from _of_frame(steps, number, len(keys), self._start)
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
            report = report or found.report(self._scene, values, begin)
            baked.take(found, colours, (*gone, *found.doubts(self._scene, asked)))
            baked.error = np.fmax(baked.error, found.whole.relative_error)
            first = self._first
            baked.count_whole(first.reasons if first is not None else [_DEAR] if dear else [])
            if first is not None and first.dear:
                self._first, dear = None, True
            if self._moving_only and asked is self._request:
                moving = _moving(self._scene, self._view_layer, asked)
                self._still = {key for key in baked.colours if key[0] not in moving}
                asked = replace(asked, targets=tuple(moving))
            if found.stopped and number > 0:
                self._frames = self._frames.until(number + 1)
                break
        return report

    def _write(self) -> tuple[Brightness, int, list[str]]:
        """Write the colours and how they play: how bright they are, of how many objects, and notes on them."""
        request, baked = self._request, self._baked
        entries, moved = baked.entries(self._still)
        if request.encoding.exposure is None and baked.scale is None:
            frames = (moved.get(entry.object, [first_layer(entry)]) for entry in entries)
            baked.scale = fitted_scale([rgb for each in frames for rgb in each])
        stored, brightness = encoded(entries, request.encoding, request.quantity, baked.scale)
        for rgb in moved.values():
            np.minimum(rgb * np.float32(brightness.scale), stored[0].light.get("limit", np.inf), out=rgb)
        kind = request.encoding.type, request.domain
        notes = write_colours(
            stored,
            request.domain,
            request.attribute if request.activate else None,
            lambda undo: write_playback(moved, request.attribute, self._frames, kind, undo),
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
