"""Measures what updates take beside a whole bake, over the size of an object that appears, gatherer by gatherer.

    python tools/measure_updates.py SCENE.blend --at X Y Z [--sizes 1 5 10 20 50] [--quality preview] [--turns 1]

The object is a grey box around that place; its size is its radius over that of the scene, in percent. The scene is
baked once without it. Times are those of all processors, and of reading the scene, finding its light and fitting the
values; gatherers take turns, and of several turns the least counts. *Search* is what building and asking the gatherer
of the records that are placed anew takes, which is all that the gatherer has to do with.
"""

from __future__ import annotations

import argparse
import sys
import time
from contextlib import contextmanager
from dataclasses import replace

import bpy
import detp.core.update.changed_light as changed_light
from detp.core.errors import NotUpdatableError
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.core.update.session import BakeSession
from moves_and_back import read

GATHERERS = ("disc-index", "sphere-cache", "hybrid")


def main() -> int:
    arguments = parse(sys.argv[1:])
    bpy.ops.wm.open_mainfile(filepath=arguments.scene)
    begin = time.process_time()
    scene, points, fit, places = read(None)
    session = BakeSession(scene, points, BakeSettings(arguments.quality))
    found = finished(session.bake(fit))
    whole, first, radius = time.process_time() - begin, session.kept, scene.bounds.radius
    print(f"{len(scene.triangles)} triangles, {len(points)} points, a bake {whole:.1f} s of processors, "
          f"error {found.relative_error:.1%}\n", flush=True)  # fmt: skip
    sessions = {
        name: BakeSession.of(replace(first, settings=replace(first.settings, gatherer=name))) for name in GATHERERS
    }
    # What the points see is found out at the first update, once for all.
    print(f"| r / R | error | {' | '.join(f'{name}, update / bake, search' for name in GATHERERS)} |")
    print(f"| {'--- | ' * (2 + len(GATHERERS))}".rstrip(), flush=True)
    for number, size in enumerate((arguments.sizes[0], *arguments.sizes)):
        bpy.ops.mesh.primitive_cube_add(size=2.0 * size / 100 * radius / 3**0.5, location=arguments.at)
        spent = {name: [] for name in GATHERERS}
        for _ in range(arguments.turns if number else 1):
            for name, other in sessions.items():
                with searching() as searched:
                    begin = time.process_time()
                    scene, points, fit, _ = read(places)
                    try:
                        light = finished(other.update(scene, points, fit))
                    except NotUpdatableError as error:
                        took = time.process_time() - begin
                        print(f"\nAt {size:g} %, after {took:.2f} s of processors: {error}")
                        return 0
                    spent[name].append((time.process_time() - begin, sum(searched)))
        bpy.data.objects.remove(bpy.context.object)
        if number:
            least = [min(spent[name]) for name in GATHERERS]
            told = [f"{took:.2f} s, {took / whole:.1%}, {1e3 * search:.0f} ms" for took, search in least]
            print(f"| {size:g} % | {light.relative_error:.1%} | {' | '.join(told)} |", flush=True)
    return 0


@contextmanager
def searching():
    """Processor seconds of each search of records that are placed anew."""
    spent: list[float] = []
    make, gathered = changed_light.make_gatherer, changed_light.ChangedRecords._sums
    fresh: set[int] = set()

    def timed(call, *given):
        begin = time.process_time()
        result = call(*given)
        spent.append(time.process_time() - begin)
        return result

    def made(*given):
        result = timed(make, *given)
        fresh.add(id(result[0]))
        return result

    def asked(self, search, *given):
        return timed(gathered, self, search, *given) if id(search.gatherer) in fresh else gathered(self, search, *given)

    changed_light.make_gatherer, changed_light.ChangedRecords._sums = made, asked
    try:
        yield spent
    finally:
        changed_light.make_gatherer, changed_light.ChangedRecords._sums = make, gathered


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--at", type=float, nargs=3, required=True)
    parser.add_argument("--sizes", type=float, nargs="+", default=(1, 2, 5, 10, 20, 50), help="percent")
    parser.add_argument("--quality", default="preview")
    parser.add_argument("--turns", type=int, default=1)
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
