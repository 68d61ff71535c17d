"""One bake of one Blender scene, step by step: read it, bake it, write the colours at the very end.

The command line and the panel's operator drive the same generator. Only the panel shows the colours before.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from ..core.bake import BakeResult, Progress, bake
from ..core.direct.ambient_occlusion import ambient_occlusion
from ..core.errors import DetpError, InvalidSettingError, NoLightError, NoMeshError, UnwritableFileError
from ..core.estimator.enclosure import unlit
from ..core.memory import check_baking, memory_errors_named
from ..core.settings import BakeSettings
from .causes import why_dark, why_no_light, why_nothing_to_bake
from .chosen_objects import chosen_objects
from .chosen_views import not_baked
from .element_values import QUANTITIES, quantity_values, spread
from .live_colours import LiveColours
from .reading.read_scene import BakeTarget, ExportedScene, read_scene
from .report import BakeReport, counted
from .write_attributes import MeshColours, check_attribute_name, element_count, faces_of, obstacle, write_colours

#: where the colours live: each face's own light, or one colour per vertex
DOMAINS = ("CORNER", "POINT")

#: seconds to write the colour of one point, and the least time that is left to the bake itself
WRITING, LEAST_SECONDS = 4e-6, 0.05

#: share of the emitted flux that the bounce limit may cut without a warning
HARMLESS_CUT = 0.01


@dataclass(frozen=True)
class BakeRequest:
    """What to bake, how, and where to put it.

    targets    "visible" (all meshes that a render shows), "selected", or the objects' names
    attribute  name of the colour attribute
    domain     one of DOMAINS
    quantity   one of element_values.QUANTITIES
    split      direct and indirect light also in attributes of their own, <attribute>_direct and <attribute>_indirect
    activate   make the attribute the one that viewport and render show

    Raises InvalidSettingError on anything else.
    """

    settings: BakeSettings = field(default_factory=BakeSettings)
    targets: str | tuple[str, ...] = "visible"
    attribute: str = "irradiance"
    domain: str = "CORNER"
    quantity: str = "lighting"
    split: bool = False
    activate: bool = True

    def __post_init__(self):
        for name in self.attributes:
            check_attribute_name(name)
        if isinstance(self.targets, str) and self.targets not in ("visible", "selected"):
            raise InvalidSettingError(f"Unknown choice '{self.targets}': bake what is visible, selected or named.")
        if self.domain not in DOMAINS:
            raise InvalidSettingError(f"Unknown domain '{self.domain}': choose {', '.join(DOMAINS)}.")
        if self.quantity not in QUANTITIES:
            raise InvalidSettingError(f"Unknown quantity '{self.quantity}': choose {', '.join(QUANTITIES)}.")
        if self.split and self.quantity == "ambient-occlusion":
            raise InvalidSettingError("Ambient occlusion has no direct and indirect part: leave the split away.")

    @property
    def attributes(self) -> tuple[str, ...]:
        """The names of all attributes that are written."""
        parts = ("direct", "indirect") if self.split else ()
        return (self.attribute, *(f"{self.attribute}_{part}" for part in parts))


@dataclass(frozen=True)
class JobProgress:
    """Where a job stands: what it is doing, the share done (0..1), and the seconds it still needs, if known.

    error   the share by which half of the lit points are likely to be off at most so far; None while it is unknown
    shown   whether colours have just been shown, which wait to be drawn
    """

    phase: str
    fraction: float
    remaining: float | None = None
    error: float | None = None
    shown: bool = False


def bake_scene(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    request: BakeRequest,
    live: LiveColours | None = None,
    spent: float = 0.0,
    scenes_too: Sequence[bpy.types.Scene] = (),
) -> Generator[JobProgress, bool | None, BakeReport]:
    """Bake ``scene`` as ``request`` says; yields a JobProgress often and returns the BakeReport.

    Sending True ends the bake at once with what it has found, as soon as that is something. ``live`` shows the
    colours meanwhile, and takes them back before the last step. ``spent`` seconds count against the time of the bake.
    ``scenes_too`` are those that are baked with it; of others the report has a word.

    Nothing else of the user's is touched before the last step, so closing the generator leaves everything as it was;
    if that step fails, what it wrote is taken back. An object that cannot be written becomes a warning; when none can,
    its error is raised. Raises DetpError.
    """
    with memory_errors_named():
        return (yield from _steps(scene, view_layer, request, live, spent, scenes_too))


def _steps(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    request: BakeRequest,
    live: LiveColours | None,
    spent: float,
    scenes_too: Sequence[bpy.types.Scene],
) -> Generator[JobProgress, bool | None, BakeReport]:
    """The steps of :func:`bake_scene`."""
    start = time.perf_counter() - spent
    names = scene.name, view_layer.name
    others = not_baked(scene, view_layer, scenes_too)
    yield JobProgress("Reading the scene", 0.0)
    chosen = chosen_objects(scene, view_layer, request.targets)
    try:
        export = read_scene(scene, view_layer, chosen, request.domain, request.attributes)
    except NoMeshError as error:
        raise NoMeshError(why_nothing_to_bake(scene, chosen) or str(error)) from None
    targets, refusals = _writable(export.targets, request)
    targets, rows = _points_of(targets, len(export.centres))
    check_baking(len(export.scene.triangles), len(rows))
    exported = time.perf_counter()

    found, stopped = None, False
    with live or nullcontext():
        for progress in _bake_steps(scene, export, rows, request, start):
            found = progress.found or found
            shown = progress.found is not None and live is not None and live.due
            if shown:
                begin = time.perf_counter()
                live.show(_colours(_seen(targets, export, rows, found), found, request)[0], begin)
            wish = yield _job_progress(progress, found, time.perf_counter() - exported, shown)
            stopped = stopped or bool(wish)
            if stopped and found is not None:
                break
    result = found

    yield JobProgress("Writing the colours", 1.0)
    writing = time.perf_counter()
    targets = _seen(targets, export, rows, result)
    colours, gone = _colours(targets, result, request)
    notes = write_colours(colours, request.domain, request.attribute if request.activate else None)
    end = time.perf_counter()
    doubts = _doubts(result, request.settings, stopped, export.scene.vertices)
    return BakeReport(
        scene=names[0],
        objects=len(colours),
        points=len(rows),
        filled=sum(int((target.point_rows < 0).sum()) for target in targets),
        triangles=len(export.scene.triangles),
        lights=export.lights,
        photons=result.photons,
        shadow_rays=result.shadow_rays,
        segments=result.segments,
        radius=result.radius,
        gatherer=result.gatherer,
        gatherer_reason=result.reason,
        seconds={
            "export": exported - start,
            "shadow": result.seconds["shadow"],
            "trace": result.seconds["radius"] + result.seconds["trace"],
            "gather": result.seconds["place"] + result.seconds["gather"],
            "write": end - writing,
            "total": end - start,
        },
        relative_error=result.relative_error,
        high_error=result.high_error,
        modelled=tuple(export.modelled),
        left_out=tuple(export.left_out),
        blender_scene=names[0],
        view_layer=names[1],
        warnings=(*others, *export.warnings, *refusals, *gone, *notes, *doubts),
    )


def _writable(targets: tuple[BakeTarget, ...], request: BakeRequest) -> tuple[list[BakeTarget], list[str]]:
    """The targets that can be written, and sentences on those that cannot; raises their error when none can."""
    writable, refusals, objects = [], {}, _objects()
    for target in targets:
        refusal = _obstacle(objects[target.object_name, target.library], request)
        if refusal is not None:
            refusals.setdefault(type(refusal), []).append(str(refusal))
        else:
            writable.append(target)
    sentences = [sentence for group in refusals.values() for sentence in _first(group)]
    if refusals and not writable:
        raise next(iter(refusals))(" ".join(sentences))
    return writable, sentences


def _obstacle(obj: bpy.types.Object, request: BakeRequest) -> DetpError | None:
    """Why one of the attributes cannot be written, or None when all can."""
    return next(filter(None, (obstacle(obj, name, request.domain) for name in request.attributes)), None)


def _first(sentences: list[str], shown: int = 3) -> list[str]:
    """The first sentences, and how many more there are like them."""
    more = len(sentences) - shown
    return sentences if more <= 0 else [*sentences[:shown], f"The same holds for {counted(more, 'more object')}."]


def _points_of(targets: list[BakeTarget], count: int) -> tuple[list[BakeTarget], np.ndarray]:
    """The rows of the estimation points that ``targets`` use, and the targets with rows counted among those."""
    used = np.zeros(count + 1, bool)
    for target in targets:
        used[target.point_rows] = True
    used[-1] = False
    renumbered = np.where(used, np.cumsum(used) - 1, -1)
    moved = [replace(target, point_rows=renumbered[target.point_rows]) for target in targets]
    return moved, np.flatnonzero(used)


def _bake_steps(
    scene: bpy.types.Scene, export: ExportedScene, rows: np.ndarray, request: BakeRequest, start: float
) -> Iterator[Progress]:
    """The steps of the core's bake, the last of which has the result; ``start`` is when the job began."""
    surfaces, settings = export.scene, request.settings
    if request.quantity == "ambient-occlusion":
        surfaces, settings = ambient_occlusion(surfaces, settings)
    if settings.seconds is not None:
        # Writing takes about as long as reading did, and the core gets what is left between.
        reading = time.perf_counter() - start
        left = settings.seconds - reading - WRITING * len(rows)
        settings = replace(settings, seconds=max(left, LEAST_SECONDS))
    try:
        result = yield from bake(surfaces, export.centres[rows], export.normals[rows], settings, export.inward[rows])
    except NoLightError as error:
        raise NoLightError(why_no_light(scene, export.warnings) or str(error)) from None
    yield Progress("Writing the colours", 1.0, result)


