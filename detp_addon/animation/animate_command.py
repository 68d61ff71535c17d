"""``detp bake-animation``: its arguments, checked before Blender is loaded."""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

from ...core.errors import InvalidSettingError
from ..command.bake_command import add_how, add_what, bake_settings
from .frames import Frames

_RANGE = re.compile(r"(-?\d+)(?:-|\.\.|:)(-?\d+)")


# fmt: off
def add_bake_animation(commands) -> None:
    """Add the subcommand to argparse's ``commands``."""
    bake = commands.add_parser(
        "bake-animation", help="bake the light of a scene over frames, which then plays in Blender",
        description="Bake each frame's light into the vertex colours of a scene, so that it plays back.",
    )
    bake.set_defaults(run=_run, split=False, by_light=False, subdivide=0, cluster=None, jobs=1)
    add = bake.add_argument
    add("scene_file", metavar="SCENE.blend")
    add("--frames", type=_range, required=True, metavar="A-B", help="the first and the last frame")
    add("--every", type=int, default=1, metavar="N", help="bake every so many frames, and the last; the light of those "
        "between is blended (default: 1)")
    add("--moving-only", action="store_true", help="bake objects that do not move once, at the first frame: they show "
        "no shadow or light of those that do")
    add("--whole", action="store_true", help="bake each frame as a whole, though it may be an update of the first: "
        "exactly what a still bake gives")
    add("-o", dest="output", metavar="OUT.blend", help="where it goes (default: <scene>_animated.blend beside it)")
    add("--texture", metavar="FILE.exr", help="also write the light for engines: a texture of vertices by frames, "
        "FILE.json that says how it is read, and a UV map in the output that points into it")
    add("--report", metavar="FILE.json", help="say there what was done")
    add("--quiet", action="store_true", help="print errors only")
    add("--dry-run", action="store_true", help="bake nothing, but say how long it is likely to take")
    add_what(bake)
    add_how(bake)
# fmt: on


def _range(text: str) -> tuple[int, int]:
    found = _RANGE.fullmatch(text.strip())
    if found is None:
        raise argparse.ArgumentTypeError(f"'{text}' is no range of frames: say 1-48")
    return int(found[1]), int(found[2])


def _run(arguments: argparse.Namespace) -> int:
    options = {name: value for name, value in vars(arguments).items() if name != "run"}
    bake_settings(options)
    frames = Frames(*arguments.frames, arguments.every)
    source = Path(arguments.scene_file)
    output = Path(arguments.output or source.with_name(f"{source.stem}_animated.blend"))
    if output.suffix.lower() != ".blend":
        raise InvalidSettingError(f"The output '{output}' must be a .blend file.")
    if arguments.texture is not None and Path(arguments.texture).suffix.lower() != ".exr":
        raise InvalidSettingError(f"The texture '{arguments.texture}' must be an .exr file, which holds any light.")

    # Everything that can be wrong without Blender has been checked, and Blender takes a second to load.
    from ..command.blender_output import blender_silenced
    from ..command.progress import ProgressDisplay

    with blender_silenced():
        from .animate_file import animate_file
    display = ProgressDisplay(sys.stdout, arguments.quiet)
    try:
        animate_file(source, output, options, frames, display)
    finally:
        display.end()
    return 0
