"""The ``detp`` command: reads its arguments and starts the work; Blender is loaded only when they are right.

The program that pip installs and ``blender --command detp`` are this one.
"""

from __future__ import annotations

import argparse
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

from ...core.errors import DetpError, InvalidSettingError
from ...core.memory import memory_errors_named
from ...core.settings import DIRECT_LIGHT, ESTIMATORS, GATHERERS, INDIRECT_LIGHT, QUALITIES, BakeSettings
from ..study.command import add_study
from ..tradeoff.command import add_tradeoff
from .blender_output import blender_silenced
from .interrupts import end_on_signals
from .terminal import complain, escaped

DONE, FAILED, USAGE, CANCELLED = 0, 1, 2, 130

_EPILOG = "Exit status: 0 done, 1 at least one scene failed (the others are baked), 2 wrong usage, 130 cancelled."


def main(argv: list[str] | None = None) -> int:
    """Run the command with ``argv`` (the process's own arguments when None) and return its exit status."""
    parser = _parser()
    try:
        arguments = parser.parse_args(argv)
        with memory_errors_named():
            return arguments.run(arguments)
    except SystemExit as exit_request:  # argparse's way of saying --help or wrong usage
        return exit_request.code
    except InvalidSettingError as error:
        complain(f"detp: {error}")
        return USAGE
    except DetpError as error:
        complain(f"detp: {error}")
        return FAILED
    except KeyboardInterrupt:
        complain("detp: cancelled")
        return CANCELLED
    except ModuleNotFoundError as error:
        if error.name != "bpy":
            raise
        complain('detp: Scenes are read with Blender: pip install "detp[blender]", or use "blender --command detp".')
        return FAILED


def register_command():
    """Make ``blender --command detp`` run this program; returns the handle to unregister it with."""
    import bpy

    return bpy.utils.register_cli_command("detp", _inside_blender)


def _inside_blender(argv: list[str]) -> int:
    with suppress(ValueError):  # not in the main thread, where no signal arrives anyway
        end_on_signals(alone=False)
    return main(argv)


def unregister_command(handle) -> None:
    """Take back what :func:`register_command` did."""
    import bpy

    bpy.utils.unregister_cli_command(handle)


class _Parser(argparse.ArgumentParser):
    """Tells wrong usage without letting an argument, such as the name of a strange file, steer the terminal."""

    def error(self, message: str) -> NoReturn:
        super().error(escaped(message))


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="detp", description="Bake global illumination into vertex colours of Blender scenes.", epilog=_EPILOG
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    _add_bake(commands)
    add_study(commands)
    add_tradeoff(commands)
    return parser


def _add_bake(commands) -> None:
    bake = commands.add_parser(
        "bake", help="bake scenes and save them", description="Bake each scene's light into its vertex colours.",
        epilog=_EPILOG,
    )  # fmt: skip
    defaults = BakeSettings()
    bake.set_defaults(run=_bake)
    bake.add_argument("scenes", nargs="+", metavar="SCENE.blend", help="scenes to bake, first in the line")
    bake.add_argument(
        "-o", dest="output", metavar="FILE.blend|FOLDER",
        help="where the baked scene goes, for several scenes a folder (default: <scene>_baked.blend beside each)",
    )  # fmt: skip
    bake.add_argument(
        "--objects", nargs="+", action="extend", metavar="NAME", help="mesh objects to bake (default: all visible)"
    )
    bake.add_argument("--scene", metavar="NAME", help="scene of the file (default: the active one)")
    bake.add_argument("--all-scenes", action="store_true", help="bake every scene of the file that has meshes")
    bake.add_argument("--view-layer", metavar="NAME", help="view layer of the scene (default: the active one)")
    bake.add_argument(
        "--apply-modifiers", action="store_true",
        help="apply what changes the faces (Array, Mirror, ...) in the output, so that every copy has its own light",
    )  # fmt: skip
    bake.add_argument(
        "--attribute", default="irradiance", metavar="NAME", help="colour attribute (default: irradiance)"
    )
    bake.add_argument(
        "--domain", choices=("corner", "point"), default="corner",
        help="corner: every face its own light; point: one colour per vertex (default: corner)",
    )  # fmt: skip
    bake.add_argument(
        "--fit", choices=("faces", "vertices"), default="faces",
        help="faces: colours such that faces show their light between them; vertices: the light at the vertices "
        "themselves (default: faces)",
    )  # fmt: skip
    bake.add_argument(
        "--subdivide", type=int, default=0, metavar="TIMES",
        help="up to so many times, divide the faces of the output whose light their vertices cannot show (default: 0)",
    )  # fmt: skip
    bake.add_argument(
        "--quantity", choices=("lighting", "irradiance", "shaded", "ambient-occlusion"), default="lighting",
        help="lighting: E/pi, white = 1; irradiance: E in W/m2; shaded: albedo E/pi + emission; "
        "ambient-occlusion: open share of the hemisphere (default: lighting)",
    )  # fmt: skip
    bake.add_argument(
        "--split", action="store_true",
        help="write direct and indirect light also apart, as <attribute>_direct and <attribute>_indirect",
    )  # fmt: skip
    bake.add_argument(
        "--activate", choices=("on", "off"), default="on",
        help="make the colours those that viewport and renders show; off: these stay as they are (default: on)",
    )  # fmt: skip
    bake.add_argument(
        "--exposure", type=_stops, default=0.0, metavar="STOPS|fit",
        help="store the light times 2^STOPS; fit: so that 99 %% of a scene's lit colours are 1 or less (default: 0)",
    )  # fmt: skip
    bake.add_argument("--clamp", action="store_true", help="cut colours at 1, as many formats and engines do")
    bake.add_argument(
        "--storage", choices=("float", "byte"), default="float",
        help="float: 32 bits a channel; byte: 8, in sRGB encoding and cut at 1 (default: float)",
    )  # fmt: skip
    bake.add_argument(
        "--use-in-material", nargs="?", const="auto", choices=("auto", "unlit", "base-color"), metavar="WAY",
        help="put the light into the materials, so that renders show it and glTF exports carry it; unlit: no lamp adds "
        "to it; base-color: it multiplies the base colour; auto: base-color for ambient occlusion, else unlit "
        "(default: auto)",
    )  # fmt: skip
    bake.add_argument(
        "--ao-distance", type=float, metavar="METRES",
        help="ambient occlusion: how near a surface must be to occlude (default: a fifth of the scene's radius)",
    )  # fmt: skip
    bake.add_argument("--quality", choices=tuple(QUALITIES), default=defaults.quality, help="(default: %(default)s)")
    bake.add_argument(
        "--error", type=_share, metavar="5%",
        help="bake until half of the lit points are off by less, however long it takes (default: from the quality)",
    )  # fmt: skip
    bake.add_argument(
        "--time", type=_seconds, metavar="10s", help="bake each scene for so long, from opening to saving it"
    )
    bake.add_argument("--photons", type=int, metavar="N", help="particles to emit (default: as the error needs)")
    bake.add_argument("--radius", type=float, metavar="METRES", help="of the tangent discs (default: automatic)")
    bake.add_argument(
        "--bounces", type=int, default=defaults.bounces, metavar="N", help="at most (default: %(default)s)"
    )
    bake.add_argument(
        "--direct",
        choices=DIRECT_LIGHT,
        help="how light straight from the lights is found (default: shadow-rays; photons with the plain estimator)",
    )
    bake.add_argument(
        "--indirect",
        choices=INDIRECT_LIGHT,
        help="how light over reflections is found (default: gather; photons with the plain estimator)",
    )
    bake.add_argument("--seed", type=int, default=defaults.seed, metavar="N", help="of the random numbers (default: 0)")
    bake.add_argument("--gatherer", choices=GATHERERS, default=defaults.gatherer, help="(default: %(default)s)")
    bake.add_argument(
        "--estimator", choices=ESTIMATORS, default=defaults.estimator,
        help="visible: the part of each disc that its point sees; plain: the whole disc, as in the study of 2006, dark "
        "in concave corners (default: %(default)s)",
    )  # fmt: skip
    bake.add_argument("--report", metavar="FILE.json", help="say there what was done, one entry per scene")
    bake.add_argument(
        "--preview", metavar="FILE.png", help="draw the baked colours there; several scenes: FILE_<scene>.png each"
    )
    bake.add_argument("--quiet", action="store_true", help="print errors only")


