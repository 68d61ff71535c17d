"""Whether a file just written is all there: full disks, quotas and shares may swallow its end without a word."""

from __future__ import annotations

import os
import struct
import zipfile
import zlib
from pathlib import Path
from typing import BinaryIO

from .blend_blocks import ZSTD, CutShortError, blocks

_PNG = b"\x89PNG\r\n\x1a\n"
#: of the frame at a compressed .blend's end that Blender notes all other frames in, and of its last bytes
_TABLE, _TABLE_END = b"\x5e\x2a\x4d\x18", b"\xb1\xea\x92\x8f"


def check_whole(path: Path) -> None:
    """Raise CutShortError unless the file at ``path`` has the ending and the lengths of its kind, which its name tells.

    Kinds are .blend, .png and .npz; others must not be empty. Raises OSError when it cannot be read.
    """
    with open(path, "rb") as file:
        _CHECKS.get(path.suffix.lower(), _check_other)(file)


def _size(file: BinaryIO) -> int:
    return os.fstat(file.fileno()).st_size


def _check_other(file: BinaryIO) -> None:
    if not file.read(64).strip(b"\0"):
        raise CutShortError("it is empty")


def _check_blend(file: BinaryIO) -> None:
    start = file.read(len(ZSTD))
    file.seek(0)
    if start == ZSTD:
        _check_compressed(file)
        return
    for _ in blocks(file):
        pass
    if file.tell() != _size(file):
        raise CutShortError("its last block is not at its end")


def _check_compressed(file: BinaryIO) -> None:
    """Blender ends with a table of the compressed lengths of all frames (zstd's seekable format)."""
    size = _size(file)
    file.seek(max(0, size - 9))
    end = file.read()
    count, flags = struct.unpack("<IB", end[:5]) if len(end) == 9 else (0, 0)
    entry = 12 if flags & 0x80 else 8
    table = 8 + count * entry + 9
    if end[5:] != _TABLE_END or table > size:
        raise CutShortError("its table of frames is missing")
    file.seek(size - table)
    kind = file.read(8)[:4]
    frames = sum(struct.unpack_from("<I", file.read(entry))[0] for _ in range(count))
    if kind != _TABLE or frames + table != size:
        raise CutShortError("frames are missing")


def _check_png(file: BinaryIO) -> None:
    if file.read(len(_PNG)) != _PNG:
        raise CutShortError("it does not start like a PNG")
    while True:
        head = file.read(8)
        if len(head) < 8:
            raise CutShortError("its last chunk is missing")
        length, kind = struct.unpack(">I4s", head)
        body = file.read(length + 4)
        if len(body) < length + 4 or zlib.crc32(kind + body[:-4]) != int.from_bytes(body[-4:], "big"):
            raise CutShortError("a chunk is not what was written")
        if kind == b"IEND":
            return


def _check_zip(file: BinaryIO) -> None:
    try:
        with zipfile.ZipFile(file) as archive:
            broken = archive.testzip()
    except (zipfile.BadZipFile, zlib.error) as error:
        raise CutShortError(str(error)) from None
    if broken:
        raise CutShortError(f"{broken} is damaged")


_CHECKS = {".blend": _check_blend, ".png": _check_png, ".npz": _check_zip}
