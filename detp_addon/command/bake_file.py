"""Bakes one scene file in this process, where Blender is loaded; what is wrong with the file becomes its outcome."""

from __future__ import annotations

import time
import traceback
from collections.abc import Generator
from contextlib import closing
from dataclasses import replace

from ...core.errors import DetpError, InvalidSettingError
from ...core.memory import keep_memory, memory_errors_named
from ...core.settings import QUALITIES
from ..chosen_objects import chosen_objects, targets_in
from ..chosen_views import View, ViewChoice, chosen_views, shared_objects
from ..files.bake_mark import BakeMark, fingerprint, mark_output
from ..files.open_files import check_readable, is_compressed, open_blend
from ..files.write_files import check_writable, replace_file, save_blend
from ..job import bake_scene
from ..likely import likely_bake, likely_values
from ..materials.light_in_materials import use_in_materials
from ..preview.render_preview import render_preview
from ..report import BakeReport
from ..request import BakeRequest
from ..writing.encoding import Encoding
from ..writing.face_division import divide_faces, division_note, most_vertices
from ..writing.modifiers import apply_modifiers
from .bake_command import bake_settings
from .blender_output import blender_silenced
from .jobs import BAKED, FORESEEN, Outcome, SceneJob, failed, light_options, previews_of, skipped
from .kept_output import KeptOutput
from .part import Messages
from .progress import ProgressDisplay

#: where progress and lines go: a terminal, or the process that started this one
Display = ProgressDisplay | Messages

#: Of the time that a bake may take, so much for those that tell which faces to divide.
ROUGH_SHARE = 0.5


def bake_file(job: SceneJob, options: dict, display: Display, drawn: list[dict] | None = None) -> Outcome:
    """Bake and save one file as the command's ``options`` say, and draw it; or foresee how long that will take.

    With entries of an earlier report, which are to be ``drawn``, the output is only opened and drawn. Raises
    InvalidSettingError on options that no file can be baked with.
    """
    begin = time.perf_counter()
    keep_memory()
    request = bake_request(options)
    views = ViewChoice(options["scene"], options["view_layer"], options["all_scenes"])
    entries: list[dict] = []
    try:
        with memory_errors_named():
            if drawn:
                entries += drawn
                _draw_again(job, request, drawn, display)
                outcome = skipped(entries)
            elif options["dry_run"]:
                outcome = Outcome(FORESEEN, _foreseen(job, request, views))
            else:
                baked = _bake(job, options, request, views, display, entries)
                _draw(job, request, baked, entries, display)
                outcome = Outcome(BAKED, entries)
    except DetpError as error:
        outcome = failed(job, str(error), entries)
    except Exception:  # a fault of ours on one scene must not cost the user the other scenes
        for line in traceback.format_exc().splitlines():
            display.complain(line)
        outcome = failed(job, "The program failed here, by its own fault: please report the lines above.", entries)
    return replace(outcome, seconds=time.perf_counter() - begin)


def bake_request(options: dict) -> BakeRequest:
    """What the command's ``options`` ask for. Raises InvalidSettingError."""
    if options["subdivide"] and (options["fit"] != "faces" or options["subdivide"] < 0):
        raise InvalidSettingError("Only colours fitted to faces tell which to subdivide, and 0 times or more.")
    return BakeRequest(
        settings=bake_settings(options),
        targets=tuple(options["objects"]) if options["objects"] else "visible",
        domain=options["domain"].upper(),
        activate=options["activate"] == "on",
        encoding=Encoding(options["exposure"], options["clamp"], options["storage"]),
        beside=options["jobs"],
        **{name: options[name] for name in ("attribute", "fit", "quantity", "split", "by_light", "cluster")},
    )


def _bake(
    job: SceneJob, options: dict, request: BakeRequest, choice: ViewChoice, display: Display, entries: list[dict]
) -> list[View]:
    """Bake and save one file, say so, add an entry of the report for each view baked, and return these views."""
    for path in (job.output, job.preview):
        if path is not None:
            check_writable(path)
    begin = time.perf_counter()
    check_readable(job.scene)
    content = fingerprint(job.scene, light_options(options))
    with blender_silenced():
        opening = open_blend(job.scene)
    compressed = is_compressed(job.scene)
    # Saving takes about as long as opening, and counts against the time of the bake as well.
    spent = 2.0 * (time.perf_counter() - begin)
    views = chosen_views(choice)
    reports, refusals, kept = {}, [], KeptOutput(job, options)
    for scene, layer in views:
        asked = request if len(views) == 1 else replace(request, targets=targets_in(scene, request.targets))
        title = job.scene.stem if len(views) == 1 else f"{job.scene.stem}, {scene.name}"
        try:
            if options["apply_modifiers"]:
                with blender_silenced():
                    opening += apply_modifiers(scene, layer, chosen_objects(scene, layer, asked.targets))
            begin = time.perf_counter()
            divided = _subdivided(scene, layer, asked, options["subdivide"], title, display)
            spent += time.perf_counter() - begin
            scenes = [scene for scene, _ in views]
            steps = bake_scene(scene, layer, asked, None, spent, scenes, kept.of(scene, layer, asked))
            report = finished_bake(steps, title, display)
            if divided is not None:
                report = replace(report, warnings=(*report.warnings, division_note(*divided, report.lossy_faces.whole)))
            reports[scene, layer] = report
        except DetpError as error:
            refusals.append((scene.name, error))
        spent = 0.0
    if not reports:
        raise refusals[0][1]
    used = None
    if options["use_in_material"] is not None:
        objects = [obj for scene, _ in reports for obj in scene.objects]
        with blender_silenced():
            used = use_in_materials(objects, request.attribute, options["use_in_material"])
    notes = [f"The scene '{name}' was not baked: {error}" for name, error in refusals]
    notes = (*opening, *notes, *shared_objects([scene for scene, _ in reports]), *(used.notes if used else ()))
    first = next(iter(reports))
    reports[first] = replace(reports[first], warnings=(*notes, *reports[first].warnings))
    kept.mark(first[0])
    _save(job, content, compressed, reports)
    kept_line = kept.write()
    for report in reports.values():
        report = replace(report, scene=str(job.scene), output=str(job.output))
        where = f"{job.scene}: " if len(views) == 1 else f"{job.scene}, scene '{report.blender_scene}': "
        for line in (where + report.headline(), *report.details()):
            display.line(line)
        entries.append(report.as_json())
    if used is not None:
        display.line(used.sentence())
    display.line(f"Saved {job.output}")
    if kept_line is not None:
        display.line(kept_line)
    return list(reports)


