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

from ..core.bake import bake
from ..core.direct.ambient_occlusion import ambient_occlusion
from ..core.direct.lit_behind import lit_behind
from ..core.errors import DetpError, InvalidSettingError, NoLightError, NoMeshError, UnwritableFileError
from ..core.estimator.enclosure import unlit
from ..core.fit.vertex_fit import VertexFit
from ..core.memory import check_baking, memory_errors_named
from ..core.points import Points
from ..core.result import BakeResult, Progress
from ..core.scene import Scene
from ..core.settings import BakeSettings
from .causes import turned_away, why_dark, why_no_light, why_nothing_to_bake
from .chosen_objects import chosen_objects, objects_by_name
from .chosen_views import not_baked
from .materials.use_light import materials_with_light, refresh_materials
from .reading.read_scene import FITS, BakeTarget, ExportedScene, read_scene
from .report import BakeReport, counted
from .steps import JobProgress
from .writing.baked_layers import look_of
from .writing.element_values import QUANTITIES, quantity_values, spread
from .writing.encoding import Encoding, encoded, fitted_scale, usual_scale
from .writing.live_colours import LiveColours
from .writing.lossy_faces import LossyFaces
from .writing.write_attributes import (
    MeshColours,
    check_attribute_name,
    corner_faces,
    element_count,
    faces_of,
    obstacle,
    write_colours,
)

#: where the colours live: each face's own light, or one colour per vertex
DOMAINS = ("CORNER", "POINT")

#: seconds to write the colour of one point, and the least time that is left to the bake itself
WRITING, LEAST_SECONDS = 4e-6, 0.05

#: objects that are dark all over, and points of each, whose backs are looked at; what counts as lit, of what is usual
MOST_DARK, DARK_POINTS, LIT_BEHIND = 64, 16, 0.1

#: share of the emitted flux that the bounce limit may cut without a warning
HARMLESS_CUT = 0.01


@dataclass(frozen=True)
class BakeRequest:
    """What to bake, how, and where to put it.

    targets    "visible" (all meshes that a render shows), "selected", or the objects' names
    attribute  name of the colour attribute
    domain     one of DOMAINS
    fit        "faces": colours such that faces show their light between them; "vertices": the light at the vertices
    quantity   one of element_values.QUANTITIES
    split      direct and indirect light also in attributes of their own, <attribute>_direct and <attribute>_indirect
    activate   make the attribute the one that viewport and render show
    encoding   how the light becomes the attribute's numbers
    look       beside it, a layer with what the surfaces look like in the light, which the viewport shows

    Raises InvalidSettingError on anything else.
    """

    settings: BakeSettings = field(default_factory=BakeSettings)
    targets: str | tuple[str, ...] = "visible"
    attribute: str = "irradiance"
    domain: str = "CORNER"
    fit: str = "faces"
    quantity: str = "lighting"
    split: bool = False
    activate: bool = True
    encoding: Encoding = field(default_factory=Encoding)
    look: bool = False

    def __post_init__(self):
        for name in self.attributes:
            check_attribute_name(name)
        if isinstance(self.targets, str) and self.targets not in ("visible", "selected"):
            raise InvalidSettingError(f"Unknown choice '{self.targets}': bake what is visible, selected or named.")
        if self.domain not in DOMAINS:
            raise InvalidSettingError(f"Unknown domain '{self.domain}': choose {', '.join(DOMAINS)}.")
        if self.fit not in FITS:
            raise InvalidSettingError(f"Unknown choice '{self.fit}': fit the colours to {' or '.join(FITS)}.")
        if self.quantity not in QUANTITIES:
            raise InvalidSettingError(f"Unknown quantity '{self.quantity}': choose {', '.join(QUANTITIES)}.")
        if self.split and self.quantity == "ambient-occlusion":
            raise InvalidSettingError("Ambient occlusion has no direct and indirect part: leave the split away.")

    @property
    def attributes(self) -> tuple[str, ...]:
        """The names of all attributes that are written."""
        parts = ("direct", "indirect") if self.split else ()
        return (self.attribute, *(f"{self.attribute}_{part}" for part in parts))


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
        export = read_scene(scene, view_layer, chosen, request.domain, request.attributes, request.fit)
    except NoMeshError as error:
        raise NoMeshError(why_nothing_to_bake(scene, chosen) or str(error)) from None
    targets, refusals = _writable(export.targets, request)
    targets, points = _points_of(targets, export)
    check_baking(len(export.scene.triangles), len(points.centres))
    exported = time.perf_counter()

    scales = _usual_scales(scene, targets, request)
    found, stopped = None, False
    with live or nullcontext():
        for progress in _bake_steps(scene, export, points, request, start):
            found = progress.found or found
            shown = progress.found is not None and live is not None and live.due
            if shown:
                begin = time.perf_counter()
                colours, _ = _colours(targets, _values(points, found), request, scales[1])
                live.show(encoded(colours, request.encoding, request.quantity, scales[0])[0], begin)
            wish = yield _job_progress(progress, found, time.perf_counter() - exported, shown)
            stopped = stopped or bool(wish)
            if stopped and found is not None:
                break
    result = found

    yield JobProgress("Writing the colours", 1.0)
    writing = time.perf_counter()
    values = _values(points, result)
    colours, gone = _colours(targets, values, request, scales[1])
    lossy = _lossy_faces(export, points, values, result)
    turned = _turned_away(targets, export.scene, points, result) if request.quantity != "ambient-occlusion" else []
    stored, brightness = encoded(colours, request.encoding, request.quantity, scales[0])
    notes = write_colours(stored, request.domain, request.attribute if request.activate else None)
    notes += refresh_materials([entry.object for entry in stored], request.attribute)
    end = time.perf_counter()
    doubts = _doubts(result, request.settings, stopped, scene, export.scene)
    return BakeReport(
        scene=names[0],
        objects=len(colours),
        points=len(values.known),
        filled=sum(int((_known_rows(target, values.known) < 0).sum()) for target in targets),
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
        brightness=brightness,
        lossy_faces=lossy,
        modelled=tuple(export.modelled),
        left_out=tuple(export.left_out),
        blender_scene=names[0],
        view_layer=names[1],
        warnings=(*others, *export.warnings, *refusals, *gone, *notes, *doubts, *turned),
    )


