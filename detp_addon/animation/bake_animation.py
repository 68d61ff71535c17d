"""Bakes light at key frames, step by step, and writes how it plays at the very end."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from ...core.errors import InvalidSettingError, NoLightError, NoMeshError
from ...core.memory import memory_errors_named
from ..chosen_objects import chosen_objects, name_of, objects_by_name
from ..chosen_views import not_baked
from ..found_light import FoundLight, found_light
from ..materials.use_light import refresh_materials
from ..report import BakeReport
from ..request import BakeRequest
from ..steps import JobProgress
from ..updates.kept_bake import KeptBake
from ..wording import counted, some
from ..writing.encoding import encoded, fitted_scale
from ..writing.write_attributes import MeshColours, write_colours
from .frames import Frames
from .moving import is_moving
from .playback import key_name, remove_playback, tidy_playback, write_playback

#: an object by its name and library, since references do not survive an undo
Key = tuple[str, str | None]

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
        return (yield from _steps(scene, view_layer, request, frames, moving_only, whole))


@dataclass
class _Kept:
    """What frames have brought: rgb (M, 3) of each by object, None where it was not there; and what is to be said.

    ``whole`` counts the frames that were no updates, by the reason.
    """

    attribute: str
    colours: dict[Key, list[np.ndarray | None]] = field(default_factory=dict)
    rendered: dict[Key, set] = field(default_factory=dict)
    warnings: dict[str, None] = field(default_factory=dict)
    error: float = 0.0
    count: int = 0
    scale: float | None = None
    dark: set[int] = field(default_factory=set)
    whole: Counter[str] = field(default_factory=Counter)

    def take(self, found: FoundLight, colours: Sequence[MeshColours], warnings: Sequence[str]) -> None:
        """Add a frame."""
        for entry in colours:
            key = name_of(entry.object)
            before = self.colours.setdefault(key, [None] * self.count)
            before.append(next(iter(entry.layers.values())).astype(np.float32))
        for target in found.targets:
            self.rendered.setdefault((target.object_name, target.library), set()).add(target.rendered)
        self.count += 1
        for values in self.colours.values():
            values += [None] * (self.count - len(values))
        self.warnings |= dict.fromkeys((*found.export.warnings, *found.refusals, *warnings))
        self.scale = self.scale or found.scales[0]

    def skip(self, why: NoLightError | None = None) -> NoLightError | None:
        """Add a frame without any of the objects, or one that is dark and ``why``, which is returned."""
        self.dark |= {self.count} if why is not None else set()
        self.count += 1
        for values in self.colours.values():
            values.append(None)
        return why

    def count_whole(self, reasons: Sequence[str]) -> None:
        """The frame that was added last was baked as a whole for these ``reasons``, or is an update without any."""
        self.whole.update(set(reasons))

    def whole_frames(self) -> list[str]:
        """A sentence for each of the reasons."""
        all_frames = counted(self.count, "frame")
        return [
            f"Of {all_frames} {count} {'was' if count == 1 else 'were'} baked as a whole, since {reason}."
            for reason, count in self.whole.items()
        ]

    def refuse_changing(self) -> list[str]:
        """Drop the objects whose faces come and go, and return a sentence on them."""
        changing = [key for key, sizes in self.rendered.items() if len(sizes) > 1]
        for key in changing:
            self.colours.pop(key, None)
        if not changing:
            return []
        names = [name for name, _ in changing]
        return [f"The faces of {some(names)} change over the frames, so {'it' if len(names) == 1 else 'they'} cannot "
                f"play light: bake a frame of them alone, or let only their vertices move."]  # fmt: skip


def _steps(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    request: BakeRequest,
    frames: Frames,
    moving_only: bool,
    whole: bool,
) -> Generator[JobProgress, bool | None, BakeReport]:
    start, kept, report, keys = time.perf_counter(), _Kept(request.attribute), None, frames.keys
    names, others = (scene.name, view_layer.name), not_baked(scene, view_layer)
    asked, still, dark = request, set(), None
    base, dear = None if whole else KeptBake(scene, view_layer, request), False
    for number, frame in enumerate(keys):
        begin = time.perf_counter()
        steps = found_light(scene, view_layer, asked, None, begin, frame, base)
        try:
            found = yield from _of_frame(steps, number, len(keys), start)
        except NoLightError as error:
            # Lamps may be switched off for a while.
            dark = kept.skip(error)
            continue
        except NoMeshError:
            if report is None:
                raise
            kept.skip()  # what moves may be hidden for a while
            continue
        values, colours, gone = found.colours(asked)
        report = report or found.report(scene, values, begin)
        kept.take(found, colours, (*gone, *found.doubts(scene, asked)))
        kept.count_whole(base.reasons if base is not None else [_DEAR] if dear else [])
        if base is not None and base.dear:
            base, dear = None, True
        kept.error = np.fmax(kept.error, found.whole.relative_error)
        if moving_only and asked is request:
            moving = _moving(scene, view_layer, request)
            still = {key for key in kept.colours if key[0] not in moving}
            asked = replace(request, targets=tuple(moving))
        if found.stopped and number > 0:
            frames, keys = frames.until(number + 1), keys[: number + 1]
            break
    if report is None:
        raise dark
    refused = kept.refuse_changing()
    base = None  # what it holds is not needed while all frames are written
    if not kept.colours:
        raise NoMeshError(refused[0])

    yield JobProgress("Writing the colours", 1.0)
    writing = time.perf_counter()
    entries, moved = _entries(kept, still)
    if request.encoding.exposure is None and kept.scale is None:
        kept.scale = fitted_scale([rgb for entry in entries for rgb in moved.get(entry.object, [_first(entry)])])
    stored, brightness = encoded(entries, request.encoding, request.quantity, kept.scale)
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
    notes += refresh_materials(objects, request.attribute)
    end = time.perf_counter()
    return replace(
        report,
        objects=len(entries),
        frames=keys,
        relative_error=float(kept.error) or float("nan"),
        seconds=report.seconds | {"write": end - writing, "total": end - start},
        brightness=brightness,
        blender_scene=names[0],
        view_layer=names[1],
        warnings=(*others, *refused, *kept.whole_frames(), *notes, *kept.warnings),
    )


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


def _entries(kept: _Kept, still: set[Key]) -> tuple[list[MeshColours], dict[bpy.types.Object, np.ndarray]]:
    """The colours of each object at the first frame, and of those that move the rgb (K, M, 3) of all.

    Where an object was not there, it has the light of the frame before, or of the first in which it was.
    """
    entries, moved, objects = [], {}, objects_by_name()
    for key in list(kept.colours):
        frames = kept.colours.pop(key)  # all frames of all objects are much
        obj, known = objects.get(key), [rgb for rgb in frames if rgb is not None]
        if obj is None or any(len(rgb) != len(known[0]) for rgb in known):
            kept.warnings[f"'{key[0]}' was changed during the bake, so its colours were not written."] = None
            continue
        first = np.zeros_like(known[0]) if 0 in kept.dark and key not in still else known[0]
        entries.append(MeshColours(obj, {kept.attribute: first}))
        if key not in still:
            last, filled = known[0], []
            for number, rgb in enumerate(frames):
                last = last if rgb is None else rgb
                filled.append(np.zeros_like(last) if number in kept.dark else last)
            moved[obj] = np.stack(filled)
    if not entries:
        raise NoMeshError("Every object was changed during the bake, so no colours were written: bake again.")
    return entries, moved


def _first(entry: MeshColours) -> np.ndarray:
    return next(iter(entry.layers.values()))
