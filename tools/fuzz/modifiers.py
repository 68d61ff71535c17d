"""Modifiers of the usual kinds with settings that are wrong, and now and then any other kind as Blender makes it.

Counts stay small: what is looked for is not how much memory Blender takes.
"""

from __future__ import annotations

import bpy
from fuzz.chance import REFUSALS, Chance, put
from fuzz.geometry_nodes import geometry_tree

#: kinds that need files, caches or much time
_LEFT_ALONE = ("FLUID", "OCEAN", "DYNAMIC_PAINT", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "NODES", "PARTICLE_SYSTEM")


def add_modifiers(chance: Chance, obj, others: list) -> None:
    """One to three modifiers on a mesh object, which may look at ``others``."""
    others = [other for other in others if other != obj]
    names = [chance.one_of(*USUAL) if chance.likely(0.85) else chance.one_of(*_all_kinds()) for _ in range(3)]
    for name in dict.fromkeys(names[: chance.count(1, 3)]):
        try:
            modifier = obj.modifiers.new(name.title(), name)
        except REFUSALS:
            continue
        if modifier is None:
            continue
        if name in USUAL:
            USUAL[name](chance, modifier, others)
        put(modifier, "show_render", chance.likely(0.9))
        put(modifier, "show_viewport", chance.likely(0.8))
        if chance.likely(0.2):
            put(modifier, "vertex_group", chance.one_of("group", "no such"))


def _all_kinds() -> list[str]:
    kinds = bpy.types.Modifier.bl_rna.properties["type"].enum_items
    return [kind.identifier for kind in kinds if not kind.identifier.startswith(("GREASE", "GP_", "LINEART"))
            and kind.identifier not in _LEFT_ALONE]  # fmt: skip


def _other(chance: Chance, others: list, kind: str = "MESH"):
    fitting = [obj for obj in others if obj.type == kind]
    return chance.one_of(*fitting) if fitting and chance.likely(0.8) else None


def _array(chance, modifier, others):
    modifier.count = chance.count(1, 6)
    modifier.use_relative_offset, modifier.use_constant_offset = chance.likely(0.7), chance.likely(0.4)
    put(modifier, "relative_offset_displace", chance.numbers(3, -2, 2))
    put(modifier, "constant_offset_displace", chance.numbers(3, -2, 2))
    modifier.use_merge_vertices = chance.likely(0.3)
    put(modifier, "merge_threshold", chance.number(0, 1))
    modifier.use_object_offset, modifier.offset_object = chance.likely(0.2), _other(chance, others)


def _mirror(chance, modifier, others):
    for axis in range(3):
        modifier.use_axis[axis] = chance.likely(0.5)
        modifier.use_bisect_axis[axis] = chance.likely(0.2)
    put(modifier, "merge_threshold", chance.number(0, 1))
    modifier.mirror_object = _other(chance, others)


def _subsurf(chance, modifier, others):
    modifier.levels, modifier.render_levels = chance.count(0, 2), chance.count(0, 2)
    put(modifier, "subdivision_type", chance.one_of("SIMPLE", "CATMULL_CLARK"))


def _solidify(chance, modifier, others):
    put(modifier, "thickness", chance.number(-1, 1))
    put(modifier, "offset", chance.number(-1, 1))
    put(modifier, "solidify_mode", chance.one_of("EXTRUDE", "NON_MANIFOLD"))
    modifier.use_even_offset = chance.likely(0.5)


def _boolean(chance, modifier, others):
    modifier.object = _other(chance, others)
    put(modifier, "operation", chance.one_of("INTERSECT", "UNION", "DIFFERENCE"))
    put(modifier, "solver", chance.one_of("EXACT", "FAST", "FLOAT"))


def _displace(chance, modifier, others):
    put(modifier, "strength", chance.number(-1, 1))
    put(modifier, "mid_level", chance.number(-1, 1))
    put(modifier, "direction", chance.one_of("X", "NORMAL", "CUSTOM_NORMAL", "RGB_TO_XYZ"))
    if chance.likely(0.5):
        modifier.texture = bpy.data.textures.new("clouds", chance.one_of("CLOUDS", "VORONOI", "NONE", "IMAGE"))


def _remesh(chance, modifier, others):
    put(modifier, "mode", chance.one_of("BLOCKS", "SMOOTH", "SHARP"))
    modifier.octree_depth = chance.count(1, 4)
    put(modifier, "scale", chance.between(0.1, 0.99))
    put(modifier, "threshold", chance.number(0, 1))


def _decimate(chance, modifier, others):
    put(modifier, "decimate_type", chance.one_of("COLLAPSE", "UNSUBDIV", "DISSOLVE"))
    put(modifier, "ratio", chance.one_of(0.0, 0.0, 0.5, 1e-6))
    modifier.iterations = chance.count(0, 5)


def _armature(chance, modifier, others):
    modifier.object = _other(chance, others, "ARMATURE")


def _bevel(chance, modifier, others):
    put(modifier, "width", chance.number(0, 1))
    modifier.segments = chance.count(1, 4)
    put(modifier, "profile", chance.number(0, 1))
    put(modifier, "affect", chance.one_of("VERTICES", "EDGES"))


def _screw(chance, modifier, others):
    modifier.steps = modifier.render_steps = chance.count(2, 12)
    put(modifier, "angle", chance.number(-7, 7))
    put(modifier, "screw_offset", chance.number(-1, 1))


def _mask(chance, modifier, others):
    put(modifier, "invert_vertex_group", chance.likely(0.5))


def _build(chance, modifier, others):
    modifier.frame_start = chance.between(-10, 10)  # Blender 4.5 itself aborts when it is not a number


def _weld(chance, modifier, others):
    put(modifier, "merge_threshold", chance.one_of(0.0, 0.01, 100.0))


def _cast(chance, modifier, others):
    put(modifier, "factor", chance.number(-3, 3))
    put(modifier, "size", chance.number(0, 3))


def _shrinkwrap(chance, modifier, others):
    modifier.target = _other(chance, others)
    put(modifier, "offset", chance.number(-1, 1))


def _deform(chance, modifier, others):
    put(modifier, "deform_method", chance.one_of("TWIST", "BEND", "TAPER", "STRETCH"))
    put(modifier, "factor", chance.number(-10, 10))


def _plain(chance, modifier, others):
    """As Blender makes it."""


def _nodes(chance, modifier, others):
    modifier.node_group = geometry_tree(chance)


USUAL = {
    "ARRAY": _array, "MIRROR": _mirror, "SUBSURF": _subsurf, "SOLIDIFY": _solidify, "BOOLEAN": _boolean,
    "DISPLACE": _displace, "REMESH": _remesh, "DECIMATE": _decimate, "ARMATURE": _armature, "BEVEL": _bevel,
    "SCREW": _screw, "MASK": _mask, "BUILD": _build, "WELD": _weld, "CAST": _cast, "SHRINKWRAP": _shrinkwrap,
    "SIMPLE_DEFORM": _deform, "TRIANGULATE": _plain, "EDGE_SPLIT": _plain, "WEIGHTED_NORMAL": _plain,
    "WIREFRAME": _plain, "SKIN": _plain, "EXPLODE": _plain, "MULTIRES": _plain, "NODES": _nodes,
}  # fmt: skip
