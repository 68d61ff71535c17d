"""Our bakes and those of Cycles, one after the other and again, each timed and kept at the corners to compare."""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import replace

import bpy

from ...core.stages import finished
from ..command.blender_output import blender_silenced
from ..job import bake_scene
from ..request import BakeRequest
from .candidates import DEFAULT_BOUNCES, Measured
from .cycles_bake import BOUNCES, bake_with_cycles, light_of, set_up_cycles
from .face_copies import copy_in
from .scene import ComparedScene

#: the attribute that our bakes write
OURS = "detp tradeoff"


def one_round(
    kinds: list[Measured], compared: ComparedScene, cycles_seconds: float, run: int
) -> Generator[str, None, None]:
    """Do each kind once more, in turn, so that the machine's moods meet all alike; yields sentences.

    A bake of Cycles ends when ``cycles_seconds`` are over, and its time is told from the objects that it reached.
    """
    inside = [kind for kind in kinds if kind.who == "cycles inside"]
    for kind in kinds[: len(kinds) - len(inside)]:
        if kind.who == "detp":
            _bake_ours(kind, compared, run)
        else:
            _press(kind, compared, cycles_seconds, run)
        yield _said(kind, run)
    if not inside:
        return
    scene = bpy.context.scene
    with copy_in(scene, compared.faces.just_inside(compared.scene_radius)) as copy:
        for kind in inside:
            if _expected_seconds(inside, kind.samples) <= 2 * cycles_seconds:
                set_up_cycles(scene, DEFAULT_BOUNCES if kind.group == "bounces" else BOUNCES)
                _bake_inside(kind, copy, compared, run)
                yield _said(kind, run)
    set_up_cycles(scene, BOUNCES)


def _bake_ours(measured: Measured, compared: ComparedScene, run: int) -> None:
    request = BakeRequest(
        replace(measured.settings, seed=run), targets=compared.objects, attribute=OURS, activate=False
    )
    scene, layer = bpy.context.scene, bpy.context.view_layer
    start = time.perf_counter()
    with blender_silenced():
        report = finished(bake_scene(scene, layer, request))
    measured.seconds.append(time.perf_counter() - start)
    light = {obj.name: light_of(obj, OURS) for obj in compared.blender_objects}
    measured.light.append(compared.at_chosen(light))
    measured.facts.update(
        photons=report.photons, segments=report.segments, shadow_rays=report.shadow_rays, radius=report.radius,
        gatherer=report.gatherer, estimated_error=report.relative_error, stages=report.seconds,
        options=measured.options,
    )  # fmt: skip


def _press(measured: Measured, compared: ComparedScene, limit: float, run: int) -> None:
    bake = bake_with_cycles(compared.blender_objects, measured.samples, seed=1 + run, limit=limit)
    measured.seconds.append(bake.seconds)
    measured.light.append(compared.at_chosen({obj.name: light_of(obj) for obj in bake.baked}))
    measured.facts.update(baked=len(bake.baked), complete=bake.complete, refused=bake.refused)


def _bake_inside(measured: Measured, copy, compared: ComparedScene, run: int) -> None:
    bake = bake_with_cycles([copy], measured.samples, seed=101 + run)
    measured.seconds.append(bake.seconds)
    measured.light.append(light_of(copy).sum(axis=1)[compared.chosen])


def _expected_seconds(inside: list[Measured], samples: int) -> float:
    """As long as the largest run so far, in proportion to the samples."""
    done = [kind for kind in inside if kind.group == "inside" and kind.seconds and kind.samples < samples]
    return samples / done[-1].samples * done[-1].median_seconds if done else 0.0


def _said(measured: Measured, run: int) -> str:
    return f"Run {run + 1}: {measured.label}: {measured.seconds[-1]:.2f} s"
