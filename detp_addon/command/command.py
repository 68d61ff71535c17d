"""The ``detp`` command: reads its arguments and starts the work; Blender is loaded only when they are right.

The program that pip installs and ``blender --command detp`` are this one.
"""

from __future__ import annotations

import argparse
from contextlib import suppress
from typing import NoReturn

from ...core.errors import DetpError, InvalidSettingError
from ...core.memory import memory_errors_named
from ..animation.animate_command import add_bake_animation
from ..mixing.mix_command import add_mix
from ..study.command import add_study
from ..tradeoff.command import add_tradeoff
from .bake_command import add_bake
from .interrupts import end_on_signals
from .part import add_part
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


def inside_blender(argv: list[str]) -> int:
    """The same for ``blender --command detp``."""
    with suppress(ValueError):  # not in the main thread, where no signal arrives anyway
        end_on_signals(alone=False)
    return main(argv)


class _Parser(argparse.ArgumentParser):
    """Tells wrong usage without letting an argument, such as the name of a strange file, steer the terminal."""

    def error(self, message: str) -> NoReturn:
        super().error(escaped(message))


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="detp", description="Bake global illumination into vertex colours of Blender scenes.", epilog=_EPILOG
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    add_bake(commands, _EPILOG)
    add_bake_animation(commands)
    add_part(commands)
    add_mix(commands)
    add_study(commands)
    add_tradeoff(commands)
    return parser
