"""Lamps and worlds of every kind, with every kind of wrong number."""

from __future__ import annotations

import math

import bpy
from fuzz.chance import Chance, put, shuffle
from fuzz.images import odd_image
from fuzz.node_graphs import emptied_tree, random_graph


def odd_light(chance: Chance) -> bpy.types.Light:
    """A lamp."""
    lamp = bpy.data.lights.new("lamp", chance.one_of("POINT", "SPOT", "SUN", "AREA"))
    put(lamp, "energy", chance.number(0.1, 1000))
    put(lamp, "color", chance.numbers(3, 0, 1))
    if chance.likely(0.3):
        shuffle(lamp, chance, chance.oddness + 0.1, without=("type", "use_nodes", "energy"))
    if lamp.type == "AREA":
        put(lamp, "shape", chance.one_of("SQUARE", "RECTANGLE", "DISK", "ELLIPSE"))
        put(lamp, "size", chance.one_of(0.0, 1e-20, 1e3) if chance.likely(0.1) else chance.number(0.1, 2))
        put(lamp, "size_y", chance.one_of(0.0, 1e-20, 1e3) if chance.likely(0.1) else chance.number(0.1, 2))
        put(lamp, "spread", chance.one_of(0.0, 0.01, 1.0, math.pi))
    elif lamp.type == "SPOT":
        put(lamp, "spot_size", chance.one_of(0.0, 0.01, 1.0, 3.0, math.pi))
        put(lamp, "spot_blend", chance.one_of(0.0, 0.15, 1e-6, 1.0))
    elif lamp.type == "SUN":
        put(lamp, "angle", chance.one_of(0.0, 0.01, 1e-9, math.pi))
    if lamp.type in ("POINT", "SPOT"):
        put(lamp, "shadow_soft_size", chance.one_of(0.0, 0.1, 1e-20) if chance.likely(0.8) else chance.number(0, 1))
    for name, share in (("normalize", 0.2), ("use_temperature", 0.2), ("use_soft_falloff", 0.5), ("use_shadow", 0.1)):
        put(lamp, name, chance.likely(share))
    put(lamp, "exposure", chance.number(-2, 2))
    if chance.likely(0.15):
        _light_nodes(chance, lamp)
    return lamp


def _light_nodes(chance: Chance, lamp) -> None:
    tree = emptied_tree(lamp)
    if chance.likely(0.1):
        return
    output = tree.nodes.new("ShaderNodeOutputLight")
    if chance.likely(0.3):
        random_graph(chance, tree, output)
        return
    emission = tree.nodes.new("ShaderNodeEmission")
    put(emission.inputs["Strength"], "default_value", chance.number(0, 5))
    put(emission.inputs["Color"], "default_value", (*chance.numbers(3, 0, 1), 1.0))
    tree.links.new(emission.outputs[0], output.inputs[0])


def odd_world(chance: Chance) -> bpy.types.World | None:
    """A world, or none. Skies that only Cycles can draw take time, so they are rare."""
    if chance.likely(0.2):
        return None
    world = bpy.data.worlds.new("world")
    put(world, "color", chance.numbers(3, 0, 1))
    if bpy.app.version < (5, 0):
        world.use_nodes = False
    if chance.likely(0.3):
        return world
    tree = emptied_tree(world)
    if chance.likely(0.05):
        return world
    output = tree.nodes.new("ShaderNodeOutputWorld")
    if chance.likely(0.04):
        random_graph(chance, tree, output)
        return world
    background = tree.nodes.new("ShaderNodeBackground")
    put(background.inputs["Strength"], "default_value", chance.number(0, 2))
    put(background.inputs["Color"], "default_value", (*chance.numbers(3, 0, 1), 1.0))
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    if chance.likely(0.05):
        texture = tree.nodes.new(chance.one_of("ShaderNodeTexEnvironment", "ShaderNodeTexSky", "ShaderNodeTexNoise"))
        if texture.bl_idname == "ShaderNodeTexEnvironment":
            texture.image = odd_image(chance)
            put(texture, "projection", chance.one_of("EQUIRECTANGULAR", "MIRROR_BALL"))
        tree.links.new(texture.outputs[0], background.inputs[chance.one_of("Color", "Strength")])
    if chance.likely(0.05):
        volume = tree.nodes.new("ShaderNodeVolumeScatter")
        tree.links.new(volume.outputs[0], output.inputs["Volume"])
    visibility = getattr(world, "cycles_visibility", None)
    if visibility and chance.likely(0.1):
        visibility.diffuse = False
    return world
