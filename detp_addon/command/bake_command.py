"""``detp bake``: its options, the core's settings that they mean, and the batch that they ask for; without Blender."""

from __future__ import annotations

import argparse
import sys

from ...core.errors import InvalidSettingError
from ...core.settings import DIRECT_LIGHT, ESTIMATORS, GATHERERS, INDIRECT_LIGHT, QUALITIES, BakeSettings
from ..files.find_scenes import find_scenes
from ..files.open_files import plan_outputs, plan_side_files
from .batch import bake_batch
from .jobs import Batch, SceneJob


def add_bake(commands, epilog: str) -> None:
    """Add the subcommand to argparse's ``commands``."""
    bake = commands.add_parser(
        "bake", help="bake scenes and save them", description="Bake each scene's light into its vertex colours.",
        epilog=epilog,
    )  # fmt: skip
    bake.set_defaults(run=_run)
    _add_files(bake)
    add_what(bake)
    _add_parts(bake)
    add_how(bake)


# fmt: off
def _add_files(bake: argparse.ArgumentParser) -> None:
    """What is baked, where it goes, and how many files at a time."""
    add = bake.add_argument
    add("scenes", nargs="+", metavar="SCENE.blend|FOLDER|PATTERN|-", help="scenes to bake, folders of them, patterns "
        "such as 'levels/*.blend', or - for a list on standard input; first in the line")
    add("--recursive", action="store_true", help="look into folders of folders, and keep them in outputs")
    add("-o", dest="output", metavar="FILE.blend|FOLDER", help="where the baked scene goes, for several scenes a "
        "folder (default: <scene>_baked.blend beside each)")
    add("--report", metavar="FILE.json", help="say there what was done, one entry per scene")
    add("--preview", metavar="FILE.png", help="draw the baked colours there; several scenes: FILE_<scene>.png each")
    add("--quiet", action="store_true", help="print errors only")
    add("--jobs", type=int, default=1, metavar="N", help="bake so many files at a time (default: 1); of several files "
        "each has a process of its own")
    add("--resume", action="store_true", help="skip files whose output is there already, of the same content and "
        "options")
    add("--keep", action="store_true", help="keep beside the output what the next run needs to find anew only what "
        "changed in the scene since")
    add("--cluster", metavar="ADDRESS|local", help="have the workers of the Dask scheduler at that address do the "
        "heavy work of each bake; local: a process for each processor of this machine, however little there is to do; "
        "the light is the same")
    add("--time-limit", type=_seconds, metavar="10m", help="give a file up that takes longer than that in all")
    add("--dry-run", action="store_true", help="bake nothing, but say how long each file is likely to take")


def add_what(bake: argparse.ArgumentParser) -> None:
    """Which light of which objects, and in which colours."""
    add = bake.add_argument
    add("--objects", nargs="+", action="extend", metavar="NAME", help="mesh objects to bake (default: all visible)")
    add("--scene", metavar="NAME", help="scene of the file (default: the active one)")
    add("--view-layer", metavar="NAME", help="view layer of the scene (default: the active one)")
    add("--attribute", default="irradiance", metavar="NAME", help="colour attribute (default: irradiance)")
    add("--domain", choices=("corner", "point"), default="corner", help="corner: every face its own light; point: one "
        "colour per vertex (default: corner)")
    add("--fit", choices=("faces", "vertices"), default="faces", help="faces: colours such that faces show their light "
        "between them; vertices: the light at the vertices themselves (default: faces)")
    add("--quantity", choices=("lighting", "irradiance", "shaded", "ambient-occlusion"), default="lighting",
        help="lighting: E/pi, white = 1; irradiance: E in W/m2; shaded: albedo E/pi + emission; ambient-occlusion: "
        "open share of the hemisphere (default: lighting)")
    add("--activate", choices=("on", "off"), default="on", help="make the colours those that viewport and renders "
        "show; off: these stay as they are (default: on)")
    add("--exposure", type=_stops, default=0.0, metavar="STOPS|fit", help="store the light times 2^STOPS; fit: so that "
        "99 %% of a scene's lit colours are 1 or less (default: 0)")
    add("--clamp", action="store_true", help="cut colours at 1, as many formats and engines do")
    add("--storage", choices=("float", "byte"), default="float", help="float: 32 bits a channel; byte: 8, in sRGB "
        "encoding and cut at 1 (default: float)")
    add("--use-in-material", nargs="?", const="auto", choices=("auto", "unlit", "base-color"), metavar="WAY",
        help="put the light into the materials, so that renders show it and glTF exports carry it; unlit: no lamp adds "
        "to it; base-color: it multiplies the base colour; auto: base-color for ambient occlusion, else unlit "
        "(default: auto)")
    add("--ao-distance", type=float, metavar="METRES", help="ambient occlusion: how near a surface must be to occlude "
        "(default: a fifth of the scene's radius)")


