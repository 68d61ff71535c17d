"""A camera for scenes that have none."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Matrix, Vector


def frame(
    camera: bpy.types.Object,
    objects: list[bpy.types.Object],
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    aspect: float,
) -> None:
    """Place ``camera`` to see ``objects`` three-quarter from above, or from inside when they make a closed room.

    ``aspect`` is the picture's width over its height, at least 1.
    """
    corners = np.array([obj.matrix_world @ Vector(corner) for obj in objects for corner in obj.bound_box])
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    centre, size = (lower + upper) / 2, upper - lower
    camera.data.clip_start = 1e-3 * max(float(np.linalg.norm(size)), 1e-6)
    camera.data.clip_end = 1e3 * camera.data.clip_start * 10
    if _closed(scene, view_layer, centre):
        camera.data.angle = math.radians(75)
        eye = lower + size * (0.06, 0.08, 0.7)
        _look_at(camera, eye, lower + size * (0.6, 0.55, 0.4))
        return
    view = Vector((-0.55, -0.75, 0.5)).normalized()
    _look_at(camera, np.array(view), np.zeros(3))
    # Back off along the view until all corners are inside the picture.
    turned = (corners - centre) @ np.array(camera.matrix_world.to_3x3())
    half = math.tan(camera.data.angle / 2)
    reach = np.maximum(np.abs(turned[:, 0]) / half, np.abs(turned[:, 1]) / (half / aspect))
    distance = 1.05 * float((reach + turned[:, 2]).max())
    _look_at(camera, centre + distance * np.array(view), centre)


def _look_at(camera: bpy.types.Object, eye, target) -> None:
    rotation = Vector(np.subtract(target, eye)).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    camera.matrix_world = Matrix.Translation(Vector(eye)) @ rotation


def _closed(scene, view_layer, centre: np.ndarray) -> bool:
    """Whether nearly every ray from the centre meets something, as in a room with windows at most."""
    depsgraph = view_layer.depsgraph
    if depsgraph is None:
        return False
    steps = np.arange(64) + 0.5
    z, turn = 1 - 2 * steps / 64, steps * math.pi * (1 + math.sqrt(5))
    ring = np.sqrt(1 - z * z)
    directions = np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
    hits = sum(scene.ray_cast(depsgraph, Vector(centre), Vector(direction))[0] for direction in directions)
    return hits >= 0.85 * len(directions)
