"""From values of light to the colours of each object, and what stands in their way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy
import numpy as np

from ..core.errors import DetpError, UnwritableFileError
from .chosen_objects import objects_by_name
from .materials.light_in_materials import materials_with_light
from .mixing.light_groups import LightGroup
from .reading.read_scene import BakeTarget
from .request import BakeRequest
from .values import LightValues, known_rows
from .wording import SHOWN_NAMES, counted
from .writing.baked_layers import group_mark, look_of
from .writing.element_values import quantity_values, spread
from .writing.encoding import fitted_scale, usual_scale
from .writing.write_attributes import MeshColours, element_count, faces_of, obstacle


def writable_targets(
    targets: tuple[BakeTarget, ...], request: BakeRequest, groups: Sequence[LightGroup] = ()
) -> tuple[list[BakeTarget], list[str]]:
    """The targets that can be written, and sentences on those that cannot; raises their error when none can.

    The light of each of the ``groups`` has a layer of its own.
    """
    writable, refusals, objects = [], {}, objects_by_name()
    for target in targets:
        refusal = _obstacle(objects[target.object_name, target.library], request, groups)
        if refusal is not None:
            refusals.setdefault(type(refusal), []).append(str(refusal))
        else:
            writable.append(target)
    sentences = []
    for alike in refusals.values():
        more = len(alike) - SHOWN_NAMES
        sentences += alike[:SHOWN_NAMES]
        sentences += [f"The same holds for {counted(more, 'more object')}."] if more > 0 else []
    if refusals and not writable:
        raise next(iter(refusals))(" ".join(sentences))
    return writable, sentences


def _obstacle(obj: bpy.types.Object, request: BakeRequest, groups: Sequence[LightGroup]) -> DetpError | None:
    """Why one of the attributes cannot be written, or None when all can."""
    names, kind = (*request.attributes, *(group.layer for group in groups)), request.encoding.type
    return next(filter(None, (obstacle(obj, name, request.domain, kind) for name in names)), None)


def usual_scales(
    scene: bpy.types.Scene, targets: list[BakeTarget], request: BakeRequest
) -> tuple[float | None, float | None]:
    """What light and look of the scene's other meshes were multiplied by: a part must be as bright as the rest."""
    if request.targets == "visible":
        return None, None
    objects = objects_by_name()
    written = [objects[each.object_name, each.library] for each in targets]
    return tuple(usual_scale(scene, name, written) for name in (request.attribute, look_of(request.attribute)))


def colours_of(
    targets: list[BakeTarget],
    light: LightValues,
    request: BakeRequest,
    look_scale: float | None,
    groups: Sequence[tuple[LightGroup, LightValues]] = (),
) -> tuple[list[MeshColours], list[str]]:
    """The colours of each target's elements, and a warning for each target that changed during the bake.

    A ``look_scale`` of None fits the look to the light that surfaces reflect. ``groups`` add up to ``light``.
    """
    colours, gone, objects, reflected = [], [], objects_by_name(), []
    for target in targets:
        obj = objects.get((target.object_name, target.library))
        if obj is None or obj.type != "MESH" or element_count(obj.data, request.domain) != len(target.albedo):
            gone.append(f"'{target.object_name}' was changed during the bake, so its colours were not written.")
            continue
        refusal = _obstacle(obj, request, [group for group, _ in groups])
        if refusal is not None:
            gone.append(str(refusal))
            continue
        faces, layers, look, rows = faces_of(obj.data, request.domain), {}, None, known_rows(target, light.known)
        glow, dark = target.emission, np.zeros_like(target.emission)
        # What a surface emits is part of its direct light, and of the whole.
        parts = [(light.irradiance, glow), (light.direct, glow), (light.indirect, dark)]
        shown = dict(zip(request.attributes, parts, strict=False))
        shown |= {g.layer: (part.irradiance, glow if obj.lightgroup in g.shining else dark) for g, part in groups}
        for name, (irradiance, emission) in shown.items():
            values = spread(irradiance, rows, faces)
            layers[name] = quantity_values(request.quantity, values, target.albedo, emission)
            if name == request.attribute and _looks(request, obj):
                reflected.append(quantity_values("shaded", values, target.albedo, dark))
                look = reflected[-1] + glow
        mixed_of = {group.layer: group_mark(group.name) for group, _ in groups}
        colours.append(MeshColours(obj, layers, look=look, groups=mixed_of))
    if not colours:
        raise UnwritableFileError("Every object was changed during the bake, so no colours were written: bake again.")
    if reflected:
        scale = look_scale or fitted_scale(reflected)
        colours = [replace(entry, look=np.clip(entry.look * scale, 0, 1), look_scale=scale) for entry in colours]
    return colours, gone


def _looks(request: BakeRequest, obj: bpy.types.Object) -> bool:
    """Whether a layer for the look is wanted, and shows more than the light itself and the object's materials."""
    useful = request.look and request.activate and request.quantity in ("lighting", "irradiance")
    # A mixture of light would not reach it.
    return useful and not request.by_light and not any(True for _ in materials_with_light([obj]))
