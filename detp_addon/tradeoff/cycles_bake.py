"""Cycles' own vertex bake: its settings, its calls and what it found."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ..command.blender_output import blender_silenced
from ..writing.baked_layers import stored_colours
from .face_copies import LIGHT

#: reflections that a path may have, as in our own bakes
BOUNCES = 64


@dataclass(frozen=True)
class CyclesBake:
    """What one bake of several objects took.

    baked    the objects that were reached, all or, when the time was over, a random part of them
    refused  object -> why Cycles would not bake it
    seconds  wall time of all objects; when only a part was reached, as :func:`extrapolated_seconds` tells
    complete whether all were reached
    """

    baked: tuple[bpy.types.Object, ...]
    refused: dict[str, str]
    seconds: float
    complete: bool


def set_up_cycles(scene: bpy.types.Scene, bounces: int = BOUNCES) -> None:
    """Unbiased paths on all cores, a fixed number of samples; nothing is guessed, clamped or smoothed."""
    scene.render.engine = "CYCLES"
    scene.render.threads_mode = "AUTO"
    cycles = scene.cycles
    cycles.device, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", False, False
    for name in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "transparent_max_bounces"):
        setattr(cycles, name, bounces)
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy, cycles.time_limit = 0.0, 0.0
    cycles.use_fast_gi = cycles.use_guiding = False
    scene.render.bake.use_selected_to_active = False
    # Its place changed with Blender 5.
    for settings, name in ((scene.render, "use_bake_multires"), (scene.render.bake, "use_multires")):
        if hasattr(settings, name):
            setattr(settings, name, False)


def bake_with_cycles(
    objects: Sequence[bpy.types.Object], samples: int, seed: int, limit: float = float("inf")
) -> CyclesBake:
    """Bake DIFFUSE, direct and indirect, of each object into its active colours.

    One after the other, as the operator itself does when it is called for all at once, so that it can end when
    ``limit`` seconds are over: they come in random order, and what all of them would have taken is told from those
    that were baked. What Cycles refuses is left out.
    """
    scene, layer = bpy.context.scene, bpy.context.view_layer
    scene.cycles.samples, scene.cycles.seed = samples, seed
    for obj in layer.objects:
        obj.select_set(False)
    order = np.random.default_rng(0).permutation(len(objects))
    baked, refused, times = [], {}, []
    with blender_silenced():
        for place in order:
            if sum(times) > limit:
                break
            obj = objects[place]
            start = time.perf_counter()
            obj.select_set(True)
            layer.objects.active = obj
            try:
                bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, target="VERTEX_COLORS")
                baked.append(obj)
            except RuntimeError as error:
                refused[obj.name] = str(error).strip().splitlines()[0].removeprefix("Error: ")
            obj.select_set(False)
            times.append(time.perf_counter() - start)
    corners = np.array([len(objects[place].data.loops) for place in order], float)
    seconds = extrapolated_seconds(corners, np.array(times))
    return CyclesBake(tuple(baked), refused, seconds, len(times) == len(objects))


def extrapolated_seconds(corners: np.ndarray, times: np.ndarray) -> float:
    """What objects with so many ``corners`` (K,) take when the first of them took ``times``: a + b corners each.

    By least squares, and where that makes no sense because the first are few or alike, as long as the first on average.
    """
    known, rest = corners[: len(times)], corners[len(times) :]
    if len(rest) and np.ptp(known) > 0:
        slope, start = np.polyfit(known, times, 1)
        if slope >= 0.0 and start >= 0.0:
            return float(times.sum() + (start + slope * rest).sum())
    return float(times.sum() / max(1, len(times)) * len(corners))


def light_of(obj: bpy.types.Object, attribute: str = LIGHT) -> np.ndarray:
    """The colours (corners, 3) of an object."""
    return stored_colours(obj.data.attributes[attribute])[:, :3].astype(float)
