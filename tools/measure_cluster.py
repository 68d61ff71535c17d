"""How a bake would scale over many workers: from one bake in which each piece of work is timed and its bytes counted.

    python tools/measure_cluster.py SCENE.blend [--quality final]

The pieces go through the same bytes as over a network, one after the other in this process, on one processor. From
their times a cluster is simulated: pieces go to whichever worker is free; the rest of the bake, packing included, is
done alone; every byte passes the one link of the machine that bakes, and what all need goes from worker to worker.
"""

from __future__ import annotations

import argparse
import os
import time
import uuid
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
from detp.core.bake import bake
from detp.core.cluster.bench import code_identity, worked
from detp.core.cluster.crew import Crew
from detp.core.points import Points
from detp.core.settings import QUALITIES, BakeSettings
from detp.core.stages import finished
from detp.detp_addon.chosen_objects import chosen_objects
from detp.detp_addon.files.open_files import open_blend
from detp.detp_addon.reading.read_scene import read_scene
from detp.detp_addon.values import points_of

WORKERS = 1, 2, 4, 8, 16, 32, 64

#: Bytes a second of the network, and seconds that handing out one piece takes the scheduler.
NETWORKS = {"10 Gbit/s": 1.1e9, "1 Gbit/s": 1.1e8}
HANDING = 1e-3


@dataclass
class TimedHands:
    """Does all itself, and notes of each step the seconds (K,) and bytes (K,) of its pieces; ``given`` bytes."""

    steps: list[tuple[list[float], list[int]]] = field(default_factory=list)
    given: list[int] = field(default_factory=list)
    held: dict[str, np.ndarray] = field(default_factory=dict)

    def give(self, key, data):
        """Keep it."""
        self.held[key] = data
        self.given.append(len(data))

    def drop(self, key):
        """Forget it."""
        del self.held[key]

    def map(self, task, keys, pieces):
        """Do the task for each piece."""
        seconds, sent = [], []
        self.steps.append((seconds, sent))
        for piece in pieces:
            begin = time.perf_counter()
            done = worked(task, code_identity(), keys, piece, *(self.held[key] for key in keys))
            seconds.append(time.perf_counter() - begin)
            sent.append(len(piece) + len(done))
            yield done


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("--quality", choices=tuple(QUALITIES), default="final")
    arguments = parser.parse_args()
    scene, points, fit = _read(arguments.scene)
    settings = BakeSettings(quality=arguments.quality)
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    # A fit remembers what noise it has seen, so that each bake needs its own.
    begin = time.perf_counter()
    found = finished(bake(scene, points, settings, deepcopy(fit)))
    alone = time.perf_counter() - begin
    hands = TimedHands()
    begin = time.perf_counter()
    parted = finished(
        bake(scene, points, settings, deepcopy(fit), Crew(hands, uuid.uuid4().hex, scene, points, settings))
    )
    whole = time.perf_counter() - begin
    assert np.array_equal(found.irradiance, parted.irradiance)
    work = sum(sum(seconds) for seconds, _ in hands.steps)
    sent = sum(sum(sizes) for _, sizes in hands.steps)
    print(f"{len(scene.triangles)} triangles, {len(points)} points; alone {alone:.1f} s; through bytes {whole:.1f} s")
    print(
        f"pieces: {sum(len(s) for s, _ in hands.steps)} in {len(hands.steps)} steps, {work:.1f} s, {sent / 1e6:.0f} MB"
    )
    print(f"to all: {hands.given[0] / 1e6:.0f} MB of scene, {sum(hands.given[1:]) / 1e6:.0f} MB of records and light")
    for name, speed in NETWORKS.items():
        times = [_simulated(hands, whole - work, workers, speed) for workers in WORKERS]
        told = ", ".join(f"{workers}: {alone / t:.1f}" for workers, t in zip(WORKERS, times, strict=True))
        print(f"times as fast as alone at {name} by workers: {told}")


def _simulated(hands: TimedHands, serial: float, workers: int, speed: float) -> float:
    """Seconds with so many ``workers`` over a network of that ``speed``, where ``serial`` seconds are not shared."""
    seconds = serial + sum(hands.given) * np.ceil(np.log2(workers + 1)) / speed
    for times, sizes in hands.steps:
        free = np.zeros(workers)
        for each in times:
            free[free.argmin()] += each
        seconds += max(free.max(), sum(sizes) / speed, len(times) * HANDING) + (max(sizes, default=0) / speed)
    return seconds


def _read(path: Path):
    open_blend(path)
    view = bpy.context.scene, bpy.context.view_layer
    export = read_scene(*view, chosen_objects(*view, "visible"), "CORNER", ("irradiance",), "faces")
    _, points = points_of(list(export.targets), export)
    return export.scene, Points(points.centres, points.normals, points.inward, points.facing), points.fit


if __name__ == "__main__":
    main()
