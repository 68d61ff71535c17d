"""Bakes scene files one after another; a scene that fails does not stop the others."""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import bpy

from ..core.errors import DetpError
from .blender_output import blender_silenced
from .files import check_readable, is_compressed, open_blend
from .job import BakeRequest, bake_scene
from .preview import render_preview
from .progress import ProgressDisplay
from .report import BakeReport, to_json
from .terminal import complain
from .write_files import check_writable, replace_file, save_blend, write_text


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
        entry = {"scene": str(job.scene), "output": None}
        entries.append(entry)
        try:
            entry |= _bake_file(job, batch.request, display)
            if job.preview is not None:
                _draw(job, batch.request, display)
        except DetpError as error:
            failures[job.scene] = str(error)
        except Exception:  # a fault of ours on one scene must not cost the user the other scenes
            display.end()
            for line in traceback.format_exc().splitlines():
                complain(line)
            failures[job.scene] = "The program failed here, by its own fault: please report the lines above."
        display.end()
        if job.scene in failures:
            entry["error"] = failures[job.scene]
            complain(f"{job.scene}: {failures[job.scene]}")
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


def _bake_file(job: SceneJob, request: BakeRequest, display: ProgressDisplay) -> dict:
    """Bake and save one scene, say so, and return its entry in the report."""
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
    steps = bake_scene(bpy.context.scene, bpy.context.view_layer, request, spent=spent)
    report = _finished(steps, job, display)
    with blender_silenced():
        save_blend(job.output, compressed)
    report = replace(report, scene=str(job.scene), output=str(job.output), warnings=(*opening, *report.warnings))
    display.end()
    for line in (f"{job.scene}: {report.headline()}", *report.details(), f"Saved {job.output}"):
        display.line(line)
    return report.as_json()


def _finished(steps: Generator, job: SceneJob, display: ProgressDisplay) -> BakeReport:
    """Take all the steps of a bake and return what it returns."""
    with closing(steps):
        while True:
            try:
                with blender_silenced():
                    progress = next(steps)
            except StopIteration as stop:
                return stop.value
            display.show(job.scene.stem, progress)


def _draw(job: SceneJob, request: BakeRequest, display: ProgressDisplay) -> None:
    """Draw the preview of the scene just baked, and say how bright."""
    exposures = []
    with blender_silenced():
        scene, layer = bpy.context.scene, bpy.context.view_layer
        replace_file(job.preview, lambda made: exposures.append(render_preview(scene, layer, request.attribute, made)))
    display.line(f"Drew {job.preview}, exposed by {round(exposures[0], 1) + 0.0:+.1f} stops")
