"""The light of a scene at one moment, step by step, before anything is written: read the scene, bake it."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cached_property, partial, reduce
from operator import add

import bpy
import numpy as np

from ..core.bake import bake
from ..core.cluster.crew import crew_of
from ..core.direct.ambient_occlusion import ambient_occlusion
from ..core.errors import NoLightError, NoMeshError
from ..core.memory import check_baking
from ..core.points import Points
from ..core.result import BakeResult, Progress
from ..core.scene import Scene
from ..core.settings import BakeSettings
from .causes import why_no_light, why_nothing_to_bake
from .chosen_objects import chosen_objects
from .colours import colours_of, usual_scales, writable_targets
from .doubts import dark_in_front, doubts_of
from .mixing.light_groups import LightGroup, light_groups, lit_by
from .reading.read_scene import BakeTarget, ExportedScene, read_scene
from .report import BakeReport
from .request import BakeRequest
from .steps import JobProgress
from .updates.kept_bake import ALL, KeptBake
from .values import BakedPoints, LightValues, known_rows, lossy_faces, points_of, values_of
from .writing.encoding import encoded
from .writing.live_colours import LiveColours
from .writing.write_attributes import MeshColours

#: what a report has of a result as it is
AS_FOUND = "photons segments shadow_rays radius gatherer relative_error high_error".split()

#: seconds to write the colour of one point, and the least time that is left to the bake itself
WRITING, LEAST_SECONDS = 4e-6, 0.05


@dataclass(frozen=True)
class FoundLight:
    """The light of a scene at one moment, before anything is written.

    targets   what it is for, and points: where it was found
    groups    light groups that were baked apart, if any, and results: what was found of each, or of all light
    refusals  sentences on what was not baked; scales: what light and look of other meshes were multiplied by
    stopped   whether the user has ended it early
    exported  when the scene had been read (of time.perf_counter)
    """

    export: ExportedScene
    targets: list[BakeTarget]
    points: BakedPoints
    groups: list[LightGroup]
    results: list[BakeResult]
    refusals: list[str]
    scales: tuple[float | None, float | None]
    stopped: bool
    exported: float

    @cached_property
    def whole(self) -> BakeResult:
        """All light together."""
        return reduce(add, self.results)

    def colours(self, request: BakeRequest) -> tuple[LightValues, list[MeshColours], list[str]]:
        """The values of all light, the colours that they give, and sentences on what changed meanwhile."""
        parts = [values_of(self.points, result, self.whole) for result in self.results]
        values, groups = reduce(add, parts), list(zip(self.groups, parts, strict=False))
        return values, *colours_of(self.targets, values, request, self.scales[1], groups)

    def doubts(self, scene: bpy.types.Scene, request: BakeRequest) -> list[str]:
        """What in the light itself a user should know."""
        doubts = doubts_of(self.whole, request.settings, self.stopped, scene, self.export.scene)
        if request.quantity != "ambient-occlusion":
            doubts += dark_in_front(self.targets, self.export.scene, self.points, self.whole)
        return doubts

    def report(self, scene: bpy.types.Scene, values: LightValues, start: float) -> BakeReport:
        """What was found, in a job that began at ``start``, before anything is written or doubted."""
        result, surfaces = self.whole, self.export.scene
        return BakeReport(
            scene=scene.name,
            objects=len(self.targets),
            points=len(values.known),
            filled=sum(int((known_rows(target, values.known) < 0).sum()) for target in self.targets),
            triangles=len(surfaces.triangles),
            lights=self.export.lights,
            gatherer_reason=result.reason,
            seconds={
                "export": self.exported - start,
                "shadow": result.seconds["shadow"],
                "trace": result.seconds["radius"] + result.seconds["trace"],
                "gather": result.seconds["place"] + result.seconds["gather"],
            },
            **{name: getattr(result, name) for name in AS_FOUND},
            lossy_faces=lossy_faces(self.export, self.points, values, result),
            light_groups=tuple(group.name for group in self.groups),
            modelled=tuple(self.export.modelled),
            left_out=tuple(self.export.left_out),
        )


def found_light(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    request: BakeRequest,
    live: LiveColours | None,
    start: float,
    frame: int | None = None,
    kept: KeptBake | None = None,
) -> Generator[JobProgress, bool | None, FoundLight]:
    """Read the scene at a ``frame`` (None for now) and find its light, in a job that began at ``start``.

    It is kept as what is ``kept`` and can be updated then, or updates that.

    The rest is as for :func:`bake_scene`.
    """
    yield JobProgress("Reading the scene", 0.0)
    chosen = chosen_objects(scene, view_layer, request.targets)
    try:
        places = None if kept is None else kept.places
        given = request.domain, request.attributes, request.fit, frame, places
        with nullcontext() if kept is None else kept.recollection.used():
            export = read_scene(scene, view_layer, chosen, *given)
    except NoMeshError as error:
        raise NoMeshError(why_nothing_to_bake(scene, chosen) or str(error)) from None
    groups, notes = light_groups(view_layer, export, request.attribute) if request.by_light else ([], [])
    targets, refusals = writable_targets(export.targets, request, groups)
    targets, points = points_of(targets, export)
    if kept is None:
        check_baking(len(export.scene.triangles), len(points.centres))
    else:
        kept.read(export, len(points.centres))
    exported = time.perf_counter()

    scales, count = usual_scales(scene, targets, request), max(len(groups), 1)
    results, stopped = [], False
    with live or nullcontext():
        for number in range(count):
            surfaces = lit_by(export, groups[number]) if groups else export.scene
            settings = _settings_of(number, count, request.settings, start, len(points.centres))
            asked, found, baking = replace(request, settings=settings), None, None
            if kept is not None:
                baking = partial(kept.bake, groups[number].name if groups else ALL)
            for progress in _bake_steps(scene, export, surfaces, points, asked, baking):
                found = progress.found or found
                so_far = reduce(add, filter(None, (*results, found))) if results or found else None
                shown = progress.found is not None and live is not None and live.due
                if shown:
                    begin = time.perf_counter()
                    colours, _ = colours_of(targets, values_of(points, so_far), request, scales[1])
                    live.show(encoded(colours, request.encoding, request.quantity, scales[0])[0], begin)
                done = replace(progress, fraction=(number + progress.fraction) / count)
                wish = yield _job_progress(done, so_far, time.perf_counter() - exported, shown)
                stopped = stopped or bool(wish)
                if stopped and found is not None:
                    break
            results.append(found)
    return FoundLight(export, targets, points, groups, results, refusals + notes, scales, stopped, exported)


def _settings_of(number: int, count: int, settings: BakeSettings, start: float, points: int) -> BakeSettings:
    """The ``settings`` of a scene, for the group of that ``number`` of ``count``: its own noise, its share of time."""
    # Noise of groups that is independent adds up least.
    settings = replace(settings, seed=settings.seed + (number << 32))
    if settings.seconds is None:
        return settings
    # Writing takes about as long as reading did, and the core gets what is left between.
    left = settings.seconds - (time.perf_counter() - start) - WRITING * points * count
    return replace(settings, seconds=max(left / (count - number), LEAST_SECONDS))


def _bake_steps(
    scene: bpy.types.Scene,
    export: ExportedScene,
    surfaces: Scene,
    points: BakedPoints,
    request: BakeRequest,
    baking: Callable[..., Iterator[Progress]] | None,
) -> Iterator[Progress]:
    """The steps of the core's bake of ``surfaces``, lit by all or a part of the lights, or of another way of
    ``baking``; the last has the result."""
    settings = request.settings
    if request.quantity == "ambient-occlusion":
        surfaces, settings = ambient_occlusion(surfaces, settings)
    try:
        places = Points(points.centres, points.normals, points.inward, points.facing)
        given = surfaces, places, settings
        hired = crew_of(*given, request.cluster, request.beside)
        if baking is not None:
            result = yield from baking(*given, points.fit, hired)
        else:
            with hired as crew:
                result = yield from bake(*given, points.fit, crew)
    except NoLightError as error:
        raise NoLightError(why_no_light(scene, (*export.left_out, *export.warnings)) or str(error)) from None
    yield Progress("Writing the colours", 1.0, result)


def _job_progress(progress: Progress, found: BakeResult | None, passed: float, shown: bool) -> JobProgress:
    share = progress.fraction
    remaining = passed * (1 - share) / share if 0.01 < share < 1 else None
    error = None if found is None or not np.isfinite(found.relative_error) else found.relative_error
    return JobProgress(progress.phase, share, remaining, error, shown)
