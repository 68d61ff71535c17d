"""Whether the errors that bakes claim are those they have: scenes baked with two seeds, each held against the other.

    python tools/two_seeds.py SCENE.blend ... [--quality preview]

Two tables: of the points, whose errors the rays tell, and of what faces show there, which the fit has smoothed. At each
point the seeds' difference is divided by the root of two. *Claimed* and *true*: the error within which half of the
points stay; *95 %* likewise; *within*: how often 1.96 standard errors hold the difference, which should be 95 %. What
both seeds get wrong alike, such as blur, is not seen.
"""

import argparse
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from detp.core.irradiance import Irradiance, error_within
from detp.core.settings import QUALITIES, BakeSettings
from detp.core.stages import finished
from detp.detp_addon.command.blender_output import blender_silenced
from detp.detp_addon.files.open_files import open_blend
from detp.detp_addon.found_light import found_light
from detp.detp_addon.request import BakeRequest
from detp.detp_addon.tables import markdown_table
from detp.detp_addon.values import values_of

COLUMNS = ("scene", "points", "rays a point", "claimed", "true", "95 %: claimed", "true", "within")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--quality", choices=QUALITIES, default="preview")
    arguments = parser.parse_args()
    at_points, shown = [], []
    for scene in arguments.scenes:
        seeds = [baked(scene, BakeSettings(quality=arguments.quality, seed=seed)) for seed in (1, 2)]
        rays = f"{np.mean([rays / len(light.value) for light, _, rays in seeds]):.0f}"
        for rows, number in ((at_points, 0), (shown, 1)):
            rows.append([scene.stem, str(len(seeds[0][0].value)), rays, *figures(*(seed[number] for seed in seeds))])
    print(f"At points\n\n{markdown_table(COLUMNS, at_points)}\n\nShown\n\n{markdown_table(COLUMNS, shown)}")
    return 0


def baked(scene: Path, settings: BakeSettings) -> tuple[Irradiance, Irradiance, int]:
    """The light at the points, what is shown there, each with its errors, and how many rays were cast."""
    with blender_silenced():
        open_blend(scene)
        view = bpy.context.scene, bpy.context.view_layer
        found = finished(found_light(*view, BakeRequest(settings=settings), None, time.perf_counter()))
    result = found.whole
    values = values_of(found.points, result).irradiance
    shown = Irradiance(found.points.fit.shown(values), result.seen.standard_error)
    return result.light, shown, result.shadow_rays


def figures(one: Irradiance, other: Irradiance) -> list[str]:
    """Claimed and true errors of two independent estimates, at the points that are lit in both and not sure."""
    some = one.doubtful & other.doubtful
    light = 0.5 * (one.value + other.value).sum(axis=1)[some]
    true = np.abs(one.value - other.value).sum(axis=1)[some] / light / np.sqrt(2.0)
    claimed = np.hypot(one.standard_error.sum(axis=1), other.standard_error.sum(axis=1))[some] / light / np.sqrt(2.0)
    pairs = ((error_within(claimed, share), np.quantile(true, share)) for share in (0.5, 0.95))
    return [*(f"{error:.1%}" for pair in pairs for error in pair), f"{np.mean(true <= 1.96 * claimed):.1%}"]


if __name__ == "__main__":
    sys.exit(main())
