"""Objects in places that no object should have: parents, instances, and everything that is no mesh."""

from __future__ import annotations

import math
from contextlib import suppress

import bpy
import numpy as np
from fuzz.chance import REFUSALS, Chance, put
from mathutils import Matrix


def place(chance: Chance, obj) -> None:
    """Somewhere, turned and scaled; in odd scenes anywhere."""
    kind = chance.one_of("usual", "usual", "usual", "scale", "matrix", "numbers")
    obj.location = tuple(chance.between(-4, 4) for _ in range(3))
    obj.rotation_euler = tuple(chance.between(-math.pi, math.pi) for _ in range(3))
    if kind == "scale":
        odd = (0.0, -1.0, 1.0, 1e-3, 1e3, 1e-6, 1e-20, 1e10, -1e-4)
        obj.scale = tuple(chance.one_of(1.0, 1.0, *odd) for _ in range(3))
    elif kind == "matrix":
        values = chance.arrays.uniform(-2, 2, (4, 4))
        values[3] = (0, 0, 0, 1)
        if chance.likely(0.3):
            values[:, 0] = values[:, 1]  # singular
        if chance.likely(0.05):
            values[3] = chance.arrays.uniform(-1, 1, 4)  # no affine matrix at all
        put(obj, "matrix_parent_inverse" if chance.likely(0.3) else "matrix_world", Matrix(values.tolist()))
    elif kind == "numbers":
        obj.location = chance.numbers(3, -4, 4)
        obj.scale = chance.numbers(3, 0.5, 2)
        obj.rotation_euler = chance.numbers(3, -4, 4)
    put(obj, "delta_scale", (1, 1, chance.number(0.5, 1)) if chance.likely(0.1) else (1, 1, 1))


def other_object(chance: Chance) -> bpy.types.Object | None:
    """A curve, text, metaball, volume, empty or whatever else this Blender has, none where it refuses."""
    kind = chance.one_of(*OTHER)
    try:
        return OTHER[kind](chance)
    except REFUSALS:
        return None


def _curve(chance):
    data = bpy.data.curves.new("curve", "CURVE")
    data.dimensions = chance.one_of("2D", "3D")
    spline = data.splines.new(chance.one_of("POLY", "BEZIER", "NURBS"))
    points = spline.bezier_points if spline.type == "BEZIER" else spline.points
    points.add(chance.count(0, 6))
    for point in points:
        point.co = chance.numbers(3 if spline.type == "BEZIER" else 4, -2, 2)
    put(data, "bevel_depth", chance.number(0, 0.3))
    put(data, "extrude", chance.number(0, 0.3))
    put(data, "fill_mode", chance.one_of("FULL", "BACK", "BOTH", "NONE"))
    spline.use_cyclic_u = chance.likely(0.5)
    return bpy.data.objects.new("curve", data)


def _text(chance):
    data = bpy.data.curves.new("text", "FONT")
    data.body = chance.one_of("", "ab", "\n\n", "ü€")
    put(data, "size", chance.number(0, 2))
    put(data, "extrude", chance.number(0, 0.2))
    return bpy.data.objects.new("text", data)


def _meta(chance):
    data = bpy.data.metaballs.new("meta")
    data.resolution = data.render_resolution = 0.5
    for _ in range(chance.count(0, 3)):
        element = data.elements.new(type=chance.one_of("BALL", "CUBE", "ELLIPSOID"))
        element.co = tuple(chance.between(-1, 1) for _ in range(3))
        element.radius = chance.between(0, 1)
    return bpy.data.objects.new("meta", data)


def _surface(chance):
    return bpy.data.objects.new("surface", bpy.data.curves.new("surface", "SURFACE"))


def _volume(chance):
    data = bpy.data.volumes.new("volume")
    data.filepath = chance.one_of("", "//no such.vdb")
    return bpy.data.objects.new("volume", data)


def _curves(chance):
    return bpy.data.objects.new("hair", bpy.data.hair_curves.new("hair"))


def _points(chance):
    return bpy.data.objects.new("points", bpy.data.pointclouds.new("points"))


def _grease(chance):
    blocks = getattr(bpy.data, "grease_pencils_v3", None) or bpy.data.grease_pencils
    return bpy.data.objects.new("grease", blocks.new("grease"))


def _empty(chance):
    return bpy.data.objects.new("empty", None)


def _armature(chance):
    return bpy.data.objects.new("bones", bpy.data.armatures.new("bones"))


def _lattice(chance):
    return bpy.data.objects.new("lattice", bpy.data.lattices.new("lattice"))


def _probe(chance):
    return bpy.data.objects.new("probe", bpy.data.lightprobes.new("probe", chance.one_of("SPHERE", "PLANE", "VOLUME")))


def _speaker(chance):
    return bpy.data.objects.new("speaker", bpy.data.speakers.new("speaker"))


def _camera(chance):
    return bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))


OTHER = {
    "curve": _curve, "text": _text, "meta": _meta, "surface": _surface, "volume": _volume, "curves": _curves,
    "points": _points, "grease": _grease, "empty": _empty, "armature": _armature, "lattice": _lattice,
    "probe": _probe, "speaker": _speaker, "camera": _camera,
}  # fmt: skip


def shape_keys(chance: Chance, obj) -> None:
    """Shape keys with any values, on a mesh that nothing else uses."""
    size = len(obj.data.vertices)
    for number in range(chance.count(1, 3)):
        key = obj.shape_key_add(name=f"key {number}", from_mix=chance.likely(0.2))
        put(key, "value", chance.number(0, 1))
        if number and len(key.data) == size:
            moved = chance.rows((size * 3,), -2, 2).astype(np.float32)
            key.data.foreach_set("co", moved)


def parented(chance: Chance, objects: list, scene) -> None:
    """Parents among ``objects``, now and then a long chain of empties that each scale a little."""
    for child in objects:
        if chance.likely(0.15) and len(objects) > 1:
            put(child, "parent", chance.one_of(*objects))
    if objects and chance.likely(0.05):
        parent = None
        for _ in range(chance.one_of(3, 60, 200)):
            link = bpy.data.objects.new("chain", None)
            scene.collection.objects.link(link)
            link.parent, link.scale = parent, (1.0, chance.between(0.5, 2), 1.0)
            link.location = (0.1, 0, 0)
            parent = link
        chance.one_of(*objects).parent = parent


def instanced(chance: Chance, objects: list, scene) -> None:
    """Instances of collections, and of children at their parent's vertices or faces."""
    for obj in objects:
        if chance.likely(0.08):
            put(obj, "instance_type", chance.one_of("VERTS", "FACES", "NONE"))
            put(obj, "use_instance_faces_scale", chance.likely(0.5))
            put(obj, "instance_faces_scale", chance.number(0, 2))
    if chance.likely(0.2):
        group = bpy.data.collections.new("group")
        for obj in chance.some_of(objects, 3):
            group.objects.link(obj)
        for _ in range(chance.count(1, 5)):
            empty = bpy.data.objects.new("instance", None)
            empty.instance_type = "COLLECTION"
            put(empty, "instance_collection", group)
            with suppress(RuntimeError):  # Blender does not let a collection hold its own instance
                chance.one_of(scene.collection, scene.collection, group).objects.link(empty)
            place(chance, empty)
        if chance.likely(0.3):
            scene.collection.children.link(group)
