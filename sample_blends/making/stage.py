"""The Blender side: an empty file, materials, objects, lights and a camera."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Euler, Vector

from .surfaces import Surface

Colour = tuple[float, float, float]


def empty_file(width: int, height: int) -> bpy.types.Scene:
    """A file without objects, to be rendered by Cycles on the processor and shown without a film look."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.unit_settings.system = "METRIC"
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.cycles.samples = 128
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 32
    scene.view_settings.view_transform = "Standard"
    return scene


def material(name: str, colour: Colour, emission: Colour = (0.0, 0.0, 0.0), strength: float = 0.0):
    """A purely diffuse Principled material; it emits radiance ``emission * strength`` in W/(m^2 sr)."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.diffuse_color = (*colour, 1.0)
    inputs = made.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (*colour, 1.0)
    inputs["Roughness"].default_value = 1.0
    inputs["Specular IOR Level"].default_value = 0.0
    inputs["Emission Color"].default_value = (*emission, 1.0)
    inputs["Emission Strength"].default_value = strength
    return made


def metal(name: str, colour: Colour, roughness: float):
    """A metal that reflects ``colour``."""
    made = material(name, colour)
    inputs = made.node_tree.nodes["Principled BSDF"].inputs
    inputs["Metallic"].default_value = 1.0
    inputs["Roughness"].default_value = roughness
    return made


def glass(name: str, colour: Colour, ior: float):
    """Smooth clear glass, in which light takes on ``colour`` on its way through."""
    made = material(name, colour)
    inputs = made.node_tree.nodes["Principled BSDF"].inputs
    inputs["Transmission Weight"].default_value = 1.0
    inputs["Roughness"].default_value = 0.0
    inputs["IOR"].default_value = ior
    return made


def mesh(name: str, surfaces: list[Surface], materials: list) -> bpy.types.Mesh:
    """One mesh of all ``surfaces``, with ``materials`` in its slots."""
    made = bpy.data.meshes.new(name)
    counts = np.concatenate([np.full(len(s.faces), s.faces.shape[1], np.int32) for s in surfaces])
    starts = np.cumsum([0] + [len(s.vertices) for s in surfaces[:-1]])
    corners = np.concatenate([(s.faces + start).ravel() for s, start in zip(surfaces, starts, strict=True)])
    vertices = np.concatenate([s.vertices for s in surfaces])
    made.vertices.add(len(vertices))
    made.vertices.foreach_set("co", vertices.astype(np.float32).ravel())
    made.loops.add(len(corners))
    made.loops.foreach_set("vertex_index", corners.astype(np.int32))
    made.polygons.add(len(counts))
    made.polygons.foreach_set("loop_start", (np.cumsum(counts) - counts).astype(np.int32))
    slots = np.concatenate([np.broadcast_to(s.material, len(s.faces)) for s in surfaces])
    smooth = np.concatenate([np.full(len(s.faces), s.smooth) for s in surfaces])
    for slot in materials:
        made.materials.append(slot)
    made.polygons.foreach_set("material_index", slots.astype(np.int32))
    made.polygons.foreach_set("use_smooth", smooth)
    made.update(calc_edges=True)
    made.set_sharp_from_angle(angle=math.radians(40))
    if made.validate():
        raise ValueError(f"The mesh '{name}' has invalid faces.")
    return made


def place(name: str, data, location=(0.0, 0.0, 0.0), turn: float = 0.0, scale=(1.0, 1.0, 1.0)) -> bpy.types.Object:
    """Put ``data`` into the scene, turned by degrees about the z axis."""
    made = bpy.data.objects.new(name, data)
    made.location, made.scale = location, scale
    made.rotation_euler = (0.0, 0.0, math.radians(turn))
    bpy.context.scene.collection.objects.link(made)
    return made


def add(name: str, surfaces: list[Surface], materials: list) -> bpy.types.Object:
    """An object of its own mesh at the origin."""
    return place(name, mesh(name, surfaces, materials))


def aimed(name: str, data, location, target) -> bpy.types.Object:
    """Put ``data`` (a camera, a sun or spot) at ``location``, looking at ``target``."""
    made = place(name, data, location)
    direction = Vector(target) - Vector(location)
    made.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()
    return made


def camera(location, target, lens: float, sensor: float = 36.0) -> bpy.types.Object:
    """The scene's camera; ``lens`` and the sensor's width in millimetres."""
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width = lens, sensor
    data.clip_start = 0.01
    made = aimed("Camera", data, location, target)
    bpy.context.scene.camera = made
    return made


def sun(irradiance: float, elevation: float, heading: float, colour: Colour = (1.0, 1.0, 1.0), width: float = 0.53):
    """A sun ``elevation`` degrees above the horizon, in the direction ``heading`` degrees from +x towards +y.

    ``irradiance`` in W/m^2 on a plane that faces it, ``width`` its angular diameter in degrees.
    """
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy, data.color, data.angle = irradiance, colour, math.radians(width)
    made = place("Sun", data)
    made.rotation_euler = Euler((0.0, math.radians(90 - elevation), math.radians(heading)))
    return made


def sky(colour: Colour, radiance: float) -> None:
    """A world of one colour."""
    world = bpy.data.worlds.new("Sky")
    world.use_nodes = True
    inputs = world.node_tree.nodes["Background"].inputs
    inputs["Color"].default_value = (*colour, 1.0)
    inputs["Strength"].default_value = radiance
    bpy.context.scene.world = world
