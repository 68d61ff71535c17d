"""Reads a Blender scene as a render sees it: triangles, lights, and the points where light is wanted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import bpy
import numpy as np

from ...core.errors import EditModeError, NoMeshError
from ...core.lights.environment import EnvironmentWorld
from ...core.lights.light import Light
from ...core.lights.world import UniformWorld
from ...core.scene import Scene
from .findings import Findings
from .read_instances import RenderedObjects, TargetPoints, read_instances
from .read_shaders import DEFAULT_ALBEDO
from .read_specular import joined_specular, specular_part
from .render_settings import note_reflections
from .render_view import view_as_render
from .settled_corners import SettledPoints, settled_points
from .triangle_geometry import determinant, has_area
from .world_picture import world_lights

#: an object whose volume scales by less than this share of its largest scale cubed may have lost triangles
_FLAT = 1e-6


@dataclass(frozen=True)
class BakeTarget:
    """One mesh object to bake, by names, since Blender's own objects may go while a bake runs.

    library     path of the library file the object is linked from, None for the file's own
    domain      CORNER or POINT; E is the number of those elements of the mesh before modifiers, C that of its corners
    point_rows  (C,) the estimation point of each face corner, -1 for none
    albedo      (E, 3) and emission (E, 3) in W/(m^2 sr) of the surface there
    """

    object_name: str
    library: str | None
    mesh_name: str
    domain: str
    point_rows: np.ndarray
    albedo: np.ndarray
    emission: np.ndarray


@dataclass(frozen=True)
class ExportedScene:
    """What was read: the core's scene, what to bake, and what a person should know.

    centres    (N, 3) metres and normals (N, 3) unit: the estimation points of all targets
    inward     (N, 3) metres, from each point into its own faces
    covered    (N,) whether another face lies against that of the point (see settled_corners.py)
    modelled   features that were found and are honoured; left_out: those that are not; warnings: one sentence each
    objects    mesh objects and instances in the scene; triangles; lights: lamps, the world, and objects that shine
    """

    scene: Scene
    targets: tuple[BakeTarget, ...]
    centres: np.ndarray
    normals: np.ndarray
    inward: np.ndarray
    covered: np.ndarray
    modelled: tuple[str, ...]
    left_out: tuple[str, ...]
    warnings: tuple[str, ...]
    objects: int
    triangles: int
    lights: int


def read_scene(
    context_scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    targets: list[bpy.types.Object] | None,
    domain: str,
    written: Sequence[str] = (),
) -> ExportedScene:
    """Read ``context_scene`` as a render of ``view_layer`` sees it now.

    ``targets`` are the objects to bake, None for every mesh object that the render shows; ``domain`` is CORNER or
    POINT. The colours of the attributes ``written`` and of earlier bakes are not looked at. Blender's data are
    afterwards as they were.

    Raises NoMeshError when nothing can be baked, EditModeError when all that could is open in Edit Mode, SceneBusyError
    while Blender renders, and InvalidArrayError on numbers that are out of range.
    """
    findings = Findings()
    wanted = None if targets is None else _bakeable(targets, findings)
    visit = partial(read_instances, wanted=wanted, findings=findings, written=written)
    read = view_as_render(context_scene, view_layer, visit)
    scene = _scene(read, _world_light(read, context_scene, view_layer, findings), findings)
    baked, points = _targets(read, scene, domain)
    if targets is not None:
        _name_missing(wanted, {target.object_name for target in baked}, findings)
    if len(points.centres) == 0 and read.editing:
        names = ", ".join(f"'{name}'" for name in read.editing[:3])
        raise EditModeError(f"All meshes to bake are open in Edit Mode ({names}): leave Edit Mode and bake again.")
    if len(points.centres) == 0:
        raise NoMeshError("There is nothing to bake: choose mesh objects with faces that a render shows.")
    note_reflections(context_scene, scene.albedo, findings)
    modelled, left_out, warnings = findings.sentences()
    return ExportedScene(
        scene, baked, points.centres, points.normals, points.inward, points.covered, modelled, left_out, warnings,
        objects=len(read.placements), triangles=len(scene.triangles), lights=len(scene.lights) + _shining(read),
    )  # fmt: skip


def _shining(read: RenderedObjects) -> int:
    """How many objects give light by their materials."""
    shines = [optics.shines for optics in read.optics]
    return sum(shines[placement.surface] and placement.diffuse for placement in read.placements)


def _bakeable(targets: list[bpy.types.Object], findings: Findings) -> set[bpy.types.Object]:
    """The targets that are meshes."""
    for obj in targets:
        if obj.type != "MESH":
            findings.warn("only mesh objects can be baked, not {}", "object", obj.name)
    return {obj for obj in targets if obj.type == "MESH"}


def _name_missing(wanted: set[bpy.types.Object], baked: set[str], findings: Findings) -> None:
    for name in sorted(obj.name for obj in wanted if not obj.data.is_editmode):
        if name not in baked:
            findings.warn("there is no light to bake on {}, of which a render shows no face", "object", name)


def _world_light(read: RenderedObjects, context_scene, view_layer, findings: Findings) -> list[Light]:
    """The world as a light, none when it is black."""
    if read.radiance is not None:
        if not read.radiance.any():
            return []
        findings.modelled("a world of one colour")
        return [UniformWorld(read.radiance)]
    picture, suns = world_lights(read.world, context_scene.frame_current, findings.left_out)
    for sun in suns:
        findings.modelled(f"a sun of the world, {np.degrees(sun.angle):.2g} degrees wide, as a light of its own")
    if not picture.any():
        return suns
    height, width = picture.shape[:2]
    findings.modelled(f"the world's sky or image, as Cycles shows it in {width} x {height} pixels")
    return [*suns, EnvironmentWorld(picture)]


def _scene(read: RenderedObjects, world: list[Light], findings: Findings) -> Scene:
    """Everything in world space, without the triangles that have no area there."""
    vertices, triangles, kept, specular = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], [], []
    start = count = 0
    for placement in read.placements:
        surface, matrix = read.surfaces[placement.surface], placement.matrix
        optics = read.optics[placement.surface].seen_by(placement.diffuse, placement.shadow)
        placed = surface.vertices @ matrix[:3, :3].T + matrix[:3, 3]
        volume = determinant(matrix)
        keeps = surface.kept
        if abs(volume) <= _FLAT * np.abs(matrix[:3, :3]).max() ** 3:
            keeps = keeps & has_area(placed[surface.triangles])
        # A mirrored object turns its triangles inside out.
        order = [0, 1, 2] if volume >= 0.0 else [2, 1, 0]
        corners = surface.triangles[keeps][:, order]
        vertices.append(placed)
        triangles.append(corners + start)
        kept.append((optics, keeps))
        specular.append(specular_part(surface, optics.front, matrix, placed, keeps, order, count))
        start += len(placed)
        count += len(corners)

    def joined(name: str, first: int) -> np.ndarray:
        """By the views from the ``first`` on: (T, 3), or (2, T, 3) when any triangle's sides differ."""
        sides = [first, first + 1] if any(o.views[first] is not o.views[first + 1] for o, _ in kept) else [first]
        found = [
            np.concatenate([np.zeros((0, 3)), *(getattr(o.views[side], name)[keeps] for o, keeps in kept)])
            for side in sides
        ]
        return found[0] if len(found) == 1 else np.stack(found)

    by_rays = any(o.views[side] is not o.views[side + 2] for o, _ in kept for side in (0, 1))
    lights = (*read.lights, *world)
    if by_rays and world:
        sentence = "shadow rays to the world: what they pass otherwise than diffuse rays do, the world's light does not"
        findings.left_out(sentence)
    spread = joined("spread", 0)
    return Scene(
        np.concatenate(vertices), np.concatenate(triangles), joined("albedo", 0), joined("emission", 4),
        joined("transmittance", 0), lights, joined_specular(specular), joined("transmittance", 2) if by_rays else None,
        spread if spread.any() else None,
    )  # fmt: skip


