"""``detp mix``: the lights of a baked file made stronger, weaker or of another colour."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from ...core.errors import InvalidSettingError

#: a name, which may hold commas, and one number or three
_PAIR = re.compile(r"(?P<name>.+?)=(?P<numbers>[^=,:]+(?::[^=,:]+){2}|[^=,:]+)(?:,|$)")


def add_mix(commands) -> None:
    """Add the subcommand to argparse's ``commands``."""
    mix = commands.add_parser(
        "mix", help="mix the lights of a file that was baked by light",
        description="Mix the light of a file that was baked with --by-light anew, without baking. Groups that are not "
        "named stay as they are.",
    )  # fmt: skip
    mix.set_defaults(run=_run)
    mix.add_argument("file", metavar="FILE.blend", help="a file baked with detp bake --by-light")
    mix.add_argument(
        "--gain", type=_gains, action="append", default=[], metavar="GROUP=G|R:G:B,...",
        help="multiply the light of each group by a number, or by one for red, green and blue, as in "
        "Key=2,Fill=1:.8:.5; without it the groups are listed",
    )  # fmt: skip
    mix.add_argument("-o", dest="output", metavar="FILE.blend", help="where the mixed file goes; may be the same file")
    mix.add_argument("--attribute", default="irradiance", metavar="NAME", help="(default: irradiance)")
    mix.add_argument("--scene", metavar="NAME", help="scene of the file (default: the active one)")


def _gains(text: str) -> dict[str, tuple[float, float, float]]:
    """``Key=2,Fill=1:0.8:0.5`` as numbers for red, green and blue by group."""
    pairs = list(_PAIR.finditer(text))
    try:
        if not pairs or "".join(pair.group() for pair in pairs) != text:
            raise ValueError
        numbers = [[float(each) for each in pair["numbers"].split(":")] for pair in pairs]
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no mixture: say Key=2, or Key=2,Fill=1:0.8:0.5") from None
    return {
        pair["name"]: tuple(each * 3 if len(each) == 1 else each) for pair, each in zip(pairs, numbers, strict=True)
    }


def _run(arguments: argparse.Namespace) -> int:
    gains = {name: gain for each in arguments.gain for name, gain in each.items()}
    if gains and arguments.output is None:
        raise InvalidSettingError("Say with -o where the mixed file goes.")

    from ..command.blender_output import blender_silenced

    with blender_silenced():
        from ..chosen_views import ViewChoice, chosen_views
        from ..files.open_files import check_readable, is_compressed, open_blend
        from ..files.write_files import check_writable, save_blend
        from .mix import mix
    from ..command.terminal import say

    source = Path(arguments.file)
    check_readable(source)
    if gains:
        check_writable(Path(arguments.output))
    compressed = is_compressed(source)
    with blender_silenced():
        open_blend(source)
    [(scene, _)] = chosen_views(ViewChoice(arguments.scene))
    found = mix(scene.objects, arguments.attribute, gains)
    if gains:
        with blender_silenced():
            save_blend(Path(arguments.output), compressed)
    for name, gain in found.items():
        say(f"{name}: " + (f"{gain[0]:g}" if len(set(gain)) == 1 else ":".join(f"{channel:g}" for channel in gain)))
    if gains:
        say(f"Saved {arguments.output}")
    return 0
