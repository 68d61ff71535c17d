"""Measures what key frames take that are updates of the first one, beside whole bakes of the same frames.

    python tools/measure_animation.py [SCENE.blend --object NAME --way X Y Z] [--frames 48] [--whole-every 1]
           [--quality draft]

Without a scene it is the room of animation_strip.py, whose lamp stands still. In a scene, the object is moved that way
over the frames. Updates and whole bakes take turns in this process, and their times are those of all its processors.
z is the difference of both lights over both standard errors, at all points and within a metre of what moves. Flicker is
what is left of the light, over itself, when a point's value in a frame is held against the mean of those before and
after; it has the true changes in it, which are the same in both.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from dataclasses import replace

import bpy
import numpy as np
from animation_strip import room
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.detp_addon.found_light import FoundLight, found_light
from detp.detp_addon.request import BakeRequest
from detp.detp_addon.updates.kept_bake import KeptBake
from mathutils import Vector

#: Metres from what moves within which points count as near.
NEAR = 1.0


def main() -> int:
    arguments = parse(sys.argv[1:])
    scene = room(arguments.frames) if arguments.scene is None else opened(arguments)
    mover = bpy.data.objects[arguments.object]
    if arguments.scene is None:
        bpy.data.objects["lamp"].animation_data_clear()
    layer, request = bpy.context.view_layer, BakeRequest(BakeSettings(arguments.quality))
    kept = KeptBake(scene, layer, request)
    other = replace(request, settings=replace(request.settings, seed=1))
    spent: dict[str, list[float]] = {"first": [], "update": [], "whole": []}
    lights: dict[str, list[np.ndarray]] = {"update": [], "whole": []}
    scores = []
    for frame in range(1, arguments.frames + 1):
        seconds, found = timed(scene, layer, request, frame, kept)
        spent["first" if frame == 1 else "update"].append(seconds)
        lights["update"].append(found.whole.irradiance.sum(axis=1))
        if kept.reasons:
            print(f"Frame {frame}: {'; '.join(kept.reasons)}", flush=True)
        if frame == 1 or (frame - 1) % arguments.whole_every:
            continue
        fresh = KeptBake(scene, layer, other)
        fresh.places = kept.places  # so that both are of the same points
        seconds, whole = timed(scene, layer, other, frame, fresh)
        spent["whole"].append(seconds)
        lights["whole"].append(whole.whole.irradiance.sum(axis=1))
        scene.frame_set(frame)
        at = np.mean([mover.matrix_world @ Vector(corner) for corner in mover.bound_box], axis=0)
        near = np.linalg.norm(found.points.centres - at, axis=1) < NEAR
        scores.append([compared(found, whole, where) for where in (np.ones(len(near), bool), near)])
        print(f"Frame {frame}: {spent['update'][-1]:.2f} s, {spent['whole'][-1]:.2f} s", scores[-1], flush=True)
    update, whole = np.mean(spent["update"]), np.mean(spent["whole"])
    sizes = f"{len(found.export.scene.triangles)} triangles, {len(found.points.centres)} points"
    print(f"{sizes}, {arguments.frames} frames:")
    print(f"first {spent['first'][0]:.2f} s; an update {update:.2f} s ({min(spent['update']):.2f} to "
          f"{max(spent['update']):.2f}), a whole bake {whole:.2f} s: {update / whole:.0%}; all frames "
          f"{(spent['first'][0] + sum(spent['update'])) / (whole * arguments.frames):.0%} of whole ones")  # fmt: skip
    for number, name in enumerate(("all points", "near points")):
        mean, rms, errors = np.array([each[number] for each in scores]).T
        print(f"{name}: z mean {mean.mean():+.3f}, of single frames {mean.min():+.3f} to {mean.max():+.3f}; "
              f"rms {np.sqrt(np.mean(rms**2)):.3f}; error over a whole bake's {np.median(errors):.2f}")  # fmt: skip
    for name, some in lights.items():
        same = len({len(light) for light in some}) == 1  # a face may just lose its area, or get one
        if same and len(some) > 2 and (name == "update" or arguments.whole_every == 1):
            print(f"flicker, {name}: {flicker(np.array(some)):.3%}")
    return 0


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?")
    parser.add_argument("--object", default="box")
    parser.add_argument("--way", type=float, nargs=3, default=(1.0, 0.0, 0.0))
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--whole-every", type=int, default=1)
    parser.add_argument("--quality", default="draft")
    return parser.parse_args(arguments)


def opened(arguments: argparse.Namespace) -> bpy.types.Scene:
    """The scene of the file, with its object on its way."""
    bpy.ops.wm.open_mainfile(filepath=arguments.scene)
    mover = bpy.data.objects[arguments.object]
    mover.keyframe_insert("location", frame=1)
    mover.location = [at + by for at, by in zip(mover.location, arguments.way, strict=True)]
    mover.keyframe_insert("location", frame=arguments.frames)
    return bpy.context.scene


def timed(scene, layer, request: BakeRequest, frame: int, kept: KeptBake) -> tuple[float, FoundLight]:
    """Seconds of all processors that a frame takes with its fit, and its light."""
    begin = processors()
    found = finished(found_light(scene, layer, request, None, time.perf_counter(), frame, kept))
    found.colours(request)
    return processors() - begin, found


def processors() -> float:
    """Seconds of all processors, those of processes included that helped and are over."""
    return sum(os.times()[:4])


def compared(one: FoundLight, other: FoundLight, where: np.ndarray) -> tuple[float, float, float]:
    """The mean and the rms of z among points, and the median of one's standard error over the other's."""
    first, second = one.whole, other.whole
    light, beside = first.irradiance.sum(axis=1)[where], second.irradiance.sum(axis=1)[where]
    errors = first.standard_error.sum(axis=1)[where], second.standard_error.sum(axis=1)[where]
    lit = (light > 0) & (beside > 0) & (errors[0] > 0) & (errors[1] > 0)
    z = (light - beside)[lit] / np.hypot(*errors)[lit]
    ratio = float(np.median(errors[0][lit] / errors[1][lit]))
    return round(float(z.mean()), 3), round(float(np.sqrt(np.mean(z**2))), 3), round(ratio, 3)


def flicker(light: np.ndarray) -> float:
    """The median over the points of what frames (F, N) differ from the mean of those around, rms, over the light."""
    off = light[1:-1] - 0.5 * (light[:-2] + light[2:])
    mean = light.mean(axis=0)
    lit = mean > 0.02 * np.median(mean)
    return float(np.median(np.sqrt(np.mean(off**2, axis=0) / 1.5)[lit] / mean[lit]))


if __name__ == "__main__":
    sys.exit(main())
