"""Walks through everything that a render shows: meshes with their instances, lamps and the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import bpy
import numpy as np

from ...core.lights.light import Light
from ...core.memory import check_reading
from ..units import metres_per_unit
from ..writing.baked_layers import NO_LAYERS, ColourLayers, baked_names, colour_layers
from ..writing.modifiers import repeats
from .estimation_points import CornerPoints, PlacedMesh, place_points
from .findings import Findings
from .joined_rows import any_of, starts_of
from .placed_triangles import Placement
from .placed_values import InstanceAttributes, Standing
from .read_lights import read_light
from .read_materials import Materials
from .read_meshes import MeshSurface, read_mesh, rendered_mesh, respond, with_area
from .read_world import note_world, world_colour
from .render_settings import note_object, note_scene
from .response import Optics

#: kinds of objects that a render shows and that give no mesh
_NO_MESH = {
    "CURVES": "hair curves",
    "POINTCLOUD": "point cloud",
    "VOLUME": "volume",
    "GREASEPENCIL": "Grease Pencil object",
    "GPENCIL": "Grease Pencil object",
}


@dataclass(frozen=True)
class TargetPoints:
    """The estimation points of one mesh object, whose evaluated mesh is the surface of that row."""

    object_name: str
    library: str | None
    mesh_name: str
    vertex_count: int
    surface: int
    points: CornerPoints


@dataclass
class RenderedObjects:
    """What a render shows.

    surfaces    each evaluated mesh once, or as often as it looks different
    optics      what the triangles of all surfaces, one after the other, do to light
    shines      (of each surface) whether it gives light
    placements  where they stand
    targets     the objects to bake; editing: the names of those that would be, were they not open in Edit Mode
    scattered   the names of those that show instances which geometry nodes make, and may have no faces of their own
    faceless    the names of those whose faces modifiers make, of edges alone
    lights      lamps, and lamps: (object, light group) of each by name, "" for no group
    radiance    (3,) of a world of one colour, None when ``world`` must be looked at
    """

    surfaces: list[MeshSurface] = field(default_factory=list)
    optics: Optics | None = None
    shines: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    placements: list[Placement] = field(default_factory=list)
    targets: list[TargetPoints] = field(default_factory=list)
    editing: list[str] = field(default_factory=list)
    scattered: dict[str, None] = field(default_factory=dict)
    faceless: list[str] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    lamps: list[tuple[str, str]] = field(default_factory=list)
    radiance: np.ndarray | None = None
    world: bpy.types.World | None = None


def read_instances(depsgraph, wanted: set | None, findings: Findings, written: Sequence[str] = ()) -> RenderedObjects:
    """Read all objects of an evaluated scene; ``wanted`` are the original objects to bake, None for all meshes.

    The attributes ``written`` are about to be overwritten.
    """
    layer = depsgraph.view_layer_eval
    world = getattr(layer, "world_override", None) or depsgraph.scene_eval.world
    read = RenderedObjects(
        radiance=world_colour(world, layer, findings), world=world.original if world is not None else None
    )
    materials, attributes = Materials(findings), InstanceAttributes(findings)
    lit, metres = baked_names(), metres_per_unit(depsgraph.scene)
    known: dict[tuple, tuple[MeshSurface, int | None]] = {}
    targets: list[PlacedMesh] = []
    placed: dict[bpy.types.Object, int | None] = {}
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type in _NO_MESH:
            findings.left_out("{}", _NO_MESH[obj.type], obj.name)
        if obj.type not in ("MESH", "LIGHT") or not instance.show_self:
            continue
        diffuse, shadow = _seen(instance, findings)
        if not (diffuse or (shadow and obj.type == "MESH")):
            continue
        placed[obj.original] = None
        matrix = np.array([tuple(row) for row in instance.matrix_world])
        matrix[:3] *= metres
        if obj.type == "LIGHT":
            _add_light(read, instance, matrix, metres, findings, Standing.of(instance, depsgraph, attributes).own)
            continue
        slots = [layer.material_override] * bool(layer.material_override) or _slots(obj)
        key = (obj.data.as_pointer(), *(slot.as_pointer() if slot else 0 for slot in slots))
        if key not in known:
            layers = partial(_layers, obj.original, written, lit)
            with rendered_mesh(obj) as mesh:
                surface = read_mesh(mesh, slots, materials, layers, findings, obj.name, bool(obj.modifiers))
            known[key] = surface, None
            if not surface.placed_needs:
                known[key] = surface, len(read.surfaces)
                read.surfaces.append(surface)
        surface, row = known[key]
        if row is None:
            row = len(read.surfaces)
            read.surfaces.append(surface.placed(Standing.of(instance, depsgraph, attributes)))
        placed[obj.original] = row
        if _add_mesh(read, instance, Placement(row, matrix, diffuse, shadow, _lightgroup(instance)), wanted, findings):
            targets.append(PlacedMesh(obj.original, obj.data, row, matrix))
    corners = sum(len(target.object.data.loops) for target in targets)
    triangles = [len(surface.triangles) for surface in read.surfaces]
    check_reading(sum(triangles[placement.surface] for placement in read.placements), sum(triangles), corners)
    read.surfaces = with_area(read.surfaces)
    _add_targets(read, targets, findings)
    read.optics = respond(read.surfaces, materials)
    read.shines = any_of(read.optics.shines, starts_of(triangles))
    mirrors = bool(read.optics.front.mirror.any() or read.optics.front.clear.any())
    for obj, row in placed.items():
        note_object(obj, row is not None and bool(read.shines[row]), mirrors, findings)
    if mirrors:
        materials.note_mirrors()
    note_world(world, mirrors, findings)
    note_scene(depsgraph.scene, layer, world, mirrors, findings)
    return read


def _layers(original, written: Sequence[str], lit: frozenset[str]) -> ColourLayers:
    return colour_layers(original.data, written, lit) if original.type == "MESH" else NO_LAYERS


def _seen(instance, findings: Findings) -> tuple[bool, bool]:
    """Whether diffuse rays meet the object, and whether shadow rays do; an instance is met as its instancer allows."""
    obj = instance.object
    owners = [obj, instance.parent] if instance.is_instance and instance.parent is not None else [obj]
    diffuse, shadow = all(owner.visible_diffuse for owner in owners), all(owner.visible_shadow for owner in owners)
    if not diffuse and not (shadow and obj.type == "MESH"):
        findings.left_out("{}, hidden from diffuse light", "object", obj.name)
    elif obj.type == "MESH" and not (diffuse and shadow):
        hidden = "shadow rays" if diffuse else "diffuse rays"
        findings.modelled(f"{{}} hidden from {hidden}", "object", obj.name)
    return diffuse, shadow


def _slots(obj) -> list:
    """The materials (None where empty) of an evaluated object, or of the mesh that geometry nodes instance for it."""
    slots = list(obj.material_slots)
    meshes = list(obj.data.materials)
    return [
        slots[row].material if row < len(slots) and (slots[row].link == "OBJECT" or row >= len(meshes)) else meshes[row]
        for row in range(max(len(slots), len(meshes)))
    ]


def _lightgroup(instance) -> str:
    """The light group of an instance's object, or else of what instances it, as in Cycles; "" for none."""
    parent = instance.parent if instance.is_instance else None
    return instance.object.lightgroup or (parent.lightgroup if parent is not None else "")


