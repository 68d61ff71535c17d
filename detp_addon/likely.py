"""What a bake is likely to take, by what of a scene is quickly counted: for the panel, and for dry runs."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ..core.errors import NothingSelectedError
from ..core.fit.shown_faces import more_places
from ..core.forecast import Forecast, forecast
from .chosen_objects import chosen_objects
from .mixing.light_groups import likely_groups
from .reading.read_node_graph import node_tree
from .request import BakeRequest

#: Of worlds that have more than one colour: seconds of a processor of the reference in which Cycles makes a picture of
#: it, and as how many lamps it counts, since its light is another in each direction.
_PICTURE, _AS_LAMPS = 4.0, 8

#: nodes of a world that need not be seen to tell its colour
_PLAIN = {"OUTPUT_WORLD", "BACKGROUND"}

#: normals that differ by less than about one over this are those of one value
_ALIKE = 32.0

#: how many values a mesh shows, by its name, sizes and kind of normals
_counted: dict[tuple, int] = {}


def likely_values(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, request: BakeRequest) -> int:
    """About how many values a bake will show: one for each vertex of the meshes, without modifiers, and each way that
    its corners face."""
    try:
        chosen = chosen_objects(scene, view_layer, request.targets)
    except NothingSelectedError:
        return 0
    objects = view_layer.objects if chosen is None else chosen
    meshes = [obj.data for obj in objects if obj.type == "MESH" and not obj.hide_render]
    return sum(len(mesh.vertices) if request.domain == "POINT" else _values_of(mesh) for mesh in meshes)


def likely_bake(scene, view_layer, request: BakeRequest, values: int, factor: float = 1.0) -> Forecast:
    """What a bake that shows so many ``values`` is likely to take, times ``factor``; by light each group is a bake of
    its own, and open surroundings are direct light."""
    settings = request.settings
    if request.quantity == "ambient-occlusion":
        settings = replace(settings, direct="shadow-rays", indirect="off")
    points = values + (int(more_places(values)) if request.fit == "faces" else 0)
    lamps = sum(obj.type == "LIGHT" and not obj.hide_render for obj in view_layer.objects)
    pictured = _is_pictured(scene.world)
    lamps += _AS_LAMPS * pictured
    apart = request.by_light and settings.seconds is None
    groups = likely_groups(scene, view_layer) if apart else 1
    likely = forecast(points, settings, factor, lamps / groups, _PICTURE * pictured / groups)
    return replace(likely, seconds=likely.seconds * groups)


def _values_of(mesh: bpy.types.Mesh) -> int:
    corners = len(mesh.loops)
    key = mesh.name_full, corners, len(mesh.vertices), mesh.normals_domain
    if key not in _counted:
        normals, vertices = np.empty((corners, 3), np.float32), np.empty(corners, np.int32)
        mesh.corner_normals.foreach_get("vector", normals.ravel())
        mesh.loops.foreach_get("vertex_index", vertices)
        ways = np.rint(_ALIKE * normals).astype(np.int64) @ (1, 1 << 8, 1 << 16)
        _counted[key] = len(np.unique((ways << 32) + vertices))
    return _counted[key]


def _is_pictured(world: bpy.types.World | None) -> bool:
    tree = None if world is None else node_tree(world)
    return tree is not None and not {node.type for node in tree.nodes} <= _PLAIN