def _add_parts(bake: argparse.ArgumentParser) -> None:
    """What a still bake may do besides: other scenes, other faces, and parts of the light apart."""
    add = bake.add_argument
    add("--all-scenes", action="store_true", help="bake every scene of the file that has meshes")
    add("--apply-modifiers", action="store_true", help="apply what changes the faces (Array, Mirror, ...) in the "
        "output, so that every copy has its own light")
    add("--subdivide", type=int, default=0, metavar="TIMES", help="up to so many times, divide the faces of the output "
        "whose light their vertices cannot show (default: 0)")
    add("--split", action="store_true", help="write direct and indirect light also apart, as <attribute>_direct and "
        "<attribute>_indirect")
    add("--by-light", action="store_true", help="write the light of each light group (without any, of each lamp) also "
        "apart, as <attribute>:<group>, for detp mix and the panel's mixer")


def add_how(bake: argparse.ArgumentParser) -> None:
    """How well, how long, and by which of the core's ways."""
    defaults = BakeSettings()
    add = bake.add_argument
    add("--quality", choices=tuple(QUALITIES), default=defaults.quality, help="(default: %(default)s)")
    add("--error", type=_share, metavar="5%", help="bake until half of the lit points are off by less, however long it "
        "takes (default: from the quality)")
    add("--time", type=_seconds, metavar="10s", help="bake each scene for so long, from opening to saving it")
    add("--photons", type=int, metavar="N", help="particles to emit (default: as the error needs)")
    add("--radius", type=float, metavar="METRES", help="of the tangent discs (default: automatic)")
    add("--bounces", type=int, default=defaults.bounces, metavar="N", help="at most (default: %(default)s)")
    add("--direct", choices=DIRECT_LIGHT, help="how light straight from the lights is found (default: shadow-rays; "
        "photons with the plain estimator)")
    add("--indirect", choices=INDIRECT_LIGHT, help="how light over reflections is found (default: gather; photons with "
        "the plain estimator)")
    add("--seed", type=int, default=defaults.seed, metavar="N", help="of the random numbers (default: 0)")
    add("--gatherer", choices=GATHERERS, default=defaults.gatherer, help="all find the same light; auto and hybrid are "
        "disc-index, but where updates place records anew hybrid is sphere-cache (default: %(default)s)")
    add("--estimator", choices=ESTIMATORS, default=defaults.estimator, help="visible: the part of each disc that its "
        "point sees; plain: the whole disc, as in the study of 2006, dark in concave corners (default: %(default)s)")
# fmt: on


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


def bake_settings(options: dict) -> BakeSettings:
    """What the command's ``options``, by name, ask of the core. Raises InvalidSettingError."""
    names = "quality photons error radius bounces seed gatherer estimator direct indirect".split()
    given = {name: options[name] for name in names}
    return BakeSettings(**given, seconds=options["time"], shadow_distance=options["ao_distance"])


def _run(arguments: argparse.Namespace) -> int:
    """Bake as the arguments say; return the exit status. Raises DetpError."""
    options = {name: value for name, value in vars(arguments).items() if name != "run"}
    bake_settings(options)
    if arguments.jobs < 1:
        raise InvalidSettingError(f"At least 1 file must be baked at a time, not {arguments.jobs}.")
    if arguments.time_limit is not None and not arguments.time_limit > 0:
        raise InvalidSettingError(f"The time limit must be above 0 s, not {arguments.time_limit:g}.")
    if arguments.keep and (arguments.all_scenes or arguments.cluster):
        raise InvalidSettingError(
            "Kept are bakes of one scene, by this machine: leave --all-scenes and --cluster away."
        )
    scenes = find_scenes(arguments.scenes, arguments.recursive, getattr(sys.stdin, "buffer", None), arguments.output)
    outputs = plan_outputs(scenes, arguments.output)
    previews, report = plan_side_files(scenes, arguments.preview, arguments.report)
    paths = zip((scene.path for scene in scenes), outputs, previews, strict=True)
    jobs = tuple(SceneJob(*each) for each in paths)
    options["jobs"] = min(arguments.jobs, len(jobs))
    return int(bake_batch(Batch(jobs, options, report)) > 0)
