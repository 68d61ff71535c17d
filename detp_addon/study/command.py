"""``detp study``: does the experiments of the study of 2006 with this code and writes what came out."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

from ...core.errors import UnreadableFileError
from ..command.terminal import say
from ..files.write_files import made_folder, write_text
from ..steps import printed

#: the study's own scenes, and the other samples, on which the choice is tried too
SCANS = ("tree", "atrium")


def add_study(commands) -> None:
    """Add the subcommand to argparse's ``commands``."""
    study = commands.add_parser(
        "study", help="do the experiments behind the method again",
        description="Measure both gatherers on the samples Tree and Atrium and in ideal fields, compare with the "
        "theory of the study of 2006, and write study.json, study.md, tables (CSV) and plots (SVG, PNG).",
    )  # fmt: skip
    study.set_defaults(run=_study)
    study.add_argument("-o", dest="output", required=True, metavar="FOLDER", help="where all goes; made if need be")
    study.add_argument("--quick", action="store_true", help="fewer and smaller experiments, under five minutes")
    study.add_argument(
        "--samples", metavar="FOLDER", help="where the sample scenes are (default: sample_blends/ here, or with detp)"
    )
    study.add_argument(
        "--scenes", nargs="+", action="extend", default=[], metavar="SCENE.blend|FOLDER",
        help="further scenes on which to try the choice of the gatherer",
    )  # fmt: skip


def _study(arguments: argparse.Namespace) -> int:
    samples = {path.stem: path for path in _sample_files(arguments.samples)}
    missing = [name for name in SCANS if name not in samples]
    if missing:
        raise UnreadableFileError(f"The sample scenes lack {' and '.join(missing)}: name their folder with --samples.")
    scenes = _scene_files(arguments.scenes)
    further = {path.stem if path.stem not in samples else f"{path.parent.name}/{path.stem}": path for path in scenes}
    folder = made_folder(arguments.output)

    # Everything that can be wrong without Blender has been checked, and Blender takes a second to load.
    from ...core.study.run import QUICK, Extent, run
    from ..command.blender_output import blender_silenced

    with blender_silenced():
        from .scenes import load_study_scene
    from ..tables import as_csv
    from . import report
    from .plots import draw, drawn

    extent = QUICK if arguments.quick else Extent()
    segments = max(extent.scan_segments, extent.choice_segments)
    loaders = {name: partial(load_study_scene, name, path, segments) for name, path in {**samples, **further}.items()}
    found = printed(run({name: loaders.pop(name) for name in SCANS}, loaders, extent))

    pictures = drawn(partial(draw, found, folder))
    texts = {"study.json": report.as_json(found)}
    texts["study.md"] = report.as_markdown(found, "detp study --quick" if arguments.quick else "detp study", pictures)
    texts |= {f"{name}.csv": as_csv(rows) for name, rows in found.tables.items()}
    for name, text in texts.items():
        write_text(folder / name, text)
    say(f"Saved {folder / 'study.md'}, study.json and {len(found.tables)} tables")
    return 0


def _sample_files(folder: str | None) -> list[Path]:
    """The sample scenes, in the folder named, here, or beside the package."""
    if folder is not None:
        return _scene_files([folder])
    for place in (Path("sample_blends"), Path(__file__).parents[2] / "sample_blends"):
        if place.is_dir():
            return sorted(place.glob("*.blend"))
    raise UnreadableFileError(
        "The sample scenes are not here: run this in the folder of the source, or name their folder with --samples."
    )


def _scene_files(names: list[str]) -> list[Path]:
    """The scenes named, and those in the folders named."""
    found: list[Path] = []
    for path in map(Path, names):
        here = sorted(path.glob("*.blend")) if path.is_dir() else [path]
        if not here or not here[0].exists():
            raise UnreadableFileError(f"There is no scene at '{path}': name a .blend file, or a folder with some.")
        found += here
    return found
