"""What an output says of its own bake, so that it need not be done again: of which content, with which settings, how.

It is a custom property of the output's scene, written and renamed with it: an output either is there with its mark, or
it is not there. It is read without Blender.
"""

from __future__ import annotations

import hashlib
import json
import os
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from ...core.errors import UnreadableFileError
from .blend_blocks import LIT_BY, CutShortError, is_special, named_files, sound_blocks
from .whole_files import check_whole

#: the custom property; its text begins with the opening, and Blender keeps it in a block of data of its own
FILE_MARK, _OPENING = "detp_bake", b'{"detp_bake": "'

#: files of more bytes count by their size and time
_LONG = 1 << 32

_MANIFEST = Path(__file__).parents[2] / "blender_manifest.toml"


@dataclass(frozen=True)
class BakeMark:
    """The ``fingerprint`` of what was baked and how, and the ``entries`` of its report."""

    fingerprint: str
    entries: tuple[dict, ...]


def fingerprint(scene: Path, options: dict) -> str:
    """Of the scene's content, of all files that it takes light and geometry from, and of the ``options`` of the bake.

    Files that are missing count as such. Raises UnreadableFileError.
    """
    digest = hashlib.sha256(json.dumps([version(), options], sort_keys=True).encode())
    files = {os.path.realpath(other) for _, other in named_files(scene, LIT_BY)}
    try:
        for path in (scene, *sorted(files)):
            digest.update(_content(path))
    except OSError as error:
        raise UnreadableFileError(f"The file '{scene}' cannot be read: {error.strerror}.") from None
    return digest.hexdigest()


def mark_output(scenes: list, mark: BakeMark) -> None:
    """Leave the mark on the first of the ``scenes`` just baked that can hold it, and on no other of the open file."""
    import bpy

    for scene in bpy.data.scenes:
        if scene.library is None and FILE_MARK in scene:
            del scene[FILE_MARK]
    held = next((scene for scene in scenes if scene.library is None), None)
    if held is not None:
        held[FILE_MARK] = json.dumps({FILE_MARK: mark.fingerprint, "entries": mark.entries})


def read_mark(output: Path) -> BakeMark | None:
    """The mark of an output; None when there is none, or no whole file."""
    if is_special(output) or not output.is_file():
        return None
    with suppress(CutShortError, UnreadableFileError, OSError):
        check_whole(output)
        return next(_marks(output), None)
    return None


def _marks(output: Path) -> Iterator[BakeMark]:
    for _, data in sound_blocks(output, frozenset([b"DATA"])):
        if data.startswith(_OPENING):
            with suppress(ValueError, KeyError, TypeError):  # somebody wrote something else there
                held = json.loads(data.rstrip(b"\0"))
                yield BakeMark(str(held[FILE_MARK]), tuple(dict(entry) for entry in held["entries"]))


def _content(path: str | Path) -> bytes:
    if is_special(path) or not os.path.isfile(path):
        return b"missing"
    found = os.stat(path)
    if found.st_size > _LONG:
        return f"{found.st_size} {found.st_mtime_ns}".encode()
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").digest()


@cache
def version() -> str:
    """Of the program."""
    return tomllib.loads(_MANIFEST.read_text(encoding="utf-8"))["version"]
