"""The blocks of a .blend, without Blender: whether they are sound, and which other files they name.

Blender follows a file of zeros for ever, and opens whatever a scene names, a pipe that nobody writes to as well.
"""

from __future__ import annotations

import gzip
import io
import os
import re
import stat
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from ...core.errors import UnreadableFileError

try:
    import zstandard
except ImportError:  # it comes with Blender, as a module too
    zstandard = None

#: first bytes of a .blend: as it is, or compressed by zstd (Blender 3.0 on) or gzip (before)
PLAIN, ZSTD, GZIP = b"BLENDER", b"\x28\xb5\x2f\xfd", b"\x1f\x8b"

#: blocks of images, libraries, caches and volumes, whose files may change the light
LIT_BY = frozenset(code + b"\0\0" for code in (b"IM", b"LI", b"CF", b"VO"))
#: and of fonts, sounds and clips: Blender opens all files that they name
_NAMING = LIT_BY | {code + b"\0\0" for code in (b"VF", b"SO", b"MC")}
_PATH = re.compile(rb"(?://|/|[A-Za-z]:[\\/])[^\0]+")
_TILE = re.compile("<UDIM>|<UVTILE>")

_UNPACKING_ERRORS = (OSError, EOFError, zlib.error, *([zstandard.ZstdError] if zstandard else []))

#: what no real scene unpacks to: so many times its size, beside so many bytes
_LARGEST_RATIO, _LARGEST_SMALL = 1000, 1 << 30

#: bytes that are unpacked at a time
_PIECE = 1 << 18


class CutShortError(UnreadableFileError):
    """A file ends before its end."""


def check_sound(path: Path) -> None:
    """Raise UnreadableFileError when the scene, or a library it is linked to, would keep Blender busy for ever."""
    for scene, other in named_files(path):
        if is_special(other):
            raise UnreadableFileError(
                f"The scene '{scene}' reads '{other}', which is a pipe or a device: name a file there."
            )


def named_files(path: Path, kinds: frozenset[bytes] = _NAMING) -> Iterator[tuple[Path, Path]]:
    """What blocks of those ``kinds`` name, in a scene and in the libraries it is linked to: (who names it, the path).

    Raises UnreadableFileError on what would keep Blender busy for ever; damage that Blender notices ends the list.
    """
    waiting, known = [path], set()
    while waiting:
        scene = waiting.pop()
        known.add(os.path.realpath(scene))
        for code, data in sound_blocks(scene, kinds):
            for other in _named(data, scene.absolute().parent):
                yield scene, other
                if code.startswith(b"LI") and os.path.isfile(other) and os.path.realpath(other) not in known:
                    waiting.append(other)


def blocks(file: BinaryIO, wanted: set[bytes] = frozenset()) -> Iterator[tuple[bytes, bytes]]:
    """Code and content of the ``wanted`` blocks up to the last, after which ``file`` stands at its end.

    Formats of the future have none. Raises CutShortError, and UnreadableFileError at what is no block.
    """
    header = file.read(12)
    if not header.startswith(PLAIN):
        raise CutShortError("it does not start like a .blend")
    if header[7:9].isdigit():  # since Blender 5
        if header[10:12] != b"01":
            return
        header += file.read(5)
        head = struct.Struct("<4s12xq8x")
    else:
        order = ">" if header[8:9] == b"V" else "<"
        head = struct.Struct(f"{order}4si{4 if header[7:8] == b'_' else 8}x8x")
    while True:
        start = file.read(head.size)
        if len(start) < head.size:
            raise CutShortError("the file ends early")
        code, length = head.unpack(start)
        if not code[:2].isalnum() or length < 0:
            raise UnreadableFileError("it holds what is no block of a .blend")
        if code == b"ENDB":
            return
        if code in wanted:
            yield code, file.read(length)
        else:
            file.seek(length, os.SEEK_CUR)


def sound_blocks(path: Path, wanted: frozenset[bytes]) -> Iterator[tuple[bytes, bytes]]:
    """The ``wanted`` :func:`blocks` of a .blend, compressed or not, as far as it can be read.

    Raises UnreadableFileError on what would keep Blender busy for ever.
    """
    try:
        with open(path, "rb") as file:
            yield from blocks(_Unpacked(file), wanted)
    except (CutShortError, OSError):
        return  # Blender says what it thinks of that
    except UnreadableFileError as error:
        raise UnreadableFileError(f"The file '{path}' is damaged: {error}.") from None


class _Unpacked:
    """A .blend, compressed or not, that is read forward, up to a size that no real scene has."""

    def __init__(self, file: BinaryIO):
        start = file.read(4)
        file.seek(0)
        self._left = _LARGEST_RATIO * os.fstat(file.fileno()).st_size + _LARGEST_SMALL
        self._file, self._plain = file, False
        if start.startswith(GZIP):
            self._file = io.BufferedReader(gzip.GzipFile(fileobj=file), _PIECE)
        elif start == ZSTD and zstandard is not None:
            unpacking = zstandard.ZstdDecompressor().stream_reader(file, read_size=_PIECE, read_across_frames=True)
            self._file = io.BufferedReader(unpacking, _PIECE)
        else:
            self._plain = True

    def read(self, size: int) -> bytes:
        return self._file.read(size) if self._plain else b"".join(self._parts(size))

    def seek(self, size: int, _whence: int) -> None:
        if self._plain:
            self._file.seek(size, os.SEEK_CUR)
        else:
            for _ in self._parts(size):
                pass

    def _parts(self, size: int) -> Iterator[bytes]:
        try:
            while size > 0 and (part := self._file.read(min(size, _PIECE))):
                size -= len(part)
                self._left -= len(part)
                if self._left < 0:
                    raise UnreadableFileError(f"it unpacks to more than {_LARGEST_RATIO} times its size")
                yield part
        except _UNPACKING_ERRORS as error:
            raise CutShortError(str(error)) from None


def _named(data: bytes, folder: Path) -> Iterator[Path]:
    """What in a block looks like the path of a file, the tiles of an image one by one."""
    for found in _PATH.findall(data):
        name = os.fsdecode(found)
        path = Path(os.path.normpath(folder / name[2:] if name.startswith("//") else name))
        if _TILE.search(path.name):
            yield from path.parent.glob(_TILE.sub("*", path.name))
        else:
            yield path


def is_special(path: Path) -> bool:
    """Whether ``path`` is a pipe, a device or the like, which may never start or never end."""
    try:
        kind = os.stat(path).st_mode
    except (OSError, ValueError):  # missing, or no possible name
        return False
    return not (stat.S_ISREG(kind) or stat.S_ISDIR(kind))
