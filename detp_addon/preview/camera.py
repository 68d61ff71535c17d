"""A camera for scenes that have none."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Matrix, Vector

#: of the directions from a place in a room so many show the front of a face; and so many of some places do
_AROUND, _PLACES = 0.85, 1 / 3

#: an object so many times as large as all others together is their ground or sky, and not what is looked at; so is one
#: around all of them that is so many times as long, as wide and as high
_GROUND, _SKY, _MARGIN = 20.0, 4.0, 0.5

#: the rest of the picture would be smaller than one part in so many
_ASTRAY = 100.0

#: from where to look at what is no room, how many looks along each side of its box tell what shows there, and by how
#: much more of its front one has to show to be taken
VIEWS = np.array([(-0.55, -0.75, 0.5), (0.55, -0.75, 0.5), (-0.55, 0.75, 0.5), (0.55, 0.75, 0.5)])
_LOOKS, _CLEARLY = 5, 0.1


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
    boxes = np.array([[obj.matrix_world @ Vector(corner) for corner in obj.bound_box] for obj in objects])
    corners = _looked_at(boxes)
    lower, size = corners.min(axis=0), np.ptp(corners, axis=0)
    camera.data.clip_start = 1e-3 * max(float(np.linalg.norm(size)), 1e-6)
    camera.data.clip_end = 1e3 * camera.data.clip_start * 10
    shells = {obj.name for obj, box in zip(objects, boxes, strict=True) if _holds_any(box, boxes)}
    inside = _inside(scene, view_layer, lower, size, shells)
    if inside is not None:
        camera.data.angle = math.radians(75)
        _look_at(camera, inside, lower + size * (0.6, 0.55, 0.4))
        return
    centre = lower + size / 2
    view = _open_side(scene, view_layer, corners)
    _look_at(camera, view, np.zeros(3))
    # Back off along the view until all corners are inside the picture.
    turned = (corners - centre) @ np.array(camera.matrix_world.to_3x3())
    half = math.tan(camera.data.angle / 2)
    reach = np.maximum(np.abs(turned[:, 0]) / half, np.abs(turned[:, 1]) / (half / aspect))
    distance = 1.05 * float((reach + turned[:, 2]).max())
    _look_at(camera, centre + distance * view, centre)
    # A sky that is not looked at may stand before it.
    camera.data.clip_start = 0.5 * (distance - float(turned[:, 2].max()))


def _open_side(scene, view_layer, corners: np.ndarray) -> np.ndarray:
    """The unit direction (3,) of VIEWS from which most of what is seen between ``corners`` (K, 3) shows its front.

    The first, unless another is clearly better: sets are open to one side, and walls are seen through from behind.
    """
    views = VIEWS / np.linalg.norm(VIEWS, axis=1, keepdims=True)
    if view_layer.depsgraph is None:
        return views[0]
    lower, size = corners.min(axis=0), np.ptp(corners, axis=0)
    away = 2.0 * np.linalg.norm(size)
    at = (np.arange(_LOOKS) + 0.5) / _LOOKS
    places = lower + size * np.stack(np.meshgrid(at, at, at, indexing="ij"), axis=-1).reshape(-1, 3)
    shares = []
    for view in views:
        hits = [scene.ray_cast(view_layer.depsgraph, Vector(place + away * view), Vector(-view)) for place in places]
        fronts = [normal.dot(Vector(view)) > 0 for hit, _, normal, *_ in hits if hit]
        shares.append(np.mean(fronts) if fronts else 0.0)
    best = int(np.argmax(shares))
    return views[best if shares[best] > shares[0] + _CLEARLY else 0]


def _looked_at(boxes: np.ndarray) -> np.ndarray:
    """Corners (K, 3) of what is worth looking at among objects' boxes (N, 8, 3).

    Not what is so far astray that it would make specks of all others, and not the ground under small things.
    """
    middles = boxes.mean(axis=1)
    away = np.linalg.norm(middles - np.median(middles, axis=0), axis=1)
    near = boxes[away <= _ASTRAY * np.median(np.linalg.norm(np.ptp(boxes, axis=1), axis=1) + away)]
    if len(near) and _span(near) * _ASTRAY < _span(boxes):
        boxes = near
    while len(boxes) > 1:
        largest = np.linalg.norm(np.ptp(boxes, axis=1), axis=1).argmax()
        rest, size = np.delete(boxes, largest, axis=0), np.ptp(boxes[largest], axis=0)
        span = np.ptp(rest.reshape(-1, 3), axis=0)
        sky = (size > _SKY * span).all() and _holds(boxes[largest], rest).all()
        if not sky and np.linalg.norm(size) <= _GROUND * np.linalg.norm(span):
            break
        margin = 0.0 if sky else _MARGIN * np.linalg.norm(span)
        boxes = rest + margin * np.sign(rest - rest.mean(axis=(0, 1)))
    return boxes.reshape(-1, 3)


def _span(boxes: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(boxes.reshape(-1, 3), axis=0)))


def _look_at(camera: bpy.types.Object, eye, target) -> None:
    rotation = Vector(np.subtract(target, eye)).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    camera.matrix_world = Matrix.Translation(Vector(eye)) @ rotation


def _holds_any(box: np.ndarray, boxes: np.ndarray) -> bool:
    """Whether any of ``boxes`` (N, 8, 3) lies within ``box`` (8, 3)."""
    smaller = np.linalg.norm(np.ptp(boxes, axis=1), axis=1) < 0.9 * np.linalg.norm(np.ptp(box, axis=0))
    return bool((_holds(box, boxes) & smaller).any())


def _holds(box: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """Which (N,) of ``boxes`` (N, 8, 3) lie within ``box`` (8, 3)."""
    slack = 1e-3 * np.linalg.norm(np.ptp(box, axis=0))
    within = (boxes.min(axis=1) > box.min(axis=0) - slack) & (boxes.max(axis=1) < box.max(axis=0) + slack)
    return within.all(axis=1)


def _inside(scene, view_layer, lower: np.ndarray, size: np.ndarray, shells: set[str]) -> np.ndarray | None:
    """Where to look from in a closed room that fills the box; None where it is none.

    In a room, with windows at most, nearly every ray meets the front of a face, or one of the ``shells``, objects that
    hold others; solid things show backs from within.
    """
    depsgraph = view_layer.depsgraph
    if depsgraph is None:
        return None
    steps = np.arange(64) + 0.5
    z, turn = 1 - 2 * steps / 64, steps * math.pi * (1 + math.sqrt(5))
    ring = np.sqrt(1 - z * z)
    directions = np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)

    def cast(place, direction):
        return scene.ray_cast(depsgraph, Vector(place), Vector(direction))

    def shows_front(place, direction) -> bool:
        hit, at, normal, _, obj, _ = cast(place, direction)
        # Nearer is the place itself, and farther a sky or a wall that the box leaves out.
        apart = hit and 1e-6 < (at - Vector(place)).length / np.linalg.norm(size) < 1
        return bool(apart and (normal.dot(Vector(direction)) < 0 or obj.name in shells))

    # Rooms need not fill their box: the middle of one with a wing may lie outside.
    along, up = (0.1, 0.3, 0.5, 0.7, 0.9), (0.3, 0.5, 0.7)
    shares = np.stack(np.meshgrid(along, along, up, indexing="ij"), axis=-1).reshape(-1, 3)
    closed = [
        place
        for place in lower + size * shares
        if np.mean([shows_front(place, direction) for direction in directions]) >= _AROUND
    ]
    if len(closed) < _PLACES * len(shares):
        return None
    # From a corner one sees most; walls may be thick.
    corner = lower + size * (0.06, 0.08, 0.7)
    start = min(closed, key=lambda place: np.linalg.norm(place - corner))
    way = corner - start
    hit, at, *_ = cast(start, way / np.linalg.norm(way))
    free = np.linalg.norm(np.array(at) - start) if hit else np.inf
    return start + way * min(1.0, 0.9 * free / np.linalg.norm(way))
