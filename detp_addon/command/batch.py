"""Bakes scene files one after another; a scene that fails does not stop the others."""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy

from ...core.errors import DetpError
from ...core.memory import memory_errors_named
from ..chosen_objects import chosen_objects, targets_in
from ..chosen_views import View, ViewChoice, chosen_views, shared_objects
from ..files.open_files import check_readable, is_compressed, open_blend
from ..files.write_files import check_writable, replace_file, save_blend, write_text
from ..job import BakeRequest, bake_scene
from ..materials.use_light import use_in_materials
from ..preview.render_preview import render_preview
from ..report import BakeReport, to_json
from ..writing.face_division import divide_faces, division_note
from ..writing.modifiers import apply_modifiers
from .blender_output import blender_silenced
from .progress import ProgressDisplay
from .terminal import complain


@dataclass(frozen=True)
class SceneJob:
    """One scene file to bake, where the result goes, and the picture of it if one is wanted."""

    scene: Path
    output: Path
    preview: Path | None = None


@dataclass(frozen=True)
class Batch:
    """Scenes to bake alike, and where the report of all goes if one is wanted."""

    jobs: tuple[SceneJob, ...]
    request: BakeRequest
    report: Path | None = None
    quiet: bool = False
    views: ViewChoice = field(default_factory=ViewChoice)
    apply_modifiers: bool = False
    subdivide: int = 0
    use_in_material: str | None = None


def bake_batch(batch: Batch) -> int:
    """Bake every scene of ``batch``, print what was done, and return how many scenes failed.

    The report is written after each scene, so that it outlives whatever happens to the next. Raises UnwritableFileError
    before any work when that is not possible, and after it when it was not.
    """
    if batch.report is not None:
        check_writable(batch.report)
    display = ProgressDisplay(sys.stdout, batch.quiet)
    entries, failures, unreported = [], {}, None
    for job in batch.jobs:
        baked = []
        try:
            with memory_errors_named():
                views = _bake_file(job, batch, display, baked)
                if job.preview is not None:
                    _draw(job, batch.request, views, display)
        except DetpError as error:
            failures[job.scene] = str(error)
        except Exception:  # a fault of ours on one scene must not cost the user the other scenes
            display.end()
            for line in traceback.format_exc().splitlines():
                complain(line)
            failures[job.scene] = "The program failed here, by its own fault: please report the lines above."
        display.end()
        if job.scene in failures:
            baked = baked or [{"scene": str(job.scene), "output": None}]
            baked[-1]["error"] = failures[job.scene]
            complain(f"{job.scene}: {failures[job.scene]}")
        entries += baked
        if batch.report is not None:
            try:
                write_text(batch.report, to_json(entries))
                unreported = None
            except DetpError as error:
                unreported = error
    _summarise(len(batch.jobs), failures)
    if unreported is not None:
        raise unreported
    return len(failures)


def _summarise(count: int, failures: dict[Path, str]) -> None:
    """After several scenes, say once more which failed, where it cannot be missed."""
    if count < 2 or not failures:
        return
    complain(f"{len(failures)} of {count} scenes failed:")
    for scene, reason in failures.items():
        complain(f"  {scene}: {reason}")


