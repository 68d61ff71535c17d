"""How a bake would scale over many workers: from one bake in which each piece of work is timed and its bytes counted.

    python tools/measure_cluster.py SCENE.blend [--quality final] [--indirect photons] [--photons N]

The pieces go through the same bytes as over a network, one after the other in this process, on one processor. From
the seconds of that processor that they take a cluster is simulated: pieces go to whichever worker is free; the rest of
the bake, packing included, is done alone; every byte passes the one link of the machine that bakes, and what all need
goes from worker to worker.
"""

from __future__ import annotations

import argparse
import os
import re
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
from detp.core.settings import INDIRECT_LIGHT, QUALITIES, BakeSettings
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
    """Does all itself, and notes of each step the task, the seconds (K,) of its pieces, and the bytes (K,) of each that
    went there and came back; ``given`` bytes, with what they are."""

    steps: list[tuple[str, list[float], list[int], list[int]]] = field(default_factory=list)
    given: list[tuple[str, int]] = field(default_factory=list)
    held: dict[str, np.ndarray] = field(default_factory=dict)

    def give(self, key, data):
        """Keep it."""
        self.held[key] = data
        self.given.append((re.split("[ :]", key)[0], len(data)))

    def drop(self, key):
        """Forget it."""
        del self.held[key]

    def map(self, task, keys, pieces):
        """Do the task for each piece."""
        seconds, there, back = [], [], []
        self.steps.append((task, seconds, there, back))
        for piece in pieces:
            begin = time.process_time()
            done = worked(task, code_identity(), keys, piece, *(self.held[key] for key in keys))
            seconds.append(time.process_time() - begin)
            there.append(len(piece))
            back.append(len(done))
            yield done


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("--quality", choices=tuple(QUALITIES), default="final")
    parser.add_argument("--indirect", choices=INDIRECT_LIGHT, default="gather")
    parser.add_argument("--photons", type=int, help="so many, whatever the quality")
    arguments = parser.parse_args()
    scene, points, fit = _read(arguments.scene)
    settings = BakeSettings(quality=arguments.quality, indirect=arguments.indirect, photons=arguments.photons)
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    # A fit remembers what noise it has seen, so that each bake needs its own.
    begin = time.process_time()
    found = finished(bake(scene, points, settings, deepcopy(fit)))
    alone = time.process_time() - begin
    hands = TimedHands()
    begin = time.process_time()
    parted = finished(
        bake(scene, points, settings, deepcopy(fit), Crew(hands, uuid.uuid4().hex, scene, points, settings))
    )
    whole = time.process_time() - begin
    assert np.array_equal(found.irradiance, parted.irradiance)
    work = sum(sum(seconds) for _, seconds, _, _ in hands.steps)
    print(f"{len(scene.triangles)} triangles, {len(points)} points; alone {alone:.1f} s; through bytes {whole:.1f} s")
    for task in dict.fromkeys(task for task, *_ in hands.steps):
        steps = [step[1:] for step in hands.steps if step[0] == task]
        seconds, there, back = (np.concatenate(each) for each in zip(*steps, strict=True))
        print(
            f"{task}: {len(seconds)} pieces in {len(steps)} steps, {seconds.sum():.1f} s, "
            f"{there.sum() / 1e6:.1f} MB there, {back.sum() / 1e6:.1f} MB back, {back.max() / 1e6:.2f} MB at most"
        )
    for what in dict.fromkeys(what for what, _ in hands.given):
        sizes = [size for each, size in hands.given if each == what]
        print(f"to all, {what}: {len(sizes)} times, {sum(sizes) / 1e6:.1f} MB")
    for name, speed in NETWORKS.items():
        times = [_simulated(hands, whole - work, workers, speed) for workers in WORKERS]
        told = ", ".join(f"{workers}: {alone / t:.1f}" for workers, t in zip(WORKERS, times, strict=True))
        print(f"times as fast as alone at {name} by workers: {told}")


def _simulated(hands: TimedHands, serial: float, workers: int, speed: float) -> float:
    """Seconds with so many ``workers`` over a network of that ``speed``, where ``serial`` seconds are not shared."""
    seconds = serial + sum(size for _, size in hands.given) * np.ceil(np.log2(workers + 1)) / speed
    for _, times, *sizes in hands.steps:
        sizes = np.sum(sizes, axis=0)
        free = np.zeros(workers)
        for each in times:
            free[free.argmin()] += each
        seconds += max(free.max(), sizes.sum() / speed, len(times) * HANDING) + (sizes.max(initial=0) / speed)
    return seconds


def _read(path: Path):
    open_blend(path)
    view = bpy.context.scene, bpy.context.view_layer
    export = read_scene(*view, chosen_objects(*view, "visible"), "CORNER", ("irradiance",), "faces")
    _, points = points_of(list(export.targets), export)
    return export.scene, Points(points.centres, points.normals, points.inward, points.facing), points.fit


if __name__ == "__main__":
    main()
