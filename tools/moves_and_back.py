"""Moves an object of a scene at random, again and again, updates the light each time, and in the end moves it back.

    python tools/moves_and_back.py SCENE.blend --object NAME [--moves 100] [--reach 1.0] [--quality draft]

At some of the moves the updated light is held against a whole bake with another seed: z is their difference over both
standard errors, at all points and at those near to the object. If errors added up from update to update, it would grow.
Back where it was, all must be the first light, bit for bit. The light is that at the points, before values are fitted.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from dataclasses import replace

import bpy
import numpy as np
from detp.core.bake import bake
from detp.core.fit.vertex_fit import VertexFit
from detp.core.points import Points
from detp.core.scene import Scene
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.core.update.session import BakeSession
from detp.detp_addon.chosen_objects import chosen_objects
from detp.detp_addon.reading.kept_places import KeptPlaces
from detp.detp_addon.reading.read_scene import read_scene
from detp.detp_addon.values import points_of
from mathutils import Vector

#: Points nearer than this share of the scene's radius to where the object is count as near.
NEAR = 0.25


def main() -> int:
    arguments = parse(sys.argv[1:])
    bpy.ops.wm.open_mainfile(filepath=arguments.scene)
    obj, generator = bpy.data.objects[arguments.object], np.random.default_rng(arguments.seed)
    home = obj.location.copy()
    scene, points, fit, places = read(None)
    settings = BakeSettings(arguments.quality, seed=arguments.seed)
    session = BakeSession(scene, points, settings)
    begin = time.process_time()
    first = finished(session.bake(fit))
    whole = time.process_time() - begin
    print(
        f"{len(scene.triangles)} triangles, {len(points)} points; a bake took {whole:.1f} s of processors", flush=True
    )
    print(
        "| move | update, s | over a bake | points | z: mean | z: rms | near | z: mean | z: rms | without the update |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    checks, seconds = {1, arguments.moves // 10, arguments.moves // 2, arguments.moves}, []
    for move in range(1, arguments.moves + 1):
        angle, way = math.tau * generator.random(), arguments.reach * np.sqrt(generator.random())
        obj.location = home + Vector((way * math.cos(angle), way * math.sin(angle), 0.0))
        scene, points, fit, _ = read(places)
        begin = time.process_time()
        updated = finished(session.update(scene, points, fit, dear=True))
        seconds.append(time.process_time() - begin)
        if move in checks:
            fresh = finished(bake(scene, points, replace(settings, seed=arguments.seed + 1000 + move), fit))
            at = np.mean([obj.matrix_world @ Vector(corner) for corner in obj.bound_box], axis=0)
            near = np.linalg.norm(points.centres - at, axis=1) < NEAR * scene.bounds.radius
            every = scores(updated, fresh, np.ones(len(near), bool))
            around, old = scores(updated, fresh, near), scores(first, fresh, near).split("|")[-1].strip()
            took = f"{seconds[-1]:.1f} | {seconds[-1] / whole:.0%}"
            print(f"| {move} | {took} | {every} | {around} | {old} |", flush=True)
    obj.location = home
    scene, points, fit, _ = read(places)
    back = finished(session.update(scene, points, fit))
    same = all(
        np.array_equal(getattr(getattr(back, part), name), getattr(getattr(first, part), name))
        for part in ("direct", "indirect", "seen") for name in ("value", "standard_error")
    )  # fmt: skip
    share = np.array(seconds) / whole
    print(
        f"{arguments.moves} moves: updates took {share.mean():.0%} of a bake, {share.min():.0%} to {share.max():.0%}; "
        f"the first ten {share[:10].mean():.0%}, the last ten {share[-10:].mean():.0%}. "
        f"Back again it is {'' if same else 'NOT '}the first light, bit for bit."
    )
    return 0 if same else 1


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--object", required=True)
    parser.add_argument("--moves", type=int, default=100)
    parser.add_argument("--reach", type=float, default=1.0, help="how far it is moved at most, in units of the scene")
    parser.add_argument("--quality", default="draft")
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args(arguments)


def read(places: KeptPlaces | None) -> tuple[Scene, Points, VertexFit, KeptPlaces]:
    """The scene as it is now, and its points, which stay at their ``places`` on faces, with their fit."""
    scene, layer = bpy.context.scene, bpy.context.view_layer
    chosen = chosen_objects(scene, layer, "visible")
    export = read_scene(scene, layer, chosen, "CORNER", (), "faces", None, places)
    _, points = points_of(export.targets, export)
    names = [(target.object_name, target.library) for target in export.targets]
    found = Points(points.centres, points.normals, points.inward, points.facing)
    return export.scene, found, points.fit, KeptPlaces.of(names, export.shown)


def scores(one, other, where: np.ndarray) -> str:
    """How many points there are, and the mean and the rms of their z, where both bakes find light."""
    light, beside = (each.irradiance.sum(axis=1)[where] for each in (one, other))
    error = np.hypot(one.standard_error.sum(axis=1)[where], other.standard_error.sum(axis=1)[where])
    lit = (light > 0) & (beside > 0) & (error > 0)
    z = (light - beside)[lit] / error[lit]
    return f"{len(z)} | {z.mean():+.3f} | {np.sqrt(np.mean(z**2)):.3f}"


if __name__ == "__main__":
    sys.exit(main())
