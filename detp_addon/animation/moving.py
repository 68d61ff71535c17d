"""Which objects move: what Blender animates, unless the user has said otherwise."""

from __future__ import annotations

import bpy

#: the custom property of an object that says whether it moves; without it what animates it decides
MOVING = "detp_moving"

#: modifiers that change the shape of a mesh over time by something that lies outside of it
_OTHERS = {"ARMATURE", "HOOK", "LATTICE", "MESH_DEFORM", "SURFACE_DEFORM", "CURVE"}
#: and those that do so by themselves
_THEMSELVES = {"WAVE", "CLOTH", "SOFT_BODY", "OCEAN", "FLUID", "DYNAMIC_PAINT", "EXPLODE", "MESH_CACHE",
               "MESH_SEQUENCE_CACHE", "BUILD"}  # fmt: skip


def is_moving(obj: bpy.types.Object) -> bool:
    """Whether the object is marked as moving, or, where nothing is marked, is animated."""
    marked = obj.get(MOVING)
    return bool(marked) if marked is not None else is_animated(obj)


def is_animated(obj: bpy.types.Object, known: frozenset = frozenset()) -> bool:
    """Whether keys, drivers, constraints, physics, a parent or a modifier may move or deform the object.

    ``known`` are objects that are being looked at.
    """
    if obj is None or obj in known:
        return False
    if obj.rigid_body is not None and obj.rigid_body.type == "ACTIVE":
        return True
    if _has_keys(obj) or _has_keys(obj.data) or _has_keys(getattr(obj.data, "shape_keys", None)):
        return True
    if any(not constraint.mute for constraint in obj.constraints):
        return True
    kinds = {modifier.type for modifier in obj.modifiers if modifier.show_render}
    if kinds & _THEMSELVES:
        return True
    others = [modifier for modifier in obj.modifiers if modifier.type in _OTHERS]
    movers = [getattr(each, "object", None) or getattr(each, "target", None) for each in others]
    return any(is_animated(mover, known | {obj}) for mover in (obj.parent, *movers))


def _has_keys(data) -> bool:
    """Whether an object, mesh, armature or set of shape keys has keys or drivers."""
    animation = getattr(data, "animation_data", None)
    return animation is not None and bool(animation.action or animation.drivers or len(animation.nla_tracks))