def _bake_file(job: SceneJob, batch: Batch, display: ProgressDisplay, entries: list) -> list[View]:
    """Bake and save one file, say so, add an entry of the report for each view baked, and return these views."""
    for path in (job.output, job.preview):
        if path is not None:
            check_writable(path)
    check_readable(job.scene)
    compressed = is_compressed(job.scene)
    begin = time.perf_counter()
    with blender_silenced():
        opening = open_blend(job.scene)
    # Saving takes about as long as opening, and counts against the time of the bake as well.
    spent = 2.0 * (time.perf_counter() - begin)
    views = chosen_views(batch.views)
    reports, refusals = {}, []
    for scene, layer in views:
        request = batch.request
        if len(views) > 1:
            request = replace(request, targets=targets_in(scene, request.targets))
        title = job.scene.stem if len(views) == 1 else f"{job.scene.stem}, {scene.name}"
        try:
            if batch.apply_modifiers:
                with blender_silenced():
                    opening += apply_modifiers(scene, layer, chosen_objects(scene, layer, request.targets))
            begin = time.perf_counter()
            divided = _subdivided(scene, layer, request, batch.subdivide, title, display)
            spent += time.perf_counter() - begin
            steps = bake_scene(scene, layer, request, spent=spent, scenes_too=[scene for scene, _ in views])
            report = _finished(steps, title, display)
            if divided is not None:
                report = replace(report, warnings=(*report.warnings, division_note(*divided, report.lossy_faces.whole)))
            reports[scene, layer] = report
        except DetpError as error:
            refusals.append((scene.name, error))
        spent = 0.0
    if not reports:
        raise refusals[0][1]
    used = None
    if batch.use_in_material is not None:
        objects = [obj for scene, _ in reports for obj in scene.objects]
        with blender_silenced():
            used = use_in_materials(objects, batch.request.attribute, batch.use_in_material)
    with blender_silenced():
        save_blend(job.output, compressed)
    notes = [f"The scene '{name}' was not baked: {error}" for name, error in refusals]
    notes = (*opening, *notes, *shared_objects([scene for scene, _ in reports]), *(used.notes if used else ()))
    display.end()
    for report in reports.values():
        warnings, notes = (*notes, *report.warnings), ()
        report = replace(report, scene=str(job.scene), output=str(job.output), warnings=warnings)
        where = f"{job.scene}: " if len(views) == 1 else f"{job.scene}, scene '{report.blender_scene}': "
        for line in (where + report.headline(), *report.details()):
            display.line(line)
        entries.append(report.as_json())
    if used is not None:
        display.line(used.sentence())
    display.line(f"Saved {job.output}")
    return list(reports)


def _subdivided(
    scene, layer, request: BakeRequest, times: int, title: str, display: ProgressDisplay
) -> tuple[int, int, float] | None:
    """Divide faces where light changes, up to so many ``times``, each time after a bake of quality draft.

    Returns how many faces, of how many objects, and the share of their light that faces showed wrong before; None when
    there was nothing to divide.
    """
    rough = replace(
        request, settings=replace(request.settings, quality="draft", error=None, photons=None, seconds=None)
    )
    faces, objects, before = 0, 0, None
    for _ in range(times):
        report = _finished(bake_scene(scene, layer, rough), f"{title}, rough", display)
        if len(report.lossy_faces.faces) == 0:
            break
        with blender_silenced():
            divided, of = divide_faces(report.lossy_faces)
        faces, objects = faces + divided, max(objects, of)
        before = report.lossy_faces.whole if before is None else before
    return None if before is None else (faces, objects, before)


def _finished(steps: Generator, title: str, display: ProgressDisplay) -> BakeReport:
    """Take all the steps of a bake and return what it returns."""
    with closing(steps):
        while True:
            try:
                with blender_silenced():
                    progress = next(steps)
            except StopIteration as stop:
                return stop.value
            display.show(title, progress)


def _draw(job: SceneJob, request: BakeRequest, views: list[View], display: ProgressDisplay) -> None:
    """Draw the preview of each view just baked, and say how bright."""
    for scene, layer in views:
        path = job.preview if len(views) == 1 else _with_name(job.preview, scene.name)
        with blender_silenced():
            exposure = _drawn(path, scene, layer, request.attribute)
        display.line(f"Drew {path}, exposed by {round(exposure, 1) + 0.0:+.1f} stops")


def _drawn(path: Path, scene: bpy.types.Scene, layer: bpy.types.ViewLayer, attribute: str) -> float:
    exposures = []
    replace_file(path, lambda made: exposures.append(render_preview(scene, layer, attribute, made)))
    return exposures[0]


def _with_name(path: Path, name: str) -> Path:
    """The path with a scene's name added, in which a slash or the like would be a folder."""
    plain = "".join(letter if letter.isalnum() or letter in " -_." else "_" for letter in name)
    return path.with_name(f"{path.stem}_{plain}{path.suffix}")
