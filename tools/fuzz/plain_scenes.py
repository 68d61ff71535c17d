"""Scenes of sane numbers around a floor, as people build them, for holding their light against Cycles."""

from __future__ import annotations

import math

import bpy
import numpy as np
from fuzz.chance import Chance, put
from fuzz.lights import odd_light
from fuzz.meshes import BOX_FACES
from fuzz.node_graphs import COMMON, emptied_tree, random_graph

#: Nodes that a graph ends in, and those that single nodes are made of.
SHADERS = ("BsdfPrincipled", "BsdfDiffuse", "Emission", "MixShader", "AddShader", "BsdfTransparent", "BsdfTranslucent")


def plain_scene(chance: Chance) -> None:
    """Fill an empty file with a floor of 4 m, some things around it, lamps and a world."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    floor = _object("floor", _quad(2.0))
    floor.data.materials.append(_paint((0.6, 0.6, 0.6)))
    materials = [_material(chance) for _ in range(chance.count(1, 3))]
    for _ in range(chance.count(1, 4)):
        _thing(chance, chance.one_of(*materials))
    for _ in range(chance.count(0, 2)):
        lamp = bpy.data.objects.new("lamp", _lamp(chance))
        lamp.location = (chance.between(-1, 1), chance.between(-1, 1), chance.between(1.6, 3))
        lamp.rotation_euler = tuple(chance.between(-0.6, 0.6) for _ in range(3))
        _visibility(chance, lamp)
        scene.collection.objects.link(lamp)
    scene.world = _world(chance)
    bpy.context.view_layer.update()


def _lamp(chance: Chance) -> bpy.types.Light:
    lamp = odd_light(chance)
    put(lamp, "use_shadow", True)
    put(lamp, "energy", chance.between(1, 4) if lamp.type == "SUN" else chance.between(20, 200))
    put(lamp, "angle", chance.between(0, 0.5))
    for name in ("size", "size_y"):
        put(lamp, name, chance.between(0.2, 1.5))
    put(lamp, "spot_size", chance.between(0.5, 2.5))
    put(lamp, "shadow_soft_size", chance.one_of(0.0, 0.1, 0.3))
    return lamp


def _world(chance: Chance) -> bpy.types.World:
    world = bpy.data.worlds.new("world")
    tree = emptied_tree(world)
    output = tree.nodes.new("ShaderNodeOutputWorld")
    if chance.likely(0.25):
        random_graph(chance, tree, output)
        return world
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Strength"].default_value = chance.one_of(0.0, 0.3, 1.0)
    background.inputs["Color"].default_value = (*(chance.between(0, 1) for _ in range(3)), 1.0)
    if chance.likely(0.3):
        colour = tree.nodes.new(chance.one_of("ShaderNodeTexGradient", "ShaderNodeTexChecker", "ShaderNodeTexSky"))
        tree.links.new(colour.outputs[0], background.inputs["Color"])
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    if chance.likely(0.2):
        put(world.cycles_visibility, chance.one_of("camera", "diffuse", "glossy", "scatter"), False)
    return world


def _thing(chance: Chance, material: bpy.types.Material | None) -> None:
    """A roof, a wall, a box or a ball over the floor, with what people do to such things."""
    mesh = chance.one_of(_quad, _quad, _box, _ball)(chance.between(0.3, 1.2))
    mesh.materials.append(material)
    if chance.likely(0.3):
        mesh.materials.append(_material(chance))
        for face in mesh.polygons:
            face.material_index = chance.count(0, 1)
    if chance.likely(0.5):
        colours = mesh.color_attributes.new("Col", chance.one_of("FLOAT_COLOR", "BYTE_COLOR"), "CORNER")
        for entry in colours.data:
            entry.color = tuple(chance.between(0, 1) for _ in range(4))
    obj = _object("thing", mesh)
    obj.location = (chance.between(-1.2, 1.2), chance.between(-1.2, 1.2), chance.between(0.6, 1.4))
    obj.rotation_euler = tuple(chance.one_of(0.0, 0.0, math.pi / 2, math.pi, chance.between(-3, 3)) for _ in range(3))
    obj.scale = tuple(chance.one_of(1.0, 1.0, 0.5, -1.0) for _ in range(3))
    put(obj, "color", tuple(chance.between(0, 1) for _ in range(4)))
    put(obj, "pass_index", chance.count(0, 3))
    _visibility(chance, obj)
    for name in ("is_holdout", "is_shadow_catcher", "hide_render", "hide_viewport"):
        if chance.likely(0.04):
            put(obj, name, True)
    if chance.likely(0.2):
        obj.modifiers.new("modifier", chance.one_of("ARRAY", "MIRROR", "SUBSURF", "SOLIDIFY", "BEVEL", "TRIANGULATE"))
    if chance.likely(0.15):
        collection = bpy.data.collections.new("group")
        collection.objects.link(obj)
        bpy.context.scene.collection.objects.unlink(obj)
        instance = bpy.data.objects.new("instance", None)
        instance.instance_type, instance.instance_collection = "COLLECTION", collection
        instance.rotation_euler = (0, 0, chance.between(0, 3))
        bpy.context.scene.collection.objects.link(instance)


def _visibility(chance: Chance, obj: bpy.types.Object) -> None:
    for name in ("camera", "diffuse", "glossy", "transmission", "shadow"):
        if chance.likely(0.05):
            put(obj, f"visible_{name}", False)


def _material(chance: Chance) -> bpy.types.Material | None:
    """A material whose graph may have any node; none now and then."""
    if chance.likely(0.05):
        return None
    material = bpy.data.materials.new("material")
    tree = emptied_tree(material)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    if chance.likely(0.6):
        _shader(chance, tree, output)
    else:
        random_graph(chance, tree, output)
    put(material.cycles, "emission_sampling", chance.one_of("AUTO", "AUTO", "FRONT", "BACK", "NONE"))
    return material


def _shader(chance: Chance, tree, output) -> None:
    """A shader or a mix of two, of whose inputs any node may decide."""
    kind = chance.one_of(*SHADERS)
    shader = tree.nodes.new(f"ShaderNode{kind}")
    ends = [shader]
    if kind in ("MixShader", "AddShader"):
        ends = [
            tree.nodes.new(f"ShaderNode{chance.one_of('BsdfDiffuse', 'BsdfTransparent', 'Emission')}") for _ in "12"
        ]
        for end, socket in zip(ends, shader.inputs[-2:], strict=True):
            tree.links.new(end.outputs[0], socket)
    for node in dict.fromkeys((*ends, shader)):
        for socket in node.inputs:
            if socket.type == "RGBA":
                socket.default_value = (*(chance.between(0.1, 0.9) for _ in range(3)), 1.0)
            if socket.type in ("RGBA", "VALUE") and chance.likely(0.4 if socket.type == "RGBA" else 0.15):
                _decide(chance, tree, socket)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])


def _decide(chance: Chance, tree, socket) -> None:
    """Let some node decide an input."""
    known = [name for name in dir(bpy.types) if name.startswith("ShaderNode")]
    name = f"ShaderNode{chance.one_of(*COMMON)}" if chance.likely(0.5) else chance.one_of(*known)
    try:
        outputs = [out for out in tree.nodes.new(name).outputs if out.type != "SHADER" and out.enabled]
    except RuntimeError:
        return
    if outputs:
        tree.links.new(chance.one_of(*outputs), socket)


def _paint(colour) -> bpy.types.Material:
    material = bpy.data.materials.new("paint")
    tree = emptied_tree(material)
    shader, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    shader.inputs[0].default_value = (*colour, 1.0)
    tree.links.new(shader.outputs[0], output.inputs[0])
    return material


def _object(name: str, mesh: bpy.types.Mesh) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def _mesh(vertices, faces) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new("mesh")
    mesh.from_pydata(np.asarray(vertices, float).tolist(), [], faces)
    mesh.uv_layers.new(name="UVMap")
    return mesh


def _quad(half: float) -> bpy.types.Mesh:
    return _mesh([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [(0, 1, 2, 3)])


def _box(half: float) -> bpy.types.Mesh:
    corners = [(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half / 2, half / 2)]
    return _mesh(corners, BOX_FACES)


def _ball(radius: float) -> bpy.types.Mesh:
    across, down = 12, 6
    rings = [
        (0.5 * radius * math.sin(v) * math.cos(u), 0.5 * radius * math.sin(v) * math.sin(u), 0.5 * radius * math.cos(v))
        for v in np.linspace(0.05, math.pi - 0.05, down)
        for u in np.arange(across) * 2 * math.pi / across
    ]
    faces = [
        (i * across + j, (i + 1) * across + j, (i + 1) * across + (j + 1) % across, i * across + (j + 1) % across)
        for i in range(down - 1)
        for j in range(across)
    ]
    mesh = _mesh(rings, faces)
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    return mesh