def _share(text: str) -> float:
    """``5%`` or ``0.05``."""
    number, percent = text.strip().removesuffix("%"), text.strip().endswith("%")
    try:
        return float(number) / (100 if percent else 1)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no error: say 5% or 0.05") from None


def _stops(text: str) -> float | None:
    """``-2``, ``1.5``, or ``fit``, which is None."""
    try:
        return None if text.strip().lower() == "fit" else float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no exposure: say a number of stops such as -2, or fit") from None


def _seconds(text: str) -> float:
    """``90``, ``90s``, ``1.5m`` or ``1h``."""
    units = {"s": 1.0, "m": 60.0, "h": 3600.0}
    number, unit = text.strip().lower(), "s"
    if number[-1:] in units:
        number, unit = number[:-1], number[-1]
    try:
        return float(number) * units[unit]
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no time: say 10s, 1.5m or 1h") from None


def _bake(arguments: argparse.Namespace) -> int:
    from ..files.open_files import plan_outputs, plan_side_files

    settings = BakeSettings(
        quality=arguments.quality,
        photons=arguments.photons,
        error=arguments.error,
        seconds=arguments.time,
        radius=arguments.radius,
        bounces=arguments.bounces,
        seed=arguments.seed,
        gatherer=arguments.gatherer,
        estimator=arguments.estimator,
        direct=arguments.direct,
        indirect=arguments.indirect,
        shadow_distance=arguments.ao_distance,
    )
    scenes = [Path(scene) for scene in arguments.scenes]
    outputs = plan_outputs(scenes, arguments.output)
    previews, report = plan_side_files(scenes, arguments.preview, arguments.report)

    # Everything that can be wrong without Blender has been checked, and Blender takes a second to load.
    with blender_silenced():
        from ..chosen_views import ViewChoice
        from ..job import BakeRequest
        from ..writing.encoding import Encoding
        from .batch import Batch, SceneJob, bake_batch

    request = BakeRequest(
        settings=settings,
        targets=tuple(arguments.objects) if arguments.objects else "visible",
        attribute=arguments.attribute,
        domain=arguments.domain.upper(),
        fit=arguments.fit,
        quantity=arguments.quantity,
        split=arguments.split,
        activate=arguments.activate == "on",
        encoding=Encoding(arguments.exposure, arguments.clamp, arguments.storage),
    )
    if arguments.subdivide and (arguments.fit != "faces" or arguments.subdivide < 0):
        raise InvalidSettingError("Only colours fitted to faces tell which to subdivide, and 0 times or more.")
    jobs = tuple(SceneJob(*paths) for paths in zip(scenes, outputs, previews, strict=True))
    views = ViewChoice(arguments.scene, arguments.view_layer, arguments.all_scenes)
    batch = Batch(
        jobs, request, report, arguments.quiet, views, arguments.apply_modifiers, arguments.subdivide,
        arguments.use_in_material,
    )  # fmt: skip
    return FAILED if bake_batch(batch) else DONE