def _writable(targets: tuple[BakeTarget, ...], request: BakeRequest) -> tuple[list[BakeTarget], list[str]]:
    """The targets that can be written, and sentences on those that cannot; raises their error when none can."""
    writable, refusals, objects = [], {}, objects_by_name()
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
    kind = request.encoding.type
    return next(filter(None, (obstacle(obj, name, request.domain, kind) for name in request.attributes)), None)


def _usual_scales(
    scene: bpy.types.Scene, targets: list[BakeTarget], request: BakeRequest
) -> tuple[float | None, float | None]:
    """What light and look of the scene's other meshes were multiplied by: a part must be as bright as the rest."""
    if request.targets == "visible":
        return None, None
    objects = objects_by_name()
    written = [objects[each.object_name, each.library] for each in targets]
    return tuple(usual_scale(scene, name, written) for name in (request.attribute, look_of(request.attribute)))


def _first(sentences: list[str], shown: int = 3) -> list[str]:
    """The first sentences, and how many more there are like them."""
    more = len(sentences) - shown
    return sentences if more <= 0 else [*sentences[:shown], f"The same holds for {counted(more, 'more object')}."]


@dataclass(frozen=True)
class _Points:
    """The points whose light gives the colours of some targets.

    centres, normals, facing, inward   (N, 3) as the core's bake takes them
    covered                    (N,) whether another face lies against that of the point
    shown                      (N,) the value, or one of those, that shows the light of the point
    fit                        makes the colours' values of their light; None where each point is a value
    triangles                  (T,) of the faces as read, that it fits
    """

    centres: np.ndarray
    normals: np.ndarray
    facing: np.ndarray
    inward: np.ndarray
    covered: np.ndarray
    shown: np.ndarray
    fit: VertexFit | None
    triangles: np.ndarray


@dataclass(frozen=True)
class _Values:
    """What colours are made of: irradiance (U, 3), direct (U, 3) and indirect (U, 3), and whether (U,) it is known.

    ``open`` (N,) says how much each point counts.
    """

    irradiance: np.ndarray
    direct: np.ndarray
    indirect: np.ndarray
    known: np.ndarray
    open: np.ndarray


