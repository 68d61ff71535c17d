"""A scene made ready for a comparison with Cycles: the objects that both can bake, and the corners to compare."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import bpy
import numpy as np

from ...core.bake import bake
from ...core.errors import NoMeshError
from ...core.estimator.enclosure import unlit
from ...core.settings import BakeSettings
from ...core.stages import finished
from ..reading.read_scene import BakeTarget, read_scene
from ..wording import counted
from ..writing.baked_layers import colour_layers
from .cycles_bake import set_up_cycles
from .face_copies import CopiedFaces, centred, give_light_attribute, render_faces

#: particles of the bake that tells which corners are hidden
FEW_PHOTONS = 1 << 16


@dataclass(frozen=True)
class ComparedScene:
    """What is baked and where it is compared; C is the number of all objects' face corners, one after the other.

    objects   names of the mesh objects that both can bake; ``faces`` theirs as a render sees them, joined
    first     (O,) the first corner of each object
    chosen    (M,) the corners that are compared; ``hidden`` (M,) those of them that a bake fills from neighbours
    radius    of the automatic discs with few photons; ``scene_radius`` around everything, metres
    warnings  one sentence each
    """

    objects: tuple[str, ...]
    faces: CopiedFaces
    first: np.ndarray
    chosen: np.ndarray
    hidden: np.ndarray
    radius: float
    scene_radius: float
    warnings: tuple[str, ...]

    @property
    def blender_objects(self) -> list[bpy.types.Object]:
        """The objects in Blender."""
        return [bpy.data.objects[name] for name in self.objects]

    def at_chosen(self, light: dict[str, np.ndarray]) -> np.ndarray:
        """The RGB sum (M,) at the chosen corners of ``light`` by object, NaN where an object has none."""
        sizes = np.diff(np.append(self.first, len(self.faces.corners)))
        parts = [
            light[name].sum(axis=1) if name in light else np.full(size, np.nan)
            for name, size in zip(self.objects, sizes, strict=True)
        ]
        return np.concatenate(parts)[self.chosen]


def compared_scene(corners: int) -> Generator[str, None, ComparedScene]:
    """Make the open scene ready for Cycles and for us, and choose about that many ``corners`` of it, by whole faces.

    Meshes that objects share become each one's own, and what lies far away moves to the origin. Yields sentences.
    Raises NoMeshError when there is nothing that both can bake, and what reading and baking raise.
    """
    scene, layer = bpy.context.scene, bpy.context.view_layer
    yield "Reading the scene"
    set_up_cycles(scene)
    targets = read_scene(scene, layer, None, "CORNER").targets
    rendered = render_faces(scene, layer, [target.object_name for target in targets if target.library is None])
    reasons = {target.object_name: _unfit(target, layer, rendered) for target in targets}
    names = [name for name, reason in reasons.items() if reason is None]
    if not names:
        why = "; ".join(f"'{name}' {reason}" for name, reason in list(reasons.items())[:3])
        raise NoMeshError(f"There is no mesh that Cycles too can bake into vertex colours: {why}.")
    for mesh in bpy.data.meshes:
        if mesh.library is None:  # Cycles would take the light of an earlier bake for paint
            mesh.attributes.default_color_name = colour_layers(mesh).paint
    for name in names:
        obj = bpy.data.objects[name]
        if obj.data.users > 1:
            obj.data = obj.data.copy()
        give_light_attribute(obj.data)
    faces, radius = centred(scene, {name: rendered[name] for name in names})
    joined = CopiedFaces.joined(list(faces.values()))
    sizes = [len(part.corners) for part in faces.values()]
    chosen = _chosen(joined, corners)
    yield f"Looking for hidden corners among {counted(len(joined.corners), 'corner')}"
    hidden, disc = _hidden(scene, layer, names)
    return ComparedScene(
        tuple(names), joined, np.cumsum([0, *sizes[:-1]]), chosen, hidden[chosen], disc, radius,
        tuple(_left_out(reasons)),
    )  # fmt: skip


def _unfit(target: BakeTarget, layer: bpy.types.ViewLayer, rendered: dict[str, CopiedFaces]) -> str | None:
    """Why Cycles cannot bake this object into colours that compare with ours, or None when it can."""
    obj = bpy.data.objects.get((target.object_name, target.library))
    if target.library or obj.library or obj.data.library or obj.override_library or obj.data.override_library:
        return "is linked from a library"
    if not obj.visible_get(view_layer=layer):
        return "is hidden in the viewport, so it cannot be selected"
    if obj.data.is_editmode:
        return "is open in Edit Mode"
    count = len(rendered[target.object_name].corners)
    if count != len(obj.data.loops):
        return "has modifiers that change its faces"
    return None if count else "has no faces"


def _left_out(reasons: dict[str, str | None], shown: int = 3) -> list[str]:
    """A sentence for each reason, with the objects that have it."""
    sentences = []
    for reason in dict.fromkeys(filter(None, reasons.values())):
        names = [f"'{name}'" for name, why in reasons.items() if why == reason]
        more = f" and {counted(len(names) - shown, 'more object')}" if len(names) > shown else ""
        sentences.append(f"Cycles' bake cannot be compared, so these are left out: {', '.join(names[:shown])}{more}, "
                         f"of which each {reason}.")  # fmt: skip
    return sentences


def _chosen(faces: CopiedFaces, corners: int) -> np.ndarray:
    """About that many ``corners``, by whole faces at random, in ascending order."""
    order = np.random.default_rng(0).permutation(len(faces.sizes))
    enough = int(np.searchsorted(np.cumsum(faces.sizes[order]), corners)) + 1
    taken = np.zeros(len(order), bool)
    taken[order[:enough]] = True
    return np.flatnonzero(taken[faces.face])


def _hidden(scene, layer, names: list[str]) -> tuple[np.ndarray, float]:
    """Whether (C,) a bake would fill each corner from its neighbours, and the radius of its discs."""
    export = read_scene(scene, layer, [bpy.data.objects[name] for name in names], "CORNER")
    settings = BakeSettings("draft", photons=FEW_PHOTONS)
    steps = bake(export.scene, export.points, settings)
    result = finished(steps)
    hidden = result.hidden | (export.covered & unlit(result.irradiance))
    rows = {target.object_name: target.point_rows for target in export.targets}
    at = np.concatenate([rows[name] for name in names])
    return (at < 0) | hidden[at], result.radius
