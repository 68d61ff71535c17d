"""Makes random scenes of sane numbers and holds their light against Cycles: what differs must be named by a warning.

    python tools/fuzz_values.py [--scenes 200] [--seed 0] [--only SEED] [--keep FILE.blend] [--log FILE]

Nothing is broken in these scenes: shader nodes of every type, lamps, worlds, instances, modifiers and visibilities as
people use them, around a floor. On the floor Cycles' own paths and the bake start from the same places. The exit status
is 1 when light differs beyond noise and nothing that the bake says of the scene names a cause. See docs/fuzzing.md.
"""

import argparse
import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import bpy
import numpy as np
from cycles_places import light_at
from detp.core.bake import baked
from detp.core.errors import DetpError
from detp.core.points import Points
from detp.core.settings import BakeSettings
from detp.detp_addon.command.blender_output import blender_silenced
from detp.detp_addon.reading.read_scene import read_scene
from fuzz.chance import Chance
from fuzz.plain_scenes import plain_scene

#: Places on the floor; paths of Cycles at each, for each of two seeds; seeds of the bake.
PLACES, SAMPLES, SEEDS = 40, 768, 4

#: The floor's half width, and how high above it the light is looked for: clear of it, and of nothing else.
HALF, HEIGHT = 1.5, 1e-4

#: Light differs when the mean does by more than this share, and by so many standard errors.
SHARE, ERRORS = 0.03, 5.0


#: What a bake says that tells of colours, not of light.
HARMLESS = ("light of their own on instances",)


@dataclass(frozen=True)
class Held:
    """One scene: what was found of the mean light E/pi on the floor, RGB, and what the bake said of it."""

    seed: int
    ours: tuple[float, ...]
    cycles: tuple[float, ...]
    errors: float
    said: tuple[str, ...]
    differs: bool


def held(seed: int) -> Held:
    """Make scene ``seed``, and hold it against Cycles."""
    chance = Chance(seed)
    chance.oddness = 0.0
    plain_scene(chance)
    scene = bpy.context.scene
    generator = np.random.default_rng(seed)
    places = np.column_stack([generator.uniform(-HALF, HALF, (PLACES, 2)), np.full(PLACES, HEIGHT)])
    normals = np.tile((0.0, 0.0, 1.0), (PLACES, 1))
    export = read_scene(scene, bpy.context.view_layer, [bpy.data.objects["floor"]], "CORNER")
    said = tuple(each for each in (*export.left_out, *export.warnings) if not each.startswith(HARMLESS))
    try:
        settings = [BakeSettings("preview", seed=each) for each in range(SEEDS)]
        ours = np.array([baked(export.scene, Points(places, normals), each).irradiance for each in settings]) / np.pi
    except DetpError as error:
        ours, said = np.zeros((SEEDS, PLACES, 3)), (*said, str(error))
    theirs = light_at(places, normals, SAMPLES)
    # Means over all places, RGB; what differs by place is noise only as far as each way of its own tells.
    means = ours.mean(axis=0).mean(axis=0), theirs.mean(axis=0).mean(axis=0)
    spread = ours.mean(axis=1).std(axis=0, ddof=1) / np.sqrt(SEEDS)
    between = np.sqrt(((theirs[0] - theirs[1]) ** 2).mean(axis=0) / (4.0 * PLACES))
    noise = np.hypot(spread, between) + 1e-4 * np.abs(means[1]).max() + 1e-6
    apart = np.abs(means[0] - means[1])
    errors = float((apart / noise).max())
    whole = max(np.abs(means[0]).max(), np.abs(means[1]).max())
    differs = errors > ERRORS and apart.max() > SHARE * whole
    return Held(seed, *(tuple(np.round(mean, 5).tolist()) for mean in means), round(errors, 1), said, bool(differs))


def main() -> int:
    arguments = parse()
    seeds = range(arguments.seed, arguments.seed + arguments.scenes) if arguments.only is None else [arguments.only]
    counts = {"as Cycles": 0, "other, named": 0, "other, silent": 0, "no number": 0}
    for seed in seeds:
        with blender_silenced():
            found = held(seed)
        if not np.isfinite(found.cycles).all():
            verdict = "no number"
        elif not found.differs:
            verdict = "as Cycles"
        else:
            verdict = "other, named" if found.said else "other, silent"
        counts[verdict] += 1
        if verdict == "other, silent" or arguments.only is not None:
            print(f"scene {seed}, {verdict}: ours {found.ours}, Cycles' {found.cycles}, {found.errors} standard errors")
            print("\n".join(f"  {sentence}" for sentence in found.said), flush=True)
        if arguments.log:
            with open(arguments.log, "a", encoding="utf-8") as file:
                print(json.dumps({**asdict(found), "verdict": verdict}), file=file)
        if arguments.keep:
            bpy.ops.wm.save_as_mainfile(filepath=str(arguments.keep.absolute()), copy=True)
    print(f"{len(seeds)} scenes: " + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()) + ".")
    return 1 if counts["other, silent"] else 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=200, help="how many (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="number of the first (default: %(default)s)")
    parser.add_argument("--only", type=int, help="this scene alone")
    parser.add_argument("--keep", type=Path, help="save the last scene there")
    parser.add_argument("--log", type=Path, help="what was found of each, a line of JSON")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