def _points_of(targets: list[BakeTarget], export: ExportedScene) -> tuple[list[BakeTarget], _Points]:
    """The points that ``targets`` need, and the targets with rows counted among their values."""
    shown = export.shown
    used = np.zeros((len(export.centres) if shown is None else shown.faces.count) + 1, bool)
    for target in targets:
        used[target.point_rows] = True
    used = used[:-1]
    renumbered = np.append(np.where(used, np.cumsum(used) - 1, -1), -1)
    moved = [replace(target, point_rows=renumbered[target.point_rows]) for target in targets]
    rows, fit, kept = np.flatnonzero(used), None, np.zeros(0, np.int64)
    numbers = np.arange(len(rows))
    if shown is not None:
        faces, kept = shown.faces.of_values(used)
        places, rows = shown.places.on(kept)
        fit, numbers = VertexFit(faces, places), faces.values[places.triangle, 0]
    given = export.centres, export.normals, export.facing, export.inward, export.covered
    return moved, _Points(*(part[rows] for part in given), numbers, fit, kept)


def _values(points: _Points, result: BakeResult) -> _Values:
    """The values that ``result`` gives the colours."""
    # A covered face that is dark belongs to things that touch; one that has light stands back to back with another.
    hidden = result.hidden | (points.covered & unlit(result.irradiance))
    if points.fit is None:
        return _Values(result.irradiance, result.direct.value, result.indirect.value, ~hidden, result.open)
    seen = np.where(hidden, 0.0, result.open)
    fitted = points.fit.fitted(result.light, seen, result.direct)
    value, part = fitted.light.value, fitted.part
    return _Values(value, part, value - part, fitted.known, seen)


def _lossy_faces(export: ExportedScene, points: _Points, values: _Values, result: BakeResult) -> LossyFaces:
    """The faces that show light wrong with these ``values``."""
    if points.fit is None:
        return LossyFaces()
    owner, face = export.shown.owners[points.triangles], export.shown.corners[points.triangles]
    # Triangles stand in the order of their objects.
    objects, ends = objects_by_name(), np.searchsorted(owner, np.arange(len(export.targets) + 1))
    for number, target in enumerate(export.targets):
        mine, obj = slice(ends[number], ends[number + 1]), objects.get((target.object_name, target.library))
        if obj is not None and len(obj.data.loops) == len(target.point_rows):
            face[mine] = corner_faces(obj.data)[face[mine]]
    pairs, number = np.unique(np.stack([owner, face], axis=1), axis=0, return_inverse=True)
    losses = points.fit.losses(values.irradiance, result.light, values.open, number.ravel())
    names = [(target.object_name, target.library) for target in export.targets]
    return LossyFaces.of(names, pairs[:, 0], pairs[:, 1], losses.share, losses.area)


def _bake_steps(
    scene: bpy.types.Scene, export: ExportedScene, points: _Points, request: BakeRequest, start: float
) -> Iterator[Progress]:
    """The steps of the core's bake, the last of which has the result; ``start`` is when the job began."""
    surfaces, settings = export.scene, request.settings
    if request.quantity == "ambient-occlusion":
        surfaces, settings = ambient_occlusion(surfaces, settings)
    if settings.seconds is not None:
        # Writing takes about as long as reading did, and the core gets what is left between.
        reading = time.perf_counter() - start
        left = settings.seconds - reading - WRITING * len(points.centres)
        settings = replace(settings, seconds=max(left, LEAST_SECONDS))
    try:
        places = Points(points.centres, points.normals, points.inward, points.facing)
        result = yield from bake(surfaces, places, settings, points.fit)
    except NoLightError as error:
        raise NoLightError(why_no_light(scene, export.warnings) or str(error)) from None
    yield Progress("Writing the colours", 1.0, result)


def _job_progress(progress: Progress, found: BakeResult | None, passed: float, shown: bool) -> JobProgress:
    share = progress.fraction
    remaining = passed * (1 - share) / share if 0.01 < share < 1 else None
    error = None if found is None or not np.isfinite(found.relative_error) else found.relative_error
    return JobProgress(progress.phase, share, remaining, error, shown)


def _known_rows(target: BakeTarget, known: np.ndarray) -> np.ndarray:
    """The target's rows (C,) of values that are ``known`` (U,), -1 where none is, so that neighbours fill it."""
    rows = target.point_rows
    return np.where((rows >= 0) & np.append(known, False)[rows], rows, -1)


