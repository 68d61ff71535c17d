"""A kept bake as a file beside the .blend, so that it can be updated when that is opened again.

The file holds arrays, numbers and names, and never code: it may come from anybody. It is written whole or not at all,
and read only where it is the one that belongs to the bake in the open file, undamaged, and of this version.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import BinaryIO

import bpy
import numpy as np

from ...core.cluster.bench import code_identity
from ...core.errors import NotUpdatableError
from ...core.fit.shown_faces import FacePlaces
from ...core.memory import free_bytes
from ...core.packing import packed, unpacked
from ...core.update.first_bake import KINDS, FirstBake
from ..files.bake_mark import version
from ..files.blend_blocks import CutShortError, is_special
from ..files.write_files import replace_file
from ..reading.kept_places import KeptPlaces
from ..request import BakeRequest
from ..writing.baked_layers import put_mark
from ..writing.encoding import Encoding

#: the custom property of a scene: which kept bake belongs to it
KEPT_MARK = "detp_kept"

#: how such files are called beside the .blend, and how they begin
SUFFIX, _MAGIC = ".detp", b"DETP kept bake 1\n"

#: bytes of the head, in which the opening is followed by JSON and blanks
_HEAD = 512

#: Bytes that are compressed at a time, and how hard: the last digits of numbers are not worth the time.
_CHUNK, _LEVEL = 1 << 22, 1


@dataclass(frozen=True)
class KeptParts:
    """All of a kept bake: of which scene and view layer, what was asked for, and name and bake of each light group."""

    scene: str
    view_layer: str
    request: BakeRequest
    places: KeptPlaces | None
    groups: tuple[str, ...]
    bakes: tuple[FirstBake, ...]


_KINDS = (*KINDS, BakeRequest, Encoding, FacePlaces, KeptParts, KeptPlaces)


def new_identity() -> str:
    """A name that no other kept bake has."""
    return secrets.token_hex(16)


def file_beside(blend: str) -> Path:
    """Where the kept bake of the file ``blend`` lies."""
    return Path(blend).with_suffix(SUFFIX)


def note_kept(scene: bpy.types.Scene, identity: str | None) -> None:
    """Note in ``scene``, unless it is linked, the ``identity`` of its kept bake in a file; None where there is none."""
    if scene.library is None:
        put_mark(scene, identity, KEPT_MARK)


def write_kept(path: Path, parts: KeptParts, identity: str) -> int:
    """Write the kept bake of that ``identity``; returns the bytes of the file. Raises as :func:`.replace_file`."""
    data = packed(parts, _KINDS)

    def write(made: Path) -> None:
        digest, length = hashlib.sha256(), _HEAD
        with open(made, "wb") as file:
            file.write(bytes(_HEAD))
            for chunk in _compressed(data):
                digest.update(chunk)
                length += file.write(chunk)
            head = {"version": _version(), "identity": identity, "bytes": len(data), "sha256": digest.hexdigest()}
            file.seek(0)
            file.write((_MAGIC + json.dumps(head).encode()).ljust(_HEAD))
        if os.path.getsize(made) != length:
            raise CutShortError("its end is missing")

    replace_file(path, write, len(data))
    return os.path.getsize(path)


def read_kept(path: Path, identity: str) -> KeptParts:
    """The kept bake of that ``identity``. Raises NotUpdatableError, which says why it is of no use."""
    name = f"'{path.name}'"
    if is_special(path):
        raise NotUpdatableError(f"{name} is no kept bake")
    try:
        with open(path, "rb") as file:
            head = _head(file.read(_HEAD))
            if head is None:
                raise NotUpdatableError(f"{name} is no kept bake")
            if head["identity"] != identity:
                raise NotUpdatableError(f"{name} was kept of another bake")
            if head["version"] != _version():
                raise NotUpdatableError(f"{name} was kept by another version")
            free = free_bytes()
            if free is not None and head["bytes"] > free:
                raise NotUpdatableError(f"{name} takes more memory than is free")
            data = _decompressed(file, head)
    except MemoryError:
        raise NotUpdatableError(f"{name} takes more memory than is free") from None
    except FileNotFoundError:
        raise NotUpdatableError(f"{name}, which was kept for it, is missing") from None
    except OSError as error:
        raise NotUpdatableError(f"{name} cannot be read: {error.strerror}") from None
    try:
        parts = None if data is None else unpacked(data, _KINDS)
    except ValueError:
        parts = None
    if not isinstance(parts, KeptParts):
        raise NotUpdatableError(f"{name} is damaged")
    return parts


def _head(begin: bytes) -> dict | None:
    """What the head of a file says, None where it is none."""
    if not begin.startswith(_MAGIC):
        return None
    try:
        head = json.loads(begin[len(_MAGIC) :])
        names = ("identity", str), ("version", str), ("bytes", int), ("sha256", str)
        return head if all(isinstance(head[name], kind) for name, kind in names) and head["bytes"] >= 0 else None
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


def _compressed(data: np.ndarray) -> Iterator[bytes]:
    """The ``data`` (B,) uint8 in compressed pieces."""
    encoder = zlib.compressobj(_LEVEL)
    for begin in range(0, len(data), _CHUNK):
        yield encoder.compress(data[begin : begin + _CHUNK])
    yield encoder.flush()


def _decompressed(file: BinaryIO, head: dict) -> np.ndarray | None:
    """The bytes that were compressed into the rest of a ``file``; None where they are not those of its ``head``."""
    data, digest, decoder, filled = np.empty(head["bytes"], np.uint8), hashlib.sha256(), zlib.decompressobj(), 0
    while piece := file.read(_CHUNK):
        digest.update(piece)
        try:
            # No more is taken than there should be, whatever a small file may swell to.
            some = np.frombuffer(decoder.decompress(piece, len(data) - filled + 1), np.uint8)
        except zlib.error:
            return None
        if filled + len(some) > len(data):
            return None
        data[filled : filled + len(some)] = some
        filled += len(some)
    return data if filled == len(data) and digest.hexdigest() == head["sha256"] else None


@cache
def _version() -> str:
    return f"{version()} {code_identity()[:16]}"
