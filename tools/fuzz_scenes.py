"""Makes random broken scenes and bakes them: whatever is in a scene, a bake gives finite light or one clear sentence.

    python tools/fuzz_scenes.py [--scenes 1000] [--seed 0] [--only SEED] [--limit SECONDS] [--log FILE]

Each scene follows from its own number, so ``--only 417`` makes and bakes scene 417 alone, and ``--keep FILE.blend``
saves it for a look in Blender. The exit status is 1 when a bake failed, crashed or hung. See docs/fuzzing.md.
"""

import argparse
import json
import sys
from collections import Counter
from pathlib import Path

from fuzz.watch import trials


def main() -> int:
    arguments = parse()
    if arguments.keep:
        keep(arguments.only, arguments.keep)
        return 0
    seeds = range(arguments.seed, arguments.seed + arguments.scenes)
    if arguments.only is not None:
        seeds = [arguments.only]
    counts, refusals, noises, slowest = Counter(), Counter(), Counter(), []
    for outcome in trials(seeds, arguments.limit):
        counts[outcome["verdict"]] += 1
        noises.update(outcome["noise"])
        slowest = sorted([*slowest, (sum(outcome["seconds"].values()), outcome["seed"])], reverse=True)[:5]
        if outcome["verdict"] == "refused":
            refusals[outcome["message"].partition(":")[0]] += 1
        if outcome["verdict"] not in ("baked", "refused") or arguments.only is not None:
            print(f"scene {outcome['seed']}: {outcome['verdict']} ({outcome['way']})\n{outcome['message']}", flush=True)
        if arguments.log:
            with open(arguments.log, "a", encoding="utf-8") as file:
                print(json.dumps(outcome), file=file)
    total = sum(counts.values())
    print(f"{total} scenes: " + ", ".join(f"{count} {verdict}" for verdict, count in counts.most_common()) + ".")
    print("Refused with: " + ", ".join(f"{name} {count}" for name, count in refusals.most_common()))
    print("Warnings of NumPy: " + ", ".join(f"{place} ({count})" for place, count in noises.most_common(20)))
    print("Slowest: " + ", ".join(f"scene {seed} {seconds:.1f} s" for seconds, seed in slowest))
    return 0 if counts["baked"] + counts["refused"] + counts["blender"] == total else 1


def keep(seed: int, path: Path) -> None:
    """Save the scene of one seed."""
    import bpy
    from fuzz.chance import Chance
    from fuzz.scenes import make_scene
    from fuzz.wishes import attribute_name

    chance = Chance(seed)
    make_scene(chance, attribute_name(chance))
    bpy.ops.wm.save_as_mainfile(filepath=str(path.absolute()), copy=True)


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=1000, help="how many (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the first one (default: %(default)s)")
    parser.add_argument("--only", type=int, metavar="SEED", help="this one alone, with what it said")
    parser.add_argument("--keep", type=Path, metavar="FILE.blend", help="save the scene of --only instead of baking it")
    parser.add_argument(
        "--limit", type=float, default=60.0, help="seconds of a processor for a scene (default: %(default)s)"
    )
    parser.add_argument("--log", type=Path, metavar="FILE.jsonl", help="append every outcome there")
    arguments = parser.parse_args()
    if arguments.keep and arguments.only is None:
        parser.error("--keep needs --only")
    return arguments


if __name__ == "__main__":
    sys.exit(main())
