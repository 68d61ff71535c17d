"""One trial: make the scene of a seed, bake it in one of the ways a user can, and judge what comes out."""

from __future__ import annotations

import contextlib
import io
import json
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path

import bpy
import numpy as np
from detp import detp_addon
from detp.core.errors import DetpError
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.detp_addon.command.command import main
from detp.detp_addon.job import bake_scene
from detp.detp_addon.panel import session
from detp.detp_addon.request import BakeRequest
from fuzz.chance import Chance
from fuzz.fingerprint import broken_promises, fingerprint
from fuzz.judgement import Refused, Wrong, judge_bake, judge_refusal, judged_report
from fuzz.scenes import make_scene
from fuzz.wishes import attribute_name, request_values, settings_values


@dataclass
class Outcome:
    """What a trial showed.

    verdict   "baked", "refused" with a named error, or "failed"
    way       one of WAYS
    message   the report's headline, the error's sentence, or what is wrong, with a traceback
    noise     runtime warnings of NumPy, by place
    seconds   of making the scene and of baking it
    """

    seed: int
    verdict: str = "failed"
    way: str = ""
    message: str = ""
    noise: list[str] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)

    def as_json(self) -> str:
        """One line."""
        return json.dumps(asdict(self))


def try_seed(seed: int, entered: Callable[[str], None] = lambda phase: None) -> Outcome:
    """Make, bake and judge the scene of ``seed``; calls ``entered`` with "making" and "baking" when they begin."""
    chance = Chance(seed)
    outcome = Outcome(seed)
    attribute = attribute_name(chance)
    entered("making")
    start = time.perf_counter()
    try:
        make_scene(chance, attribute)
    except Exception:
        outcome.way, outcome.message = "making", traceback.format_exc()
        return outcome
    made = time.perf_counter()
    outcome.way = chance.one_of("job", "job", "job", "job", "twice", "cancelled", "operator", "operator", "command")
    settings = settings_values(chance)
    request = request_values(chance, attribute, [obj.name for obj in bpy.data.objects])
    entered("baking")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            outcome.message = WAYS[outcome.way](settings, request)
            outcome.verdict = "baked"
        except Refused as refusal:
            outcome.message = str(refusal)
            outcome.verdict = "refused"
        except Wrong as wrong:
            outcome.message = str(wrong)
        except BaseException:
            outcome.message = traceback.format_exc()
    outcome.seconds = {"making": round(made - start, 2), "baking": round(time.perf_counter() - made, 2)}
    outcome.noise = sorted({f"{Path(w.filename).name}:{w.lineno} {w.message}" for w in caught})
    return outcome


def _by_job(settings: dict, request: dict) -> str:
    before = fingerprint()
    try:
        wanted = BakeRequest(BakeSettings(**settings), **request)
        report = finished(bake_scene(bpy.context.scene, bpy.context.view_layer, wanted))
    except DetpError as error:
        judge_refusal(str(error), type(error).__name__, before, request)
    judge_bake(before, request, report.objects, report.warnings)
    return judged_report(report)


def _by_job_twice(settings: dict, request: dict) -> str:
    _by_job(settings, request)
    for mesh in bpy.data.meshes:
        layer = mesh.attributes.get(request["attribute"])
        if layer is not None and layer.data_type == "FLOAT_COLOR":
            layer.data.foreach_set("color", np.full(4 * len(layer.data), np.nan, np.float32))
    return _by_job({**settings, "seed": settings["seed"] + 1}, request)


def _by_job_cancelled(settings: dict, request: dict) -> str:
    before = fingerprint()
    try:
        steps = bake_scene(bpy.context.scene, bpy.context.view_layer, BakeRequest(BakeSettings(**settings), **request))
        # A bake ends after it has said that it will write; before that it has touched nothing.
        for _, progress in zip(range(1 + settings["seed"] % 6), steps, strict=False):
            if progress.phase.startswith("Writing"):
                break
        steps.close()
    except DetpError as error:
        judge_refusal(str(error), type(error).__name__, before, request)
    changes = broken_promises(before, fingerprint(), (), [])
    if changes:
        raise Wrong("a cancelled bake changed something: " + "; ".join(changes)[:2000])
    return "cancelled"


def _by_operator(settings: dict, request: dict) -> str:
    detp_addon.register()
    try:
        before = fingerprint()
        session.forget()
        options = {
            **{name: value for name, value in settings.items() if name not in ("photons", "radius", "bounces", "seed")},
            **request,
            "photons": max(settings["photons"], 1),
            "bounces": max(settings["bounces"], 0),
            "seed": max(settings["seed"], 0),
            "radius": min(max(settings["radius"] or 0.0, 0.0), 1e30),
        }
        known = bpy.ops.detp.bake.get_rna_type().properties
        options = {
            name: _as_option(known[name], value)
            for name, value in options.items()
            if name in known and value is not None
        }
        if options["targets"] not in ("VISIBLE", "SELECTED"):
            options["targets"] = "VISIBLE"
        try:
            bpy.ops.detp.bake(**options)
        except RuntimeError as error:
            if "Traceback" in str(error):
                raise
            judge_refusal(str(error).removeprefix("Error: ").strip(), "DetpError", before, request)
        report = session.latest().outcome.report
        if report is None:
            raise Wrong(f"the operator ended without error and without report: {session.latest().outcome}")
        judge_bake(before, request, report.objects, report.warnings)
        return judged_report(report)
    finally:
        detp_addon.unregister()


def _as_option(prop, value):
    if prop.type != "ENUM":
        return value
    return str(value).upper().replace("-", "_")


def _by_command(settings: dict, request: dict) -> str:
    with tempfile.TemporaryDirectory() as folder:
        scene, baked, log = (Path(folder) / name for name in ("scene.blend", "baked.blend", "report.json"))
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        bpy.ops.wm.save_as_mainfile(filepath=str(scene), copy=True)
        bpy.ops.wm.open_mainfile(filepath=str(scene), use_scripts=False)
        before = fingerprint()
        given = {"domain": request["domain"].lower(), "attribute": request["attribute"], "report": log}
        given |= {"quantity": request["quantity"], **settings}
        given = {name: value for name, value in given.items() if value is not None and name != "shadow_distance"}
        arguments = ["bake", str(scene), f"-o{baked}", *(f"--{name}={value}" for name, value in given.items())]
        arguments += ["--split"] * request["split"]
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            status = main(arguments)
        if "Traceback" in printed.getvalue():
            raise Wrong(printed.getvalue())
        if status != 0:
            sentence = printed.getvalue().strip().splitlines()[-1].partition(": ")[2]
            if status == 2:
                raise Refused(f"usage: {sentence}")
            judge_refusal(sentence, "DetpError", before, request)
        (entry,) = json.loads(log.read_text(encoding="utf-8"))
        judge_bake(before, request, entry["objects"], entry["warnings"])
        bpy.ops.wm.open_mainfile(filepath=str(baked), use_scripts=False)
        return printed.getvalue().strip().splitlines()[-1]


WAYS = {
    "job": _by_job,
    "twice": _by_job_twice,
    "cancelled": _by_job_cancelled,
    "operator": _by_operator,
    "command": _by_command,
}