def _turned_away(targets: list[BakeTarget], scene: Scene, points: _Points, result: BakeResult) -> list[str]:
    """A sentence on the objects that are dark all over, but lit on the backs of their faces; none without any."""
    owners = np.full(max((target.point_rows.max(initial=-1) for target in targets), default=-1) + 2, -1)
    for number, target in enumerate(targets):
        owners[target.point_rows] = number
    owners = owners[:-1][points.shown]
    order = np.argsort(owners, kind="stable")
    starts = np.searchsorted(owners[order], np.arange(len(targets)))
    dark, names, asked = unlit(result.irradiance), [], []
    for target, own in zip(targets, np.split(order, starts)[1:], strict=True):
        if len(own) and dark[own].all() and len(names) < MOST_DARK:
            names.append(target.object_name)
            asked.append(own[:: -(-len(own) // DARK_POINTS)])
    if not names or dark.all():
        return []
    every = np.concatenate(asked)
    asked_at = (part[every] for part in (points.centres, points.normals, points.facing, points.inward))
    behind = lit_behind(scene, *asked_at)
    usual = np.median(np.abs(result.irradiance[~dark]).sum(axis=1))
    lit = [part.mean() > LIT_BEHIND * usual for part in np.split(behind, np.cumsum([len(own) for own in asked])[:-1])]
    names = [name for name, is_lit in zip(names, lit, strict=True) if is_lit]
    return [turned_away(names)] if names else []


def _colours(
    targets: list[BakeTarget], light: _Values, request: BakeRequest, look_scale: float | None
) -> tuple[list[MeshColours], list[str]]:
    """The colours of each target's elements, and a warning for each target that changed during the bake.

    A ``look_scale`` of None fits the look to the light that surfaces reflect.
    """
    colours, gone, objects, reflected = [], [], objects_by_name(), []
    parts = light.irradiance, light.direct, light.indirect
    for target in targets:
        obj = objects.get((target.object_name, target.library))
        if obj is None or obj.type != "MESH" or element_count(obj.data, request.domain) != len(target.albedo):
            gone.append(f"'{target.object_name}' was changed during the bake, so its colours were not written.")
            continue
        refusal = _obstacle(obj, request)
        if refusal is not None:
            gone.append(str(refusal))
            continue
        faces, layers, look = faces_of(obj.data, request.domain), {}, None
        for name, irradiance in zip(request.attributes, parts, strict=False):
            # What a surface emits is part of its direct light, and of the whole.
            emission = np.zeros_like(target.emission) if irradiance is parts[2] else target.emission
            values = spread(irradiance, _known_rows(target, light.known), faces)
            layers[name] = quantity_values(request.quantity, values, target.albedo, emission)
            if irradiance is parts[0] and _looks(request, obj):
                reflected.append(quantity_values("shaded", values, target.albedo, np.zeros_like(target.emission)))
                look = reflected[-1] + target.emission
        colours.append(MeshColours(obj, layers, look=look))
    if not colours:
        raise UnwritableFileError("Every object was changed during the bake, so no colours were written: bake again.")
    if reflected:
        scale = look_scale or fitted_scale(reflected)
        colours = [replace(entry, look=np.clip(entry.look * scale, 0, 1), look_scale=scale) for entry in colours]
    return colours, gone


def _looks(request: BakeRequest, obj: bpy.types.Object) -> bool:
    """Whether a layer for the look is wanted, and shows more than the light itself and the object's materials."""
    useful = request.look and request.activate and request.quantity in ("lighting", "irradiance")
    return useful and not any(True for _ in materials_with_light([obj]))


def _doubts(
    result: BakeResult, settings: BakeSettings, stopped: bool, scene: bpy.types.Scene, surfaces: Scene
) -> list[str]:
    """What in the result itself the user should know."""
    doubts = []
    aim = settings.aimed_noise
    # Points that are known exactly hide no others.
    short = aim is not None and result.seen.unsure_error > aim * (1 + 1e-9)
    if stopped:
        doubts.append("The bake was stopped before its end, and what it had found was kept.")
    elif short:
        remedy = "ask for it by its number, to bake on" if settings.error is None else "allow a larger radius"
        doubts.append(
            f"The error of {settings.target_error:.1%} that was aimed at was not reached with "
            f"{counted(result.photons, 'photon')}: {remedy}, or choose a larger error."
        )
    if result.coarse.any():
        doubts.append(
            f"{counted(int(result.coarse.sum()), 'point')} of {len(result.coarse)} lie on faces so small, and so far "
            f"from most of what is baked, that rounding tells in their light: bake them alone, or move them nearer."
        )
    if not result.irradiance.any():
        doubts.append(why_dark(scene, surfaces.corners, result.photons))
    emitted = np.abs(result.emitted_flux).sum()
    cut = np.abs(result.cut_flux).sum()
    if cut > HARMLESS_CUT * emitted:
        doubts.append(
            f"The limit on bounces cut off light worth {cut / emitted:.1%} of what the lights emit: "
            f"allow more bounces, or use darker materials where the albedo is close to 1."
        )
    return doubts