def _add_light(read: RenderedObjects, instance, matrix: np.ndarray, metres: float, findings: Findings, own) -> None:
    obj = instance.object
    light = read_light(obj, matrix, metres, findings, own)
    if light is not None:
        # The running number keeps instances of one lamp apart.
        findings.modelled("{}", f"{obj.data.type.lower()} light", str(len(read.lights)))
        read.lights.append(light)
        read.lamps.append((obj.original.name, _lightgroup(instance)))


def _add_mesh(read: RenderedObjects, instance, placement: Placement, wanted, findings) -> bool:
    """Add the ``placement`` of an instance; returns whether its object is to be baked."""
    obj = instance.object
    original = obj.original
    if not np.isfinite(placement.matrix).all():
        findings.warn("objects whose place is not a number are left out: {}", "object", obj.name)
        return False
    read.placements.append(placement)
    if instance.is_instance:
        # Curves and texts come as instances of themselves.
        if instance.parent is not None and instance.parent.original != original:
            findings.modelled("{}", "instance", str(len(read.placements)))
            findings.left_out("light of their own on instances of {}", "object", original.name)
        elif original.type != "MESH":
            findings.left_out("colours on {} that are not meshes but block and reflect light", "object", original.name)
        else:
            read.scattered[original.name] = None
        return False
    if any(system.settings.type == "HAIR" and system.settings.render_type == "PATH" for system in obj.particle_systems):
        findings.left_out("hair of {}", "object", obj.name)
    if original.type != "MESH" or (wanted is not None and original not in wanted):
        return False
    if original.data.is_editmode:
        read.editing.append(original.name)
        findings.warn("{} open in Edit Mode cannot be baked", "object", obj.name)
        return False
    return True


def _add_targets(read: RenderedObjects, targets: list[PlacedMesh], findings: Findings) -> None:
    """Add the objects to bake, with the points of those that a render shows any face of."""
    for target, points in zip(targets, place_points(targets, read.surfaces), strict=True):
        original = target.object
        if original.name in read.scattered:
            findings.left_out("light on instances that geometry nodes make of {} (Realize Instances makes them faces)",
                              "object", original.name)  # fmt: skip
            if len(points.centres) == 0:
                continue
        if len(points.centres) == 0:
            if len(read.surfaces[target.surface].triangles):
                read.faceless.append(original.name)
                findings.warn("there is no light to bake on {}, whose faces modifiers make: apply them (on the command "
                              "line --apply-modifiers)", "object", original.name)  # fmt: skip
            else:
                findings.warn("there is no light to bake on {}, of which a render shows no face", "object",
                              original.name)  # fmt: skip
            continue
        for sentence in repeats(original) if points.nearest else ():
            remedy = "apply modifiers (on the command line --apply-modifiers) for light of its own"
            findings.warn(f"{sentence}, on {{}}: {remedy}", "object", original.name)
        if points.nearest:
            findings.warn(
                "light is taken from the nearest point of the surface after modifiers for {}", "object", original.name
            )
        library, mesh = original.library.filepath if original.library else None, original.data
        read.targets.append(TargetPoints(original.name, library, mesh.name, len(mesh.vertices), target.surface, points))
