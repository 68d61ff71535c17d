"""Bakes scene files one after another; a scene that fails does not stop the others."""

from __future__ import annotations

import signal
import sys
import time
import traceback
from collections.abc import Generator, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy

from ..core.errors import DetpError
from .blender_output import blender_silenced
from .chosen_objects import chosen_objects, targets_in
from .chosen_views import View, ViewChoice, chosen_views, shared_objects
from .files import check_readable, check_writable, is_compressed, open_blend, replace_file, save_blend
from .job import BakeRequest, bake_scene
from .modifiers import apply_modifiers
from .preview import render_preview
from .progress import ProgressDisplay
from .report import BakeReport, to_json


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


def bake_batch(batch: Batch) -> int:
    """Bake every scene of ``batch``, print what was done, and return how many scenes failed.

    Raises UnwritableFileError before any work when the report cannot be written, and KeyboardInterrupt on Ctrl-C:
    the scene that was being baked is then left as it was.
    """
    if batch.report is not None:
        check_writable(batch.report)
    display = ProgressDisplay(sys.stdout, batch.quiet)
    entries, failures = [], {}
    try:
        with _interruptible() as check_interrupt:
            for job in batch.jobs:
                baked = []
                try:
                    views = _bake_file(job, batch, display, check_interrupt, baked)
                    if job.preview is not None:
                        _draw(job, batch.request, views, display)
                except DetpError as error:
                    failures[job.scene] = str(error)
                except Exception:  # a fault of ours on one scene must not cost the user the other scenes
                    display.end()
                    traceback.print_exc()
                    failures[job.scene] = "The program failed here, by its own fault: please report the lines above."
                if job.scene in failures:
                    baked = baked or [{"scene": str(job.scene), "output": None}]
                    baked[-1]["error"] = failures[job.scene]
                    display.end()
                    print(f"{job.scene}: {failures[job.scene]}", file=sys.stderr, flush=True)
                entries += baked
    finally:
        display.end()
        if batch.report is not None and entries:
            replace_file(batch.report, lambda made: made.write_text(to_json(entries), encoding="utf-8"))
    _summarise(len(batch.jobs), failures)
    return len(failures)


def _summarise(count: int, failures: dict[Path, str]) -> None:
    """After several scenes, say once more which failed, where it cannot be missed."""
    if count < 2 or not failures:
        return
    print(f"{len(failures)} of {count} scenes failed:", file=sys.stderr)
    for scene, reason in failures.items():
        print(f"  {scene}: {reason}", file=sys.stderr, flush=True)


def _bake_file(job: SceneJob, batch: Batch, display: ProgressDisplay, check_interrupt, entries: list) -> list[View]:
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
        steps = bake_scene(scene, layer, request, spent=spent, scenes_too=[scene for scene, _ in views])
        try:
            if batch.apply_modifiers:
                with blender_silenced():
                    opening += apply_modifiers(scene, layer, chosen_objects(scene, layer, request.targets))
            reports[scene, layer] = _finished(steps, title, display, check_interrupt)
        except DetpError as error:
            refusals.append((scene.name, error))
        spent = 0.0
    if not reports:
        raise refusals[0][1]
    with blender_silenced():
        save_blend(job.output, compressed)
    notes = [f"The scene '{name}' was not baked: {error}" for name, error in refusals]
    notes = (*opening, *notes, *shared_objects([scene for scene, _ in reports]))
    display.end()
    for report in reports.values():
        warnings, notes = (*notes, *report.warnings), ()
        report = replace(report, scene=str(job.scene), output=str(job.output), warnings=warnings)
        where = f"{job.scene}: " if len(views) == 1 else f"{job.scene}, scene '{report.blender_scene}': "
        for line in (where + report.headline(), *report.details()):
            display.line(line)
        entries.append(report.as_json())
    display.line(f"Saved {job.output}")
    return list(reports)


def _finished(steps: Generator, title: str, display: ProgressDisplay, check_interrupt) -> BakeReport:
    """Take all the steps of a bake and return what it returns."""
    with closing(steps):
        while True:
            try:
                with blender_silenced():
                    progress = next(steps)
            except StopIteration as stop:
                check_interrupt()
                return stop.value
            check_interrupt()
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


@contextmanager
def _interruptible() -> Iterator:
    """Make Ctrl-C raise KeyboardInterrupt here, and yield a function that raises it when Blender swallowed it.

    Blender in background mode has a handler of its own, and prints exceptions inside render engines and goes on.
    """
    interrupted = []

    def interrupt(signum, frame):
        interrupted.append(signum)
        raise KeyboardInterrupt

    def check() -> None:
        if interrupted:
            raise KeyboardInterrupt

    try:
        before = signal.signal(signal.SIGINT, interrupt)
    except ValueError:  # not in the main thread, where no signal arrives anyway
        yield check
        return
    try:
        yield check
    finally:
        # None stands for Blender's own handler in C, which cannot be put back from here.
        signal.signal(signal.SIGINT, signal.default_int_handler if before is None else before)
