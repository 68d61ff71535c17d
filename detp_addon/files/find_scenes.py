"""The scene files that a command's arguments mean: files, folders, patterns, and a list on standard input."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import BinaryIO

from ...core.errors import InvalidSettingError

#: what an output is named after its scene, and the most bytes that a list of scenes may have
BAKED, LONGEST_LIST = "_baked.blend", 1 << 26


@dataclass(frozen=True)
class FoundScene:
    """A scene's ``path``, and the ``folder`` that its outputs keep, below the one that the search began in."""

    path: Path
    folder: Path = Path()


def find_scenes(
    names: Iterable[str], recursive: bool, listed: BinaryIO | None, output: str | None = None
) -> list[FoundScene]:
    """The scenes that ``names`` mean, each once, in their order; what a folder holds in alphabetical order.

    A name is a .blend file, a folder of them, a pattern such as ``levels/*.blend``, or ``-`` for a list of files and
    folders on ``listed``, one a line or each ended by a zero byte. ``recursive`` goes into folders of folders, and
    lets ``**`` in a pattern stand for any folders. Hidden files, bakes that lie beside their scenes, and the folder
    ``output`` below one that is searched are left out. Raises InvalidSettingError where no scene is found.
    """
    found: dict[str, FoundScene] = {}
    for name in names:
        if name == "-":
            scenes = [scene for each in _listed(listed) for scene in _in_place(each, recursive, output)]
            if not scenes:
                raise InvalidSettingError("The list on standard input names no scene.")
        elif not os.path.lexists(name) and glob.has_magic(name):
            scenes = list(_matching(name, recursive, output))
        else:
            scenes = list(_in_place(name, recursive, output))
        for scene in scenes:
            found.setdefault(os.path.realpath(scene.path), scene)
    return list(found.values())


def _in_place(name: str, recursive: bool, output: str | None) -> Iterator[FoundScene]:
    """The file ``name``, or what is in the folder of that name."""
    if not os.path.isdir(name) or name.lower().endswith(".blend"):
        yield FoundScene(Path(name))
        return
    root, none = Path(name), True
    for scene in _below(root, recursive, output):
        none = False
        yield FoundScene(scene, scene.parent.relative_to(root))
    if none:
        deeper = "" if recursive else "; --recursive looks into its folders as well"
        raise InvalidSettingError(f"The folder '{name}' holds no .blend file to bake{deeper}.")


def _below(root: Path, recursive: bool, output: str | None) -> Iterator[Path]:
    out = None if output is None else os.path.realpath(output)
    for folder, deeper, files in os.walk(root):
        deeper[:] = sorted(
            name
            for name in deeper
            if recursive and not name.startswith(".") and os.path.realpath(os.path.join(folder, name)) != out
        )
        yield from (Path(folder, name) for name in sorted(files) if _is_scene(name, files))


def _matching(pattern: str, recursive: bool, output: str | None) -> Iterator[FoundScene]:
    fixed = Path(*takewhile(lambda part: not glob.has_magic(part), Path(pattern).parts[:-1]))
    paths = [Path(match) for match in sorted(glob.glob(pattern, recursive=recursive))]
    names: dict[Path, set[str]] = {}
    for path in paths:
        names.setdefault(path.parent, set()).add(path.name)
    scenes = [
        path
        for path in paths
        if path.is_file() and _is_scene(path.name, names[path.parent]) and not _is_below(path, output, fixed)
    ]
    if not scenes:
        raise InvalidSettingError(f"No .blend file is named like '{pattern}'.")
    for path in scenes:
        yield FoundScene(path, path.parent.relative_to(fixed) if recursive else Path())


def _is_below(path: Path, output: str | None, root: Path) -> bool:
    """Whether the file lies in the folder ``output``, and that lies below ``root``."""
    out = None if output is None else Path(os.path.realpath(output))
    return out in Path(os.path.realpath(path)).parents and Path(os.path.realpath(root)) in out.parents


def _is_scene(name: str, beside: Iterable[str]) -> bool:
    """Whether a file of that name is a scene and no bake of one ``beside`` it."""
    if name.startswith(".") or not name.lower().endswith(".blend"):
        return False
    return not (name.endswith(BAKED) and f"{name.removesuffix(BAKED)}.blend" in beside)


def _listed(file: BinaryIO | None) -> list[str]:
    content = b"" if file is None else file.read(LONGEST_LIST + 1)
    if len(content) > LONGEST_LIST:
        raise InvalidSettingError("The list on standard input does not end: give one path a line.")
    lines = content.split(b"\0") if b"\0" in content else content.splitlines()
    return [os.fsdecode(line) for line in lines if line.strip()]
