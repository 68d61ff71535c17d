"""Scene files and where their outputs go: checked before the work, opened without running scripts."""

from __future__ import annotations

import os
from pathlib import Path

from ...core.errors import InvalidSettingError, UnreadableFileError
from .blend_blocks import GZIP, PLAIN, ZSTD, check_sound, is_special
from .find_scenes import BAKED, FoundScene
from .write_files import reason


def plan_outputs(scenes: list[FoundScene], output: str | None) -> list[Path]:
    """The file that each scene's bake goes to.

    ``output`` is None for ``<scene>_baked.blend`` beside each scene, a .blend file when there is one scene, or a
    folder, in which the scenes' own folders are kept. Raises InvalidSettingError when two bakes would meet in one
    file, or one would overwrite a scene that ``output`` does not name.
    """
    several = len(scenes) > 1
    if output is None:
        outputs = [scene.path.with_name(f"{scene.path.stem}{BAKED}") for scene in scenes]
    elif os.path.isdir(output) or output.endswith(("/", os.sep)) or (several and not _is_blend(output)):
        outputs = [Path(output) / scene.folder / f"{scene.path.stem}{BAKED}" for scene in scenes]
    elif several:
        raise InvalidSettingError(f"{len(scenes)} scenes cannot go into the one file '{output}': name a folder.")
    elif not _is_blend(output):
        raise InvalidSettingError(
            f"'{output}' is neither a .blend file nor a folder: add '.blend', or a '/' at the end."
        )
    else:
        return [Path(os.path.realpath(output))]
    inputs = {_place(scene.path): scene.path for scene in scenes}
    sources = {}
    for scene, path in zip(scenes, outputs, strict=True):
        target = _place(path)
        if target in inputs:
            raise InvalidSettingError(
                f"The bake of '{scene.path}' would overwrite the scene '{inputs[target]}': name a folder with -o."
            )
        if target in sources:
            raise InvalidSettingError(
                f"'{sources[target]}' and '{scene.path}' would both be written to '{path}': bake them one by one, or "
                f"name the folder that holds both, with --recursive."
            )
        sources[target] = scene.path
    return outputs


def plan_side_files(
    scenes: list[FoundScene], preview: str | None, report: str | None
) -> tuple[list[Path | None], Path | None]:
    """Each scene's picture, with the scene's name added when there are several, and the report's file.

    The scenes' own folders are kept. Raises InvalidSettingError when they are not named as what they are, or would
    overwrite each other.
    """
    previews = [None] * len(scenes)
    if preview is not None:
        path = _suffixed(preview, ".png")
        previews = [path]
        if len(scenes) > 1:
            previews = [path.parent / each.folder / f"{path.stem}_{each.path.stem}{path.suffix}" for each in scenes]
        if len({_place(each) for each in previews}) < len(previews):
            raise InvalidSettingError(
                "Two scenes have the same name, so their previews would too: bake them one by one, or name the folder "
                "that holds both, with --recursive."
            )
    return previews, None if report is None else _suffixed(report, ".json")


def _place(path: Path) -> str:
    """Equal for equal files, on systems that tell capitals apart and on those that do not."""
    return os.path.normcase(os.path.realpath(path))


def _suffixed(path: str, suffix: str) -> Path:
    if not path.lower().endswith(suffix):
        raise InvalidSettingError(f"'{path}' must end in {suffix}.")
    return Path(path)


def check_readable(path: Path) -> None:
    """Raise UnreadableFileError unless ``path`` is a file that starts like a .blend."""
    if is_special(path):
        raise UnreadableFileError(f"'{path}' is a pipe or a device, not a .blend file.")
    try:
        with open(path, "rb") as file:
            start = file.read(len(PLAIN))
    except FileNotFoundError:
        raise UnreadableFileError(f"The file '{path}' does not exist.") from None
    except IsADirectoryError:
        raise UnreadableFileError(f"'{path}' is a folder, not a .blend file.") from None
    except OSError as error:
        raise UnreadableFileError(f"The file '{path}' cannot be read: {error.strerror}.") from None
    if not start:
        raise UnreadableFileError(f"The file '{path}' is empty.")
    if not start.startswith((PLAIN, ZSTD, GZIP)):
        raise UnreadableFileError(f"The file '{path}' is not a .blend file.")


def open_blend(path: Path) -> list[str]:
    """Open a scene file, its window layout too (so that saving keeps it), without its scripts; return warnings.

    Nothing in it is in Edit Mode any more. Raises UnreadableFileError.
    """
    import bpy

    from ..reading.edit_mode import opened_from_edit_mode

    check_readable(path)
    check_sound(path)
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.absolute()), load_ui=True, use_scripts=False)
    except RuntimeError as error:
        raise UnreadableFileError(f"Blender {bpy.app.version_string} cannot open '{path}': {reason(error)}.") from None
    warnings = opened_from_edit_mode()
    if bpy.data.version[:2] > bpy.app.version[:2]:
        newer = ".".join(str(part) for part in bpy.data.version[:2])
        warnings.append(
            f"The file was saved by Blender {newer}, which is newer than this Blender "
            f"{bpy.app.version_string}: what the older one does not know is missing from the bake and its output."
        )
    if bpy.app.autoexec_fail:
        warnings.append("The file's scripts were not run: what its Python drivers would set may be missing.")
    for library in bpy.data.libraries:
        if library.is_missing:
            warnings.append(f"The linked library '{library.filepath}' was not found, so its objects are missing.")
    return warnings


def is_compressed(path: Path) -> bool:
    """Whether a .blend is compressed, so that its bake can be alike."""
    with open(path, "rb") as file:
        return file.read(4).startswith((ZSTD, GZIP))


def _is_blend(path: str) -> bool:
    return path.lower().endswith(".blend")
