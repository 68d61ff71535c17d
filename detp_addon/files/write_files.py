"""Outputs: made under a temporary name, looked at, and only then put in the place of what was there."""

from __future__ import annotations

import errno
import os
import shutil
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path

from ...core.errors import DetpError, DiskFullError, InvalidSettingError, UnreadableFileError, UnwritableFileError
from ..command.terminal import harmless
from .blend_blocks import CutShortError, is_special
from .leftovers import temporary_name
from .whole_files import check_whole

#: how systems say that nothing more goes there: no space, no quota, a limit on the size of files
_FULL = {errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", errno.ENOSPC)}

#: where Linux is told the user's folder of caches
_CACHES = "XDG_CACHE_HOME"

_WRITE = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH

#: room to look for when something failed and nobody said why
_ROOM = 1 << 20


def check_writable(path: Path) -> None:
    """Raise UnwritableFileError unless a file can be made at ``path``; found out by making one in its folder."""
    place = _target(path)
    if place.is_dir():
        raise UnwritableFileError(f"Cannot write '{path}': it is a folder.")
    # An administrator may write to any file, but somebody has protected this one.
    if place.exists() and not (os.access(place, os.W_OK) and place.stat().st_mode & _WRITE):
        raise UnwritableFileError(f"Cannot write '{path}': the file is write-protected.")
    folder = place.parent
    while not folder.exists():
        folder = folder.parent
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise _unwritable(path, error) from None


def made_folder(name: str) -> Path:
    """The folder of that name, made if need be; raises InvalidSettingError or UnwritableFileError."""
    folder = Path(name)
    if folder.exists() and not folder.is_dir():
        raise InvalidSettingError(f"'{folder}' is a file: name a folder with -o.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UnwritableFileError(f"The folder '{folder}' cannot be made: {error.strerror}.") from error
    return folder


def replace_file(path: Path, write: Callable[[Path], None], room: int = 0) -> None:
    """Let ``write`` make a file beside ``path``, look whether it is whole, then rename it; missing folders are made.

    Whatever interrupts it, ``path`` is either the whole new file or what it was; a link stays a link. ``room`` is
    about the bytes that are needed: with less, a failure is put down to the disk. Raises DiskFullError or
    UnwritableFileError, and what ``write`` raises of DetpError.
    """
    place = _target(path)
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with temporary_name(place.parent, path.suffix or ".part") as made:
            try:
                write(made)
                # Some disks write it to where it lies only now, or find that they cannot.
                with open(made, "r+b") as file:
                    os.fsync(file.fileno())
                check_whole(made)
                if place.exists():
                    shutil.copymode(place, made)
                os.replace(made, place)
            except (OSError, DetpError):
                if _is_full(place.parent, room):
                    raise DiskFullError(_full(path)) from None
                raise
    except UnreadableFileError as error:
        raise UnwritableFileError(f"Cannot write '{path}': what arrived there is not whole, {error}.") from None
    except OSError as error:
        raise _unwritable(path, error) from None


def write_text(path: Path, text: str) -> None:
    """Replace the file at ``path`` by ``text`` in UTF-8, without what would steer a terminal that shows it.

    Raises as :func:`replace_file` does.
    """
    content = harmless(text).encode("utf-8")

    def write(made: Path) -> None:
        made.write_bytes(content)
        if made.read_bytes() != content:
            raise CutShortError("it is shorter than what was written")

    replace_file(path, write, len(content))


def save_blend(path: Path, compress: bool) -> None:
    """Save a copy of the open file at ``path``, with its relative paths made right for that place.

    Raises DiskFullError or UnwritableFileError.
    """
    import bpy

    def write(made: Path) -> None:
        # Thumbnails of names that are temporary would fill the user's own folder.
        kept, os.environ[_CACHES] = os.environ.get(_CACHES), bpy.app.tempdir
        try:
            bpy.ops.wm.save_as_mainfile(
                filepath=str(made), copy=True, relative_remap=True, compress=compress, check_existing=False
            )
        except RuntimeError as error:
            raise UnwritableFileError(f"Blender cannot write '{path}': {reason(error)}.") from None
        finally:
            del os.environ[_CACHES]
            os.environ.update({} if kept is None else {_CACHES: kept})

    source = bpy.data.filepath
    # The bake adds its colours to what the scene was.
    replace_file(path, write, 2 * os.path.getsize(source) if os.path.exists(source) else 0)


def reason(error: RuntimeError) -> str:
    """The heart of Blender's message: no prefix, no repeated file name, no full stop."""
    return str(error).strip().splitlines()[0].rpartition(": ")[2].rstrip(".")


def _target(path: Path) -> Path:
    """Where ``path`` leads over links; raises UnwritableFileError when something is there that is no file."""
    place = Path(os.path.realpath(path))
    if is_special(place):
        raise UnwritableFileError(f"Cannot write '{path}': it is a pipe or a device, not a file.")
    return place


def _is_full(folder: Path, room: int) -> bool:
    """Whether so many bytes and a few more find no place, for the disk, a quota or a limit."""
    try:
        with tempfile.TemporaryFile(dir=folder) as probe:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(probe.fileno(), 0, room + _ROOM)
            return False
    except OSError as error:
        return error.errno in _FULL


def _unwritable(path: Path, error: OSError) -> UnwritableFileError:
    if error.errno in _FULL:
        return DiskFullError(_full(path))
    return UnwritableFileError(f"Cannot write '{path}': {error.strerror or error}.")


def _full(path: Path) -> str:
    return f"Cannot write '{path}': the disk is full, or a quota or limit is reached."