def _job_progress(progress: Progress, found: BakeResult | None, passed: float, shown: bool) -> JobProgress:
    share = progress.fraction
    remaining = passed * (1 - share) / share if 0.01 < share < 1 else None
    error = None if found is None or not np.isfinite(found.relative_error) else found.relative_error
    return JobProgress(progress.phase, share, remaining, error, shown)


def _seen(targets: list[BakeTarget], export: ExportedScene, rows: np.ndarray, result: BakeResult) -> list[BakeTarget]:
    """The targets with no point for corners that no light can reach."""
    # A covered face that is dark belongs to things that touch; one that has light stands back to back with another.
    hidden = result.hidden | (export.covered[rows] & unlit(result.irradiance))
    return [_without_hidden(target, hidden) for target in targets]


def _without_hidden(target: BakeTarget, hidden: np.ndarray) -> BakeTarget:
    """The target with no point for corners whose point (of N) is ``hidden``, so that their neighbours fill them."""
    buried = (target.point_rows >= 0) & hidden[target.point_rows]
    return replace(target, point_rows=np.where(buried, -1, target.point_rows))


def _colours(
    targets: list[BakeTarget], result: BakeResult, request: BakeRequest
) -> tuple[list[MeshColours], list[str]]:
    """The colours of each target's elements, and a warning for each target that changed during the bake."""
    colours, gone, objects = [], [], _objects()
    parts = (result.irradiance, result.direct.value, result.indirect.value)
    for target in targets:
        obj = objects.get((target.object_name, target.library))
        if obj is None or obj.type != "MESH" or element_count(obj.data, request.domain) != len(target.albedo):
            gone.append(f"'{target.object_name}' was changed during the bake, so its colours were not written.")
            continue
        refusal = _obstacle(obj, request)
        if refusal is not None:
            gone.append(str(refusal))
            continue
        faces = faces_of(obj.data, request.domain)
        layers = {}
        for name, irradiance in zip(request.attributes, parts, strict=False):
            # What a surface emits is part of its direct light, and of the whole.
            emission = np.zeros_like(target.emission) if irradiance is parts[2] else target.emission
            values = spread(irradiance, target.point_rows, faces)
            layers[name] = quantity_values(request.quantity, values, target.albedo, emission)
        colours.append(MeshColours(obj, layers))
    if not colours:
        raise UnwritableFileError("Every object was changed during the bake, so no colours were written: bake again.")
    return colours, gone


