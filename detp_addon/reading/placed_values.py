"""What shaders ask of the object that wears a material: its place, its colour, its random number, its properties."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from .findings import Findings
from .islands import object_number
from .read_attributes import colours_of_elements
from .triangle_geometry import normal_matrices, safe_unit

#: what each object gives anew: a kind, or kind and name -> the key of the mesh's own values that it is made from
BASES = {
    ("position", "World"): ("position", "Object"),
    ("normal", "World"): ("normal", "Object"),
    ("face normal", "World"): ("face normal", "Object"),
    "position in": ("position", "Object"),
    "object location": None,
    "object colour": None,
    "object alpha": None,
    "object index": None,
    "object random": None,
    "instancer": None,
    "property": None,
}


#: what fills the numbers of an instance that it has no level for
_NO_LEVEL = 2**31 - 1

#: how paths to one number of several end, which Cycles does not follow
_PART = re.compile(r"(\[\d+\]|\.[xyzwrgb])$")


class InstanceAttributes:
    """What geometry nodes give the instances that they make."""

    def __init__(self, findings: Findings):
        self._findings = findings
        self._known: dict[tuple[int, str], np.ndarray | None] = {}

    def of(self, parent, number: int, name: str) -> np.ndarray | None:
        """RGBA (4,) of the instance of that ``number`` that an evaluated ``parent`` makes; None without such a one."""
        key = parent.as_pointer(), name
        if key not in self._known:
            self._known[key] = self._read(parent, name)
        values = self._known[key]
        return None if values is None or number >= len(values) else values[number]

    @staticmethod
    def _read(parent, name: str) -> np.ndarray | None:
        # Blender has these since 4.5.
        nodes = any(modifier.type == "NODES" for modifier in parent.modifiers)
        made = parent.evaluated_geometry() if nodes and hasattr(parent, "evaluated_geometry") else None
        cloud = made.instances_pointcloud() if made else None
        return colours_of_elements(cloud, name) if cloud else None

    def missing(self, name: str) -> None:
        """Names an attribute that was found neither among those of instances nor elsewhere."""
        self._findings.warn("attributes that shaders ask for and instances do not have themselves count as black: {}",
                            "name", name)  # fmt: skip


@dataclass(frozen=True)
class Standing:
    """An object, or an instance of one, as it stands in the scene.

    matrix      (4, 4) that takes its mesh into the world, in Blender's units
    random      its number from 0 to 1
    number      which instance of its parent's it is
    coordinates by name: where on its parent it stands, (3,) as "Generated" and "UV" say; zero of what is no instance
    attributes  of instances
    """

    obj: bpy.types.Object
    parent: bpy.types.Object | None
    matrix: np.ndarray
    random: float
    number: int
    coordinates: dict[str, np.ndarray]
    attributes: InstanceAttributes
    depsgraph: bpy.types.Depsgraph

    @classmethod
    def of(cls, instance, depsgraph, attributes: InstanceAttributes) -> Standing:
        """Of an instance of the ``depsgraph``."""
        matrix, obj = np.array(instance.matrix_world, np.float64), instance.object
        if not instance.is_instance:
            nowhere = dict.fromkeys(("Generated", "UV"), np.zeros(3))
            return cls(obj, None, matrix, object_number(obj.name), 0, nowhere, attributes, depsgraph)
        # Cycles makes a number of 32 bits to one from 0 to 1.
        random = (instance.random_id & 0xFFFFFFFF) / 0xFFFFFFFF
        number = next((part for part in reversed(instance.persistent_id) if part != _NO_LEVEL), 0)
        # Cycles makes the first of these out of what it takes for a place between -1 and 1.
        where = {"Generated": 0.5 * np.array(instance.orco) - 0.5, "UV": np.array([*instance.uv, 0.0])}
        return cls(obj, instance.parent, matrix, random, number, where, attributes, depsgraph)

    def own(self, kind: str, name: str) -> np.ndarray | None:
        """What (1, c) the object has without a mesh, None for what depends on the place on one."""
        alone = kind == "property" or kind.startswith("object ")
        return placed_value((kind, name), self, {}, 1) if alone else None


def placed_value(key: tuple[str, str], standing: Standing, given: dict, corners: int) -> np.ndarray:
    """The values (corners, c) of ``key``; ``given`` has those of the mesh that it is made from."""
    kind, name = key
    matrix, base = standing.matrix, BASES.get(key, BASES.get(kind))
    if base is not None:
        values = given[base].astype(np.float64)
        if kind.endswith("normal"):
            return safe_unit(values @ normal_matrices(matrix[None])[0].T)[0]
        places = values @ matrix[:3, :3].T + matrix[:3, 3]
        if kind == "position":
            return places
        other = bpy.data.objects.get(name)
        inverse = np.linalg.pinv(np.array(other.evaluated_get(standing.depsgraph).matrix_world)) if other else np.eye(4)
        return places @ inverse[:3, :3].T + inverse[:3, 3]
    obj = standing.obj
    if kind == "property":
        value = _property(*name.split(" ", 1), standing)
    elif kind == "instancer":
        value = standing.coordinates[name]
    else:
        value = {
            "object location": lambda: matrix[:3, 3],
            "object colour": lambda: obj.color[:3],
            "object alpha": lambda: obj.color[3:],
            "object index": lambda: [obj.pass_index],
            "object random": lambda: [standing.random],
        }[kind]()
    return np.broadcast_to(np.array(value, np.float64), (corners, len(value)))


def _property(kind: str, name: str, standing: Standing) -> np.ndarray:
    """RGBA (4,) of a property by its name or path: of the instance, the instancer and the object, or of the view layer
    and the scene.

    Black without one, as in Cycles.
    """
    graph = standing.depsgraph
    owners = [standing.obj, standing.obj.data]
    instanced = kind == "INSTANCER" and standing.parent is not None
    if instanced:
        value = standing.attributes.of(standing.parent, standing.number, name)
        if value is not None:
            return value
        owners = [standing.parent, *owners]
    if kind == "VIEW_LAYER":
        owners = [graph.view_layer_eval, graph.scene_eval, graph.scene_eval.world]
    value = property_of(owners, name)
    if value is None and instanced:
        standing.attributes.missing(name)
    return np.zeros(4) if value is None else value


def property_of(owners: Sequence, name: str) -> np.ndarray | None:
    """RGBA (4,) of a property of that ``name`` or path of the first of the ``owners`` that has it, None without one."""
    found = (_looked_up(owner, name) for owner in owners if owner is not None and name)
    return next((value for value in found if value is not None), None)


def _looked_up(owner, name: str) -> np.ndarray | None:
    if _PART.search(name):
        return None
    value = owner.get(name)
    if value is None:
        try:
            value = owner.path_resolve(name)
        except ValueError:
            return None
    try:
        numbers = np.atleast_1d(np.array(value, np.float64)).ravel()
    except (TypeError, ValueError):
        return None
    if not 1 <= len(numbers) <= 4:
        return None
    if len(numbers) == 1:
        return np.array([*np.repeat(numbers, 3), 1.0])
    return np.array([*numbers[:4], 0.0, 0.0, 1.0][:3] + [numbers[3] if len(numbers) > 3 else 1.0])
