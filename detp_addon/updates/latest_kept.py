"""The one bake that is kept for updates: the latest, since each may take much memory; with its file by the .blend."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import bpy

from ...core.errors import DetpError
from ...core.memory import memory_errors_named
from .kept_bake import KeptBake
from .kept_file import KEPT_MARK, file_beside, note_kept, write_kept

_latest: KeptBake | None = None
#: where the latest is written, and as which one
_written: tuple[Path, str] | None = None
#: how it stands with its file, in words
_note = ""


def kept_of(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> KeptBake | None:
    """What is kept in memory of ``scene`` as ``view_layer`` shows it."""
    return _latest if _latest is not None and _latest.of(scene, view_layer) else None


def may_be_read(scene: bpy.types.Scene) -> bool:
    """Whether a kept bake of ``scene`` was written beside the open file."""
    return KEPT_MARK in scene and bool(bpy.data.filepath)


def read_again(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> KeptBake | None:
    """What is kept beside the open file of ``scene`` as ``view_layer`` shows it, None where nothing is said to be.

    Raises NotUpdatableError, which says why it is of no use.
    """
    global _latest, _written
    if not may_be_read(scene):
        return None
    path, identity = file_beside(bpy.data.filepath), str(scene[KEPT_MARK])
    found = KeptBake.in_file(path, identity, scene, view_layer)
    _latest, _written = found, (path, identity)
    return found


def begin(kept: KeptBake | None) -> None:
    """A bake begins: what was kept of an earlier one is dropped, unless it updates that."""
    if kept is not _latest:
        forget()


def keep(kept: KeptBake | None, scene: bpy.types.Scene) -> None:
    """A bake of ``scene`` is done: keep of it what can be updated; saving the .blend writes it, if that is wished."""
    global _latest
    _latest = kept or None
    note_kept(scene, _latest.identity if _latest is not None and _latest.on_disk else None)


def write_beside(blend: str) -> None:
    """The file ``blend`` was saved: write what is kept of one of its scenes beside it, where it is not there yet."""
    global _written, _note
    if _latest is None or not _latest.on_disk or not blend:
        return
    path, identity = file_beside(blend), _latest.identity
    if not any(scene.get(KEPT_MARK) == identity for scene in bpy.data.scenes):
        return  # an undo has taken its bake back
    if _written == (path, identity) and path.exists():
        return
    try:
        with memory_errors_named():
            size = write_kept(path, _latest.parts, identity)
    except DetpError as error:
        _note = f"Not kept beside the file: {error}"
    else:
        _written, _note = (path, identity), f"Kept in {path.name}, {size / 1e6:.0f} MB"


def note_of_file(scene: bpy.types.Scene) -> str:
    """How it stands with the file of what is kept of ``scene``: its size, that it is still to be written, or why it
    cannot be; empty without any."""
    if not may_be_read(scene):
        return "Save the file to keep this bake beside it" if KEPT_MARK in scene else ""
    return _note


def look_for_file() -> None:
    """A file was opened: note how large what is kept beside it is."""
    global _note
    path, _note = file_beside(bpy.data.filepath or "none"), ""
    with suppress(OSError):
        _note = f"Kept in {path.name}, {path.stat().st_size / 1e6:.0f} MB"


def forget() -> None:
    """Keep nothing in memory."""
    global _latest, _written
    _latest = _written = None
