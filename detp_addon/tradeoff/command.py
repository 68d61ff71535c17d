"""``detp tradeoff``: measures on one scene what error each kind of bake gives in what time, beside Cycles."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

from ..command.terminal import escaped, say
from ..files.open_files import check_readable
from ..files.write_files import made_folder
from ..steps import printed
from .candidates import GROUPS, NAMES

#: (most samples of the reference in each half, its noise that is small enough, runs, Cycles' samples, corners)
_FULL = (2048, 0.01, 3, "1,4,16,64", 3000)
_QUICK = (256, 0.03, 1, "1,4", 1000)

#: a bake of Cycles ends after them
CYCLES_SECONDS = 60


# fmt: off
def add_tradeoff(commands) -> None:
    """Add the subcommand to argparse's ``commands``."""
    tradeoff = commands.add_parser(
        "tradeoff", help="measure error against time on a scene, beside Cycles",
        description="Bake a scene with both gatherers, several radii and numbers of photons, the qualities, targets, "
        "and with Cycles, compare all with a converged reference, and write tradeoff.md, tradeoff.json, tradeoff.csv "
        "and plots (SVG, PNG). The scene itself is not changed.",
    )
    tradeoff.set_defaults(run=_tradeoff)
    add = tradeoff.add_argument
    add("scene", metavar="SCENE.blend")
    add("-o", dest="output", required=True, metavar="FOLDER", help="where all goes; made if need be")
    add("--quick", action="store_true", help="fewer bakes, one run of each, a rougher reference")
    add("--reference", metavar="FILE.npz", help="keep the reference there, and take it from there next time (default: "
        "FOLDER/reference_<scene's key>.npz)")
    add("--reference-samples", type=_count, metavar="N", help="at most, in each of its halves")
    add("--samples", type=_counts, metavar="N,N,...", help="of Cycles' bakes")
    add("--points", type=_count, metavar="N", help="face corners to compare at, about")
    add("--runs", type=_count, metavar="N", help="of each bake, whose medians are told")
    names = ", ".join(NAMES).replace("%", "%%")
    add("--bakes", type=_names, metavar="NAME,...", help=f"of {names} (default: all)")
    add("--cycles-seconds", type=_count, metavar="S", help="end a bake of Cycles after that, "
        f"and tell its time from the objects it reached (default: {CYCLES_SECONDS})")
    add("--no-cycles", action="store_true", help="without Cycles' bakes; the reference is still its own")
# fmt: on


def _tradeoff(arguments: argparse.Namespace) -> int:
    scene = Path(arguments.scene)
    check_readable(scene)
    folder = made_folder(arguments.output)
    samples, noise, runs, counts, points = _QUICK if arguments.quick else _FULL
    samples = arguments.reference_samples or samples
    cycles = () if arguments.no_cycles else arguments.samples or _counts(counts)

    # Everything that can be wrong without Blender has been checked, and Blender takes a second to load.
    from ..command.blender_output import blender_silenced

    with blender_silenced():
        from ..files.open_files import open_blend
        from ..study.plots import drawn
        from . import report
        from .candidates import candidates, cycles_runs
        from .figures import findings
        from .plots import draw
        from .reference import converged_reference, reference_key
        from .runs import one_round
        from .scene import compared_scene

        warnings = open_blend(scene)
    machine = report.machine()
    compared = printed(compared_scene(arguments.points or points))
    warnings = [*warnings, *compared.warnings]
    for warning in compared.warnings:
        say(f"Warning: {warning}")
    key = reference_key(scene, compared)
    kept = Path(arguments.reference) if arguments.reference else folder / f"reference_{key}.npz"
    reference = printed(converged_reference(compared, kept, key, samples, noise))
    kinds = candidates(compared.radius, arguments.quick, arguments.bakes or GROUPS) + cycles_runs(cycles)
    runs = arguments.runs or runs
    for run in range(runs):
        printed(one_round(kinds, compared, arguments.cycles_seconds or CYCLES_SECONDS, run))
        measured = [kind for kind in kinds if kind.seconds]
        # What has been measured so far is kept, should the rest take longer than anybody waits.
        found = findings(compared, reference, measured)
        facts = {
            "scene": str(scene), "command": f"detp tradeoff {scene.name}{_options(arguments)}", "machine": machine,
            "warnings": warnings + _refused(measured),
        }  # fmt: skip
        drawing = partial(draw, found, f"{escaped(scene.stem)}: error against time", folder)
        report.write(found, facts, folder, drawn(drawing, quiet=run + 1 < runs))
    say(f"Saved {folder / 'tradeoff.md'}, tradeoff.json and tradeoff.csv")
    return 0


def _refused(measured) -> list[str]:
    """What Cycles would not bake, and why, once each."""
    reasons = {name: why for run in measured for name, why in run.facts.get("refused", {}).items()}
    return [f"Cycles would not bake '{name}': {why}" for name, why in reasons.items()]


def _options(arguments: argparse.Namespace) -> str:
    """The options that were given, as they were."""
    text = " -o FOLDER"
    for name in "quick no_cycles samples reference_samples points runs bakes cycles_seconds".split():
        value = getattr(arguments, name)
        if value:
            given = "" if value is True else ",".join(map(str, value)) if isinstance(value, tuple) else value
            text += f" --{name.replace('_', '-')} {given}".rstrip()
    return text


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"a whole number of 1 or more is needed, not '{text}'")
    return int(text)


def _counts(text: str) -> tuple[int, ...]:
    return tuple(sorted({_count(part) for part in text.split(",")}))


def _names(text: str) -> tuple[str, ...]:
    names = tuple(text.split(","))
    unknown = [name for name in names if name not in NAMES]
    if unknown:
        raise argparse.ArgumentTypeError(f"unknown bakes '{unknown[0]}': choose of {', '.join(NAMES)}")
    return names