def _save(job: SceneJob, content: str, compressed: bool, reports: dict[View, BakeReport]) -> None:
    """Save the open file with the mark of its bake, in which the names of both files are left out: they may change."""
    entries = [report.as_json() for report in reports.values()]
    bare = tuple({name: entry[name] for name in entry if name not in ("scene", "output")} for entry in entries)
    mark_output([scene for scene, _ in reports], BakeMark(content, bare))
    with blender_silenced():
        save_blend(job.output, compressed)


def _foreseen(job: SceneJob, request: BakeRequest, choice: ViewChoice) -> list[dict]:
    """An entry for each scene of the file with how long its bake will take, and how well it will turn out."""
    begin = time.perf_counter()
    with blender_silenced():
        open_blend(job.scene)
    # It will be opened once more, and saved.
    seconds, entries = 2.0 * (time.perf_counter() - begin), []
    for scene, layer in chosen_views(choice):
        asked = replace(request, targets=targets_in(scene, request.targets))
        values = likely_values(scene, layer, asked)
        likely = likely_bake(scene, layer, asked, values)
        entries.append(
            {
                "scene": str(job.scene), "output": str(job.output), "blender_scene": scene.name,
                "forecast": {"points": values, "seconds": likely.seconds + seconds, "relative_error": likely.error},
            }
        )  # fmt: skip
        seconds = 0.0
    return entries


def _subdivided(
    scene, layer, request: BakeRequest, times: int, title: str, display: Display
) -> tuple[int, int, float] | None:
    """Divide faces where light changes, up to so many ``times``, each time after a bake of quality draft.

    Returns how many faces, of how many objects, and the share of their light that faces showed wrong before; None when
    there was nothing to divide.
    """
    seconds, error = request.settings.seconds, None
    if seconds is not None:
        seconds, error = seconds * ROUGH_SHARE / max(times, 1), QUALITIES["draft"]
    settings = replace(request.settings, quality="draft", error=error, photons=None, seconds=seconds)
    rough = replace(request, settings=settings, by_light=False)
    faces, objects, before = 0, 0, None
    for left in range(times, 0, -1):
        report = finished_bake(bake_scene(scene, layer, rough), f"{title}, rough", display)
        if len(report.lossy_faces.faces) == 0:
            break
        if before is None:
            before, most = report.lossy_faces.whole, most_vertices(report.lossy_faces)
        with blender_silenced():
            divided, among, added = divide_faces(report.lossy_faces, most // left)
        faces, objects, most = faces + divided, max(objects, among), most - added
    return None if before is None else (faces, objects, before)


def finished_bake(steps: Generator, title: str, display: Display) -> BakeReport:
    """Take all the steps of a bake and return what it returns."""
    with closing(steps):
        while True:
            try:
                with blender_silenced():
                    progress = next(steps)
            except StopIteration as stop:
                return stop.value
            display.show(title, progress)


def _draw(job: SceneJob, request: BakeRequest, views: list[View], entries: list[dict], display: Display) -> None:
    """Draw the previews that are wanted of the views just baked, and say how bright."""
    for (scene, layer), path in zip(views, previews_of(job, entries), strict=False):
        stops = []
        with blender_silenced():
            replace_file(path, lambda made: stops.append(render_preview(scene, layer, request.attribute, made)))  # noqa: B023 - called at once
        display.line(f"Drew {path}, exposed by {round(stops[0], 1) + 0.0:+.1f} stops")


def _draw_again(job: SceneJob, request: BakeRequest, entries: list[dict], display: Display) -> None:
    """Open what an earlier run baked, and draw it."""
    for path in previews_of(job, entries):
        check_writable(path)
    with blender_silenced():
        open_blend(job.output)
    views = [view for each in entries for view in chosen_views(ViewChoice(each["blender_scene"], each["view_layer"]))]
    _draw(job, request, views, entries, display)