def _objects() -> dict[tuple[str, str | None], bpy.types.Object]:
    """All objects by name and library, asked for each time: references do not survive an undo during the bake.

    Blender itself would look through all of them for each name.
    """
    return {(obj.name, obj.library.filepath if obj.library else None): obj for obj in bpy.data.objects}


def _doubts(result: BakeResult, settings: BakeSettings, stopped: bool, vertices: np.ndarray) -> list[str]:
    """What in the result itself the user should know; ``vertices`` (V, 3) are those of all surfaces."""
    doubts = []
    aim = settings.aimed_noise
    short = aim is not None and result.relative_error > aim * (1 + 1e-9)
    if stopped:
        doubts.append("The bake was stopped before its end, and what it had found was kept.")
    elif short:
        remedy = "ask for it by its number, to bake on" if settings.error is None else "allow a larger radius"
        doubts.append(
            f"The error of {settings.target_error:.1%} that was aimed at was not reached with "
            f"{counted(result.photons, 'photon')}: {remedy}, or choose a larger error."
        )
    if not result.irradiance.any():
        doubts.append(why_dark(vertices, result.photons))
    emitted = np.abs(result.emitted_flux).sum()
    cut = np.abs(result.cut_flux).sum()
    if cut > HARMLESS_CUT * emitted:
        doubts.append(
            f"The limit on bounces cut off light worth {cut / emitted:.1%} of what the lights emit: "
            f"allow more bounces, or use darker materials where the albedo is close to 1."
        )
    return doubts
