"""Arrays, numbers and names in one row of bytes, and never code: what travels between processes and lies in files.

Objects go by their class's name and its fields. Who unpacks makes only classes of a list of its own, so that no bytes,
whoever made them, can have it run anything. Of the same bytes all make the same values, bit for bit.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import fields, is_dataclass

import numpy as np

#: kinds of numbers that arrays may hold: booleans, whole and floating ones
_NUMBERS = "biuf"

#: arrays begin at multiples of so many bytes, as processors like it
_ALIGNED = 64


def packed(value, kinds: Iterable[type]) -> np.ndarray:
    """``value`` as bytes, (B,) uint8: None, numbers, text, arrays of numbers, tuples, dictionaries by text, and objects
    of the dataclasses ``kinds``. Raises TypeError with the name of any other class."""
    arrays: dict[int, tuple[int, np.ndarray]] = {}
    tree = json.dumps(_described(value, arrays, _by_name(kinds))).encode()
    places, end = [], 0
    arrays = [array for _, array in arrays.values()]
    for array in arrays:
        # Of what is not yet known much is zero, which takes no bytes.
        held = bool(array.any() or (array.dtype.kind == "f" and np.signbit(array).any()))
        places.append((array.dtype.str, array.shape, end if held else None))
        end += -(-array.nbytes // _ALIGNED) * _ALIGNED if held else 0
    head = json.dumps(places).encode()
    begin = -(-(16 + len(tree) + len(head)) // _ALIGNED) * _ALIGNED
    data = np.empty(begin + end, np.uint8)
    data[:16] = np.array([len(tree), len(head)], "<i8").view(np.uint8)
    data[16 : 16 + len(tree) + len(head)] = np.frombuffer(tree + head, np.uint8)
    for array, (_, _, place) in zip(arrays, places, strict=True):
        if place is None:
            continue
        rows = data[begin + place : begin + place + array.nbytes].view(array.dtype).reshape(array.shape)
        rows[...] = array
    return data


def unpacked(data: np.ndarray, kinds: Iterable[type]):
    """What was :func:`packed` into ``data`` (B,) uint8; its arrays are views of that, or zero.

    Raises ValueError on anything else, and on objects of other classes than ``kinds``.
    """
    data = np.frombuffer(data, np.uint8)
    try:
        tree, head = data[:16].view("<i8").tolist()
        text = data[16 : 16 + tree + head].tobytes()
        begin = -(-(16 + tree + head) // _ALIGNED) * _ALIGNED
        arrays = [_array(data[begin:], *place) for place in json.loads(text[tree:])]
        return _made(json.loads(text[:tree]), arrays, _by_name(kinds))
    except (ValueError, KeyError, IndexError, TypeError, RecursionError, OverflowError, MemoryError) as error:
        raise ValueError("these bytes were not packed so") from error


def _by_name(kinds: Iterable[type]) -> dict[str, type]:
    return {kind.__name__: kind for kind in kinds}


def _array(data: np.ndarray, kind: str, shape: list[int], place: int | None) -> np.ndarray:
    dtype = np.dtype(kind)
    if dtype.kind not in _NUMBERS:
        raise ValueError(kind)
    if place is None:
        return np.zeros(shape, dtype)
    count = int(np.prod(shape, dtype=np.int64))
    return data[place : place + count * dtype.itemsize].view(dtype).reshape(shape)


def _described(value, arrays: dict[int, tuple[int, np.ndarray]], kinds: dict[str, type]):
    """The JSON of ``value``, in which arrays are numbers; ``arrays`` are these and the arrays, by their identities."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray) and value.dtype.kind in _NUMBERS:
        return {"array": arrays.setdefault(id(value), (len(arrays), value))[0]}
    if isinstance(value, tuple | list):
        return [_described(each, arrays, kinds) for each in value]
    if isinstance(value, dict):
        return {"dict": [[str(name), _described(each, arrays, kinds)] for name, each in value.items()]}
    if is_dataclass(value) and kinds.get(type(value).__name__) is type(value):
        return {type(value).__name__: [_described(getattr(value, f.name), arrays, kinds) for f in fields(value)]}
    raise TypeError(type(value).__name__)


def _made(tree, arrays: list[np.ndarray], kinds: dict[str, type]):
    if isinstance(tree, list):
        return tuple(_made(each, arrays, kinds) for each in tree)
    if not isinstance(tree, dict):
        return tree
    ((name, content),) = tree.items()
    if name == "array":
        return arrays[content]
    if name == "dict":
        return {str(key): _made(each, arrays, kinds) for key, each in content}
    kind = kinds[name]
    # All was checked and brought into form when it was made; doing so again would round once more.
    made = object.__new__(kind)
    for field, value in zip(fields(kind), content, strict=True):
        object.__setattr__(made, field.name, _made(value, arrays, kinds))
    return made
