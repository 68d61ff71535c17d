"""Compares a bake with Cycles' own vertex bake of the same scene, point by point.

    python tools/compare_cycles.py SCENE.blend REFERENCE.npz [--quality final] [--photons N] [--radius M] [--json FILE]

REFERENCE.npz holds, per object, what Cycles' DIFFUSE bake without colour gives at the mesh's corners for two seeds, as
arrays "<object>|<seed>" (corners, 3). Two groups of points are reported: all of them, and those at least two disc
radii away from concave edges, where the plain estimator is valid. There, no ray within the tangent plane, lifted by
1 % of the radius, meets anything closer than two radii, and nothing lies on the point: no ray along the normal, or at
30 or 60 degrees above the plane, meets anything closer than half a radius.

The figures compare the RGB sum at each point. The reference's own noise comes from its two seeds: the median of the
noise is taken out of the median difference in squares.
"""

import argparse
import json
import sys

import bpy
import numpy as np
from detp.core.bake import bake
from detp.core.rays import RayCaster
from detp.core.sampling import frames
from detp.core.settings import BakeSettings
from detp.detp_addon.reading.read_scene import read_scene

TANGENT_RAYS = 32


def main() -> int:
    arguments = parse(sys.argv[1:])
    bpy.ops.wm.open_mainfile(filepath=arguments.scene, load_ui=False, use_scripts=False)
    reference = load_reference(arguments.reference)
    targets = [bpy.data.objects[name] for name in reference]
    exported = read_scene(bpy.context.scene, bpy.context.view_layer, targets, "CORNER")
    names = ("quality", "photons", "radius", "gatherer", "estimator", "seed")
    settings = BakeSettings(**{name: getattr(arguments, name) for name in names})
    result = run(bake(exported.scene, exported.centres, exported.normals, settings, exported.inward))
    clear = away_from_edges(exported, result.radius)

    ours, theirs, noise, valid, objects = [], [], [], [], {}
    for target in exported.targets:
        first, second = reference[target.object_name]
        rows = target.point_rows
        kept = rows >= 0
        ours.append(result.irradiance[rows[kept]].sum(axis=1) / np.pi)
        theirs.append((first + second)[kept].sum(axis=1) / 2)
        noise.append(np.abs(first - second)[kept].sum(axis=1) / 2)
        valid.append(clear[rows[kept]])
        objects[target.object_name] = figures(ours[-1], theirs[-1], noise[-1], valid[-1])
    ours, theirs, noise, valid = (np.concatenate(parts) for parts in (ours, theirs, noise, valid))
    report = {
        "scene": arguments.scene, "radius": result.radius, "photons": result.photons, "segments": result.segments,
        "seconds": result.seconds, "relative_error": result.relative_error,
        "all": figures(ours, theirs, noise, np.full(len(ours), True)),
        "away_from_edges": figures(ours, theirs, noise, valid),
        "objects_away_from_edges": objects,
    }  # fmt: skip
    print(json.dumps(report, indent=1))
    if arguments.json:
        with open(arguments.json, "w", encoding="utf-8") as file:
            json.dump(report, file, indent=1)
    return 0


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("reference")
    parser.add_argument("--quality", default="final")
    parser.add_argument("--photons", type=int)
    parser.add_argument("--radius", type=float)
    parser.add_argument("--gatherer", default="auto")
    parser.add_argument("--estimator", default="visible")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json")
    return parser.parse_args(arguments)


def load_reference(path: str) -> dict[str, list[np.ndarray]]:
    arrays = np.load(path)
    reference: dict[str, list[np.ndarray]] = {}
    for key in arrays:
        if not key.startswith("__"):
            reference.setdefault(key.rsplit("|", 1)[0], []).append(arrays[key].astype(float))
    return reference


def run(steps):
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def away_from_edges(exported, radius: float) -> np.ndarray:
    """Whether (N,) each point lies at least two radii from concave edges, and nothing lies on it."""
    caster = RayCaster(exported.scene.corners)
    first, second = frames(exported.normals)
    origins = exported.centres + max(0.01 * radius, 4 * caster.tolerance) * exported.normals
    hits = caster.first_hits(exported.centres + 4 * caster.tolerance * exported.normals, exported.normals)
    clear = (hits.triangle < 0) | (np.linalg.norm(hits.points - exported.centres, axis=1) > radius / 2)
    for elevation, distance in ((0, 2 * radius), (30, radius / 2), (60, radius / 2)):
        rise, level = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
        for angle in np.arange(TANGENT_RAYS) * 2 * np.pi / TANGENT_RAYS:
            direction = level * (np.cos(angle) * first + np.sin(angle) * second) + rise * exported.normals
            hits = caster.first_hits(origins, direction)
            clear &= (hits.triangle < 0) | (np.linalg.norm(hits.points - origins, axis=1) > distance)
    return clear


def figures(ours, theirs, noise, chosen) -> dict[str, float]:
    lit = chosen & (theirs > 0)
    if not lit.any():
        return {"points": int(chosen.sum())}
    difference = np.median(np.abs(ours[lit] / theirs[lit] - 1))
    reference_noise = np.median(noise[lit] / theirs[lit])
    return {
        "points": int(chosen.sum()),
        "median_relative_difference": float(difference),
        "reference_noise": float(reference_noise),
        "median_beyond_noise": float(np.sqrt(max(difference**2 - reference_noise**2, 0))),
        "percentile_95": float(np.percentile(np.abs(ours[lit] / theirs[lit] - 1), 95)),
        "mean_ratio": float(ours[chosen].sum() / theirs[chosen].sum()),
        "median_ratio": float(np.median(ours[lit] / theirs[lit])),
    }


if __name__ == "__main__":
    sys.exit(main())
