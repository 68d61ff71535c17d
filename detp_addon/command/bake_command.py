"""``detp bake``: from its arguments to a batch, with all checked that can be wrong without Blender."""

from __future__ import annotations

import argparse
import sys

from ...core.errors import InvalidSettingError
from ..files.find_scenes import find_scenes
from ..files.open_files import plan_outputs, plan_side_files
from .bake_options import bake_settings
from .batch import bake_batch
from .jobs import Batch, SceneJob


def run_bake(arguments: argparse.Namespace) -> int:
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
    wishes = arguments.jobs, arguments.time_limit, arguments.resume, arguments.dry_run
    return int(bake_batch(Batch(jobs, options, report, arguments.quiet, *wishes)) > 0)
