"""What travels between processes: arrays, numbers and names in one row of bytes, and never code.

Objects of the core's own classes go by the class's name and its fields. The receiver makes only classes of its own
list, so that no bytes, whoever sent them, can have it run anything. Of the same bytes all make the same values, bit for
bit.
"""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass

import numpy as np

from ..bounds import Bounds
from ..direct.cast_piece import CastPiece
from ..direct.point_groups import PointGroups
from ..direct.stands import Stands
from ..discs import TangentDiscs
from ..errors import ClusterError
from ..estimator.standpoints import Standpoints
from ..estimator.visible_area import VisibleArea, VisibleDiscs
from ..lights.area import AreaLight
from ..lights.environment import EnvironmentWorld
from ..lights.point import PointLight
from ..lights.spot import SpotLight
from ..lights.sun import SunLight
from ..lights.world import UniformWorld
from ..photons.specular import Specular
from ..points import Points
from ..scene import Scene
from ..settings import BakeSettings

#: classes of which objects may travel, by name
_KINDS = {
    kind.__name__: kind
    for kind in (
        AreaLight, BakeSettings, Bounds, CastPiece, EnvironmentWorld, PointGroups, PointLight, Points, Scene, Specular,
        SpotLight, Standpoints, Stands, SunLight, TangentDiscs, UniformWorld, VisibleArea, VisibleDiscs,
    )
}  # fmt: skip

#: kinds of numbers that arrays may hold: booleans, whole and floating ones
_NUMBERS = "biuf"

#: arrays begin at multiples of so many bytes, as processors like it
_ALIGNED = 64


def packed(value) -> np.ndarray:
    """``value`` as bytes, (B,) uint8: None, numbers, text, arrays of numbers, tuples, and objects of the core's."""
    arrays: list[np.ndarray] = []
    tree = json.dumps(_described(value, arrays)).encode()
    places, end = [], 0
    for array in arrays:
        places.append((array.dtype.str, array.shape, end))
        end += -(-array.nbytes // _ALIGNED) * _ALIGNED
    head = json.dumps(places).encode()
    begin = -(-(16 + len(tree) + len(head)) // _ALIGNED) * _ALIGNED
    data = np.empty(begin + end, np.uint8)
    data[:16] = np.array([len(tree), len(head)], "<i8").view(np.uint8)
    data[16 : 16 + len(tree) + len(head)] = np.frombuffer(tree + head, np.uint8)
    for array, (_, _, place) in zip(arrays, places, strict=True):
        rows = data[begin + place : begin + place + array.nbytes].view(array.dtype).reshape(array.shape)
        rows[...] = array
    return data


def unpacked(data: np.ndarray):
    """What was :func:`packed` into ``data`` (B,) uint8; its arrays are views of that. Raises ClusterError."""
    data = np.frombuffer(data, np.uint8)
    try:
        tree, head = data[:16].view("<i8").tolist()
        text = data[16 : 16 + tree + head].tobytes()
        begin = -(-(16 + tree + head) // _ALIGNED) * _ALIGNED
        arrays = [_array(data[begin:], *place) for place in json.loads(text[tree:])]
        return _made(json.loads(text[:tree]), arrays)
    except (ValueError, KeyError, IndexError, TypeError) as error:
        raise ClusterError("What came over the network is no part of a bake.") from error


def _array(data: np.ndarray, kind: str, shape: list[int], place: int) -> np.ndarray:
    dtype = np.dtype(kind)
    if dtype.kind not in _NUMBERS:
        raise ValueError(kind)
    count = int(np.prod(shape, dtype=np.int64))
    return data[place : place + count * dtype.itemsize].view(dtype).reshape(shape)


def _described(value, arrays: list[np.ndarray]):
    """The JSON of ``value``, in which arrays are numbers of rows of ``arrays``."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray) and value.dtype.kind in _NUMBERS:
        arrays.append(value)
        return {"array": len(arrays) - 1}
    if isinstance(value, tuple | list):
        return [_described(each, arrays) for each in value]
    if is_dataclass(value) and _KINDS.get(type(value).__name__) is type(value):
        return {type(value).__name__: [_described(getattr(value, f.name), arrays) for f in fields(value)]}
    raise ClusterError(f"A {type(value).__name__} cannot be sent to the workers.")


def _made(tree, arrays: list[np.ndarray]):
    if isinstance(tree, list):
        return tuple(_made(each, arrays) for each in tree)
    if not isinstance(tree, dict):
        return tree
    ((name, content),) = tree.items()
    if name == "array":
        return arrays[content]
    kind = _KINDS[name]
    # All was checked and brought into form when it was made; doing so again would round once more.
    made = object.__new__(kind)
    for field, value in zip(fields(kind), content, strict=True):
        object.__setattr__(made, field.name, _made(value, arrays))
    return made