def _targets(read: RenderedObjects, scene: Scene, domain: str) -> tuple[tuple[BakeTarget, ...], SettledPoints]:
    """The objects to bake, and the estimation points of all of them."""
    surfaces = [read.surfaces[target.surface] for target in read.targets]
    settled = settled_points([target.points for target in read.targets], surfaces, scene, domain)
    targets = []
    for target, rows in zip(read.targets, settled.rows, strict=True):
        optics = read.optics[target.surface]
        albedo = _element_means(target, optics.front.colour, DEFAULT_ALBEDO, domain)
        emission = _element_means(target, optics.emission, 0.0, domain)
        targets.append(BakeTarget(target.object_name, target.library, target.mesh_name, domain, rows, albedo, emission))
    return tuple(targets), settled


def _element_means(target: TargetPoints, values: np.ndarray, missing: float, domain: str) -> np.ndarray:
    """Mean (E, 3) of ``values`` (T, 3) over the triangles of each element, ``missing`` where it has none."""
    points = target.points
    elements, size = points.corners, len(points.rows)
    if domain == "POINT":
        elements, size = points.vertices[elements], target.vertex_count
    counts = np.bincount(elements, minlength=size)
    sums = [np.bincount(elements, values[points.triangles, channel], size) for channel in range(3)]
    means = np.stack(sums, axis=1) / np.maximum(counts, 1)[:, None]
    return np.where(counts[:, None] > 0, means, missing)
