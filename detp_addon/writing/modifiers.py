"""Modifiers that make more surface than there are colours for: words on what the rest shows, and applying them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ..animation.playback import is_playback
from ..reading.read_node_graph import trees_within
from ..reading.render_view import view_as_render
from ..wording import counted, some

#: what carries a mesh's colours to places of other light
REPEATS = {
    "ARRAY": "every copy that an Array makes shows the light of the first one",
    "MIRROR": "the half that Mirror makes shows the light of the one that is modelled",
    "SOLIDIFY": "both sides that Solidify makes show the light of one",
    "SCREW": "every turn that Screw makes shows the light of the first one",
    "PARTICLE_INSTANCE": "every copy on particles shows the light of one",
    "NODES": "what geometry nodes repeat shows the light of one",
    "SKIN": "the skin around an edge shows the light of one of its sides",
}

#: what leaves the faces as they are, or (a simulation) cannot be applied by giving an object its mesh
KEEPS_FACES = frozenset(
    "ARMATURE CAST CLOTH COLLISION CORRECTIVE_SMOOTH CURVE DATA_TRANSFER DISPLACE DYNAMIC_PAINT FLUID HOOK LATTICE "
    "LAPLACIANDEFORM LAPLACIANSMOOTH MESH_CACHE MESH_DEFORM MESH_SEQUENCE_CACHE NORMAL_EDIT PARTICLE_SYSTEM SHRINKWRAP "
    "SIMPLE_DEFORM SMOOTH SOFT_BODY SURFACE SURFACE_DEFORM UV_PROJECT UV_WARP VERTEX_WEIGHT_EDIT VERTEX_WEIGHT_MIX "
    "VERTEX_WEIGHT_PROXIMITY WARP WAVE WEIGHTED_NORMAL".split()
)

#: geometry nodes that do so, as those of *Smooth by Angle*, which Blender gives to files from before 4.1; groups have
#: nodes that are looked at themselves
NODES_KEEP_FACES = frozenset(
    f"GeometryNode{name}"
    for name in "CaptureAttribute MenuSwitch RemoveAttribute SetGeometryName SetID SetMaterial SetMaterialIndex "
    "SetMeshNormal SetPosition SetShadeSmooth StoreNamedAttribute Switch Group".split()
) | {"NodeReroute", "NodeGroupInput", "NodeGroupOutput"}


def repeats(obj: bpy.types.Object) -> list[str]:
    """Sentences on what the modifiers of an object repeat in a render."""
    kinds = dict.fromkeys(modifier.type for modifier in obj.modifiers if _changes_faces(modifier))
    return [REPEATS[kind] for kind in kinds if kind in REPEATS]


def apply_modifiers(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, objects: list[bpy.types.Object] | None
) -> list[str]:
    """Give the ``objects`` (None for all) the faces that a render of ``view_layer`` shows, and return notes on it.

    Applied are the modifiers up to the last that changes faces, in the file as it is open; those that only move or
    mark the result stay. An object that shows instances of its own is left alone: its mesh does not hold them.
    """
    chosen = {}
    for obj in scene.objects if objects is None else objects:
        last = max((row for row, each in enumerate(obj.modifiers) if _changes_faces(each)), default=-1)
        if obj.type == "MESH" and last >= 0 and not (obj.library or obj.data.library or obj.data.override_library):
            chosen[obj] = last
    if not chosen:
        return []
    with _only_those_up_to(chosen):
        meshes, scattering = view_as_render(scene, view_layer, lambda depsgraph: _render_meshes(depsgraph, set(chosen)))
    for obj, mesh in meshes.items():
        for key in obj.data.keys():
            mesh[key] = obj.data[key]
        shown = obj.data.attributes.active_color_name, obj.data.attributes.default_color_name
        mesh.name = obj.data.name
        obj.data = mesh
        mesh.attributes.active_color_name, mesh.attributes.default_color_name = shown
        for modifier in [each for each in obj.modifiers[: chosen[obj] + 1] if each.type != "PARTICLE_SYSTEM"]:
            obj.modifiers.remove(modifier)
    notes = []
    if meshes:
        notes.append(f"Modifiers of {_listed(meshes)} were applied, so that all that they make has light of its own.")
    if scattering:
        notes.append(f"Modifiers of {_listed(scattering)} were not applied, because they make instances.")
    return notes


def _changes_faces(modifier: bpy.types.Modifier) -> bool:
    if not modifier.show_render or modifier.type in KEEPS_FACES or is_playback(modifier):
        return False
    if modifier.type != "NODES":
        return True
    nodes = (node for tree in trees_within(modifier.node_group) for node in tree.nodes)
    makers = (node for node in nodes if node.bl_idname not in NODES_KEEP_FACES)
    return any(socket.type == "GEOMETRY" for node in makers for socket in node.outputs)


@contextmanager
def _only_those_up_to(last: dict[bpy.types.Object, int]) -> Iterator[None]:
    """Hide from renders the modifiers behind the ``last`` row of each object."""
    hidden = [each for obj, row in last.items() for each in obj.modifiers[row + 1 :] if each.show_render]
    for modifier in hidden:
        modifier.show_render = False
    try:
        yield
    finally:
        for modifier in hidden:
            modifier.show_render = True


def _render_meshes(depsgraph, wanted: set) -> tuple[dict, list]:
    """The meshes that a render shows of the ``wanted`` objects, and those of them that show instances instead."""
    shown, scattering = [], {}
    for instance in depsgraph.object_instances:
        owner = instance.parent if instance.is_instance else instance.object
        if owner is not None and owner.original in wanted:
            if not instance.is_instance:
                shown.append(owner.original)
            elif owner.original.instance_type == "NONE" and not owner.original.particle_systems:
                scattering[owner.original] = True
    meshes = {
        obj: bpy.data.meshes.new_from_object(
            obj.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph
        )
        for obj in shown
        if obj not in scattering
    }
    return meshes, list(scattering)


def _listed(objects) -> str:
    return f"{counted(len(objects), 'object')} ({some([obj.name for obj in objects])})"
