"""One random broken scene from one seed."""

from __future__ import annotations

import tempfile
from pathlib import Path

import bpy
from fuzz.chance import REFUSALS, Chance, put
from fuzz.lights import odd_light, odd_world
from fuzz.materials import odd_material
from fuzz.meshes import broken_mesh
from fuzz.modifiers import add_modifiers
from fuzz.objects import instanced, other_object, parented, place, shape_keys


def make_scene(chance: Chance, attribute: str) -> None:
    """Replace what is open in Blender by a random scene; ``attribute`` is the name that the bake will use."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.name = chance.one_of("Scene", "Szene ü", "s" * 60)
    scene.world = odd_world(chance)
    materials = [odd_material(chance) for _ in range(chance.count(0, 4))]
    meshes = _mesh_objects(chance, attribute, materials)
    objects = [*meshes]
    for _ in range(chance.count(0, 2)):
        other = other_object(chance) if chance.likely(0.5) else None
        if other is not None:
            objects.append(other)
            if materials and hasattr(other.data, "materials"):
                other.data.materials.append(chance.one_of(*materials))
    for _ in range(chance.one_of(0, 1, 1, 1, 2, 2, 4)):
        objects.append(bpy.data.objects.new("lamp", odd_light(chance)))
    _spread_over_collections(chance, scene, objects)
    for obj in objects:
        place(chance, obj)
    for obj in meshes:
        if chance.likely(0.35):
            add_modifiers(chance, obj, objects)
        if chance.likely(0.08) and obj.data.users == 1:
            shape_keys(chance, obj)
    parented(chance, objects, scene)
    instanced(chance, objects, scene)
    if chance.likely(0.06):
        _linked_from_library(chance, scene, meshes)
    for obj in objects:
        _visibility(chance, obj)
    _scene_settings(chance, scene, objects, materials)


def _mesh_objects(chance: Chance, attribute: str, materials: list) -> list:
    made = []
    for _ in range(chance.one_of(1, 1, 2, 2, 3, 4, 8, 25) if chance.likely(0.98) else 0):
        shared = made and chance.likely(0.15)
        mesh = chance.one_of(*made).data if shared else broken_mesh(chance, attribute)
        obj = bpy.data.objects.new(chance.one_of("object", "Objekt ß", "o" * 60), mesh)
        if not shared:
            for _ in range(chance.count(0, 3) if materials else 0):
                mesh.materials.append(chance.one_of(*materials))
        for slot in obj.material_slots:
            if chance.likely(0.15):
                slot.link = "OBJECT"
                slot.material = chance.one_of(*materials)
        if chance.likely(0.2):
            group = obj.vertex_groups.new(name=chance.one_of("group", "group", attribute))
            if len(mesh.vertices):
                group.add([0], chance.between(0, 1), "REPLACE")
        made.append(obj)
    return made


def _spread_over_collections(chance: Chance, scene, objects: list) -> None:
    collections = [scene.collection]
    for number in range(chance.one_of(0, 0, 1, 2)):
        collection = bpy.data.collections.new(f"collection {number}")
        chance.one_of(*collections).children.link(collection)
        put(collection, "hide_render", chance.likely(0.1))
        put(collection, "hide_viewport", chance.likely(0.1))
        collections.append(collection)
    for obj in objects:
        chance.one_of(*collections).objects.link(obj)
    for child in bpy.context.view_layer.layer_collection.children:
        for name in ("exclude", "holdout", "indirect_only", "hide_viewport"):
            put(child, name, chance.likely(0.06))


def _visibility(chance: Chance, obj) -> None:
    for name in ("hide_render", "hide_viewport", "is_holdout", "is_shadow_catcher"):
        put(obj, name, chance.likely(0.04))
    for name in ("visible_diffuse", "visible_shadow", "visible_camera"):
        put(obj, name, chance.likely(0.95))
    for name in ("hide_set", "select_set"):
        try:
            getattr(obj, name)(chance.likely(0.05 if name == "hide_set" else 0.7))
        except REFUSALS:
            continue


def _linked_from_library(chance: Chance, scene, meshes: list) -> None:
    """Some objects from another file, which may be gone by the time it matters."""
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "library.blend")
        chosen = chance.some_of(meshes, 2)
        bpy.data.libraries.write(path, set(chosen))
        with bpy.data.libraries.load(path, link=True) as (there, here):
            here.objects = list(there.objects)
        for obj in here.objects:
            if obj is not None:
                scene.collection.objects.link(obj)
                if chance.likely(0.3):
                    obj.override_create()


def _scene_settings(chance: Chance, scene, objects: list, materials: list) -> None:
    if chance.likely(0.3):
        scene.unit_settings.scale_length = chance.one_of(0.001, 100.0, 1e-9)
    if chance.likely(0.1):
        put(scene, "frame_current", chance.one_of(-100, 0, 1048574))
    cameras = [obj for obj in objects if obj.type == "CAMERA"]
    scene.camera = chance.one_of(None, *cameras, *(objects if chance.likely(0.1) else []))
    layer = bpy.context.view_layer
    put(layer, "use_sky", chance.likely(0.95))
    if chance.likely(0.04) and materials:
        layer.material_override = chance.one_of(*materials)
    if chance.likely(0.1):
        scene.view_layers.new("second")
    put(scene.render, "engine", chance.one_of("CYCLES", "BLENDER_EEVEE", "BLENDER_EEVEE_NEXT", "BLENDER_WORKBENCH"))
    editable = [obj for obj in objects if obj.type == "MESH" and obj.visible_get()]
    if editable and chance.likely(0.05):
        layer.objects.active = chance.one_of(*editable)
        try:
            bpy.ops.object.mode_set(mode=chance.one_of("EDIT", "SCULPT", "VERTEX_PAINT", "WEIGHT_PAINT"))
        except REFUSALS:
            return
