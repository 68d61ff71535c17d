"""Compares a bake with Cycles' own vertex bake of the same scene, point by point.

    python tools/compare_cycles.py SCENE.blend REFERENCE.npz [--quality final] [--photons N] [--radius M] [--json FILE]

REFERENCE.npz holds, per object, what Cycles' DIFFUSE bake without colour gives at the mesh's corners for two seeds, as
arrays "<object>|<seed>" (corners, 3). Cycles samples exactly at the corner. Where that lies on another surface, it is
chance on which side of it the paths start: these corners are left out, unless --every-corner says that the reference is
reliable there, as one from tools/cycles_reference.py is. Left out are also corners buried in other geometry, whose
colours a bake fills from their neighbours. How many these are is reported. Corners where the reference is NaN are no
part of the comparison.

Two groups of the rest are reported: all of them, and those at least two disc radii away from concave edges, where the
plain estimator is valid. There, no ray within the tangent plane, lifted by 1 % of the radius, meets anything closer
than two radii, and nothing lies on the point: no ray along the normal, or at 30 or 60 degrees above the plane, meets
anything closer than half a radius.

The figures compare the RGB sum at each point. The reference's own noise comes from its two seeds: of its absolute
value the same percentile is taken out of that of the difference, in squares.
"""

import argparse
import json
import sys
from pathlib import Path

import bpy
import numpy as np
from detp.core.bake import baked
from detp.core.rays import RayCaster
from detp.core.sampling import frames
from detp.core.settings import BakeSettings
from detp.core.triangles import normals_and_areas
from detp.detp_addon.files.open_files import open_blend
from detp.detp_addon.reading.read_scene import read_scene
from detp.detp_addon.tradeoff.figures import figures

TANGENT_RAYS = 32


def main() -> int:
    arguments = parse(sys.argv[1:])
    open_blend(Path(arguments.scene))
    reference = load_reference(arguments.reference)
    targets = [bpy.data.objects[name] for name in reference]
    exported = read_scene(bpy.context.scene, bpy.context.view_layer, targets, "CORNER")
    names = ("quality", "error", "photons", "radius", "gatherer", "estimator", "direct", "seed")
    settings = BakeSettings(**{name: getattr(arguments, name) for name in names})
    result = baked(exported.scene, exported.points, settings)
    clear = away_from_edges(exported, result.radius)
    reliable = np.full(len(exported.centres), True) if arguments.every_corner else ~on_other_surfaces(exported)

    ours, theirs, noise, valid, objects, filled, left_out = [], [], [], [], {}, 0, 0
    for target in exported.targets:
        first, second = reference[target.object_name]
        rows = target.point_rows
        asked = np.isfinite(first).all(axis=1)
        shown = asked & (rows >= 0) & ~result.hidden[rows]
        kept = shown & reliable[rows]
        filled, left_out = filled + int((asked & ~shown).sum()), left_out + int((shown & ~kept).sum())
        ours.append(result.irradiance[rows[kept]].sum(axis=1) / np.pi)
        theirs.append((first + second)[kept].sum(axis=1) / 2)
        noise.append(np.abs(first - second)[kept].sum(axis=1) / 2)
        valid.append(clear[rows[kept]])
        objects[target.object_name] = figures(ours[-1], theirs[-1], noise[-1])
    ours, theirs, noise, valid = (np.concatenate(parts) for parts in (ours, theirs, noise, valid))
    report = {
        "scene": arguments.scene, "radius": result.radius, "photons": result.photons, "segments": result.segments,
        "seconds": result.seconds, "relative_error": result.relative_error,
        "all": figures(ours, theirs, noise),
        "away_from_edges": figures(ours[valid], theirs[valid], noise[valid]),
        "filled": filled, "on_other_surfaces": left_out,
        "objects": objects,
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
    parser.add_argument("--error", type=float, help="to aim at, 0.05 for 5 %%")
    parser.add_argument("--photons", type=int)
    parser.add_argument("--radius", type=float)
    parser.add_argument("--gatherer", default="auto")
    parser.add_argument("--estimator", default="visible")
    parser.add_argument("--direct")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every-corner", action="store_true", help="the reference is reliable at every corner")
    parser.add_argument("--json")
    return parser.parse_args(arguments)


def load_reference(path: str) -> dict[str, list[np.ndarray]]:
    arrays = np.load(path)
    reference: dict[str, list[np.ndarray]] = {}
    for key in arrays:
        if not key.startswith("__"):
            reference.setdefault(key.rsplit("|", 1)[0], []).append(arrays[key].astype(float))
    return reference


def away_from_edges(exported, radius: float) -> np.ndarray:
    """Whether (N,) each point lies at least two radii from concave edges, and nothing lies on it."""
    caster = RayCaster(exported.scene.corners)
    first, second = frames(exported.normals)
    tolerance = caster.tolerance(exported.centres)[:, None]
    origins = exported.centres + np.maximum(0.01 * radius, 4 * tolerance) * exported.normals
    hits = caster.first_hits(exported.centres + 4 * tolerance * exported.normals, exported.normals)
    clear = (hits.triangle < 0) | (np.linalg.norm(hits.points - exported.centres, axis=1) > radius / 2)
    for elevation, distance in ((0, 2 * radius), (30, radius / 2), (60, radius / 2)):
        rise, level = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
        for angle in np.arange(TANGENT_RAYS) * 2 * np.pi / TANGENT_RAYS:
            direction = level * (np.cos(angle) * first + np.sin(angle) * second) + rise * exported.normals
            hits = caster.first_hits(origins, direction)
            clear &= (hits.triangle < 0) | (np.linalg.norm(hits.points - origins, axis=1) > distance)
    return clear


def on_other_surfaces(exported) -> np.ndarray:
    """Whether (N,) a triangle that does not belong to the point's own surface lies closer than rounding can tell.

    Rounding is that of single precision at the scene's coordinates, but at least 1e-4 of the scene's radius. Triangles
    with a corner at the point, and those that lie in its tangent plane and face the same way, are its own surface.
    """
    corners, points = exported.scene.corners, exported.centres
    near = max(1e-4 * exported.scene.bounds.radius, 4 * np.spacing(np.float32(np.abs(corners).max())))
    lower, upper = corners.min(axis=1) - near, corners.max(axis=1) + near
    normals, _ = normals_and_areas(corners)
    found = np.zeros(len(points), bool)
    for start in range(0, len(points), 256):
        part = points[start : start + 256, None]
        row, triangle = np.nonzero(((part >= lower) & (part <= upper)).all(axis=2))
        point, normal = points[start + row], exported.normals[start + row]
        away = _distance(point, corners[triangle])
        shared = np.linalg.norm(corners[triangle] - point[:, None], axis=2).min(axis=1) < near
        coplanar = np.einsum("ij,ij->i", normal, normals[triangle]) > 0.999
        found[start + row[(away < near) & ~shared & ~coplanar]] = True
    return found


def _distance(points, corners) -> np.ndarray:
    """Distance (K,) of each point from its triangle (K, 3, 3): from its plane inside, else from the nearest edge."""
    sides = np.roll(corners, -1, axis=1) - corners
    along = np.einsum("kcx,kcx->kc", points[:, None] - corners, sides)
    share = np.clip(along / np.maximum(np.einsum("kcx,kcx->kc", sides, sides), 1e-300), 0, 1)
    to_edges = np.linalg.norm(corners + share[..., None] * sides - points[:, None], axis=2).min(axis=1)
    normals, _ = normals_and_areas(corners)
    inside = np.einsum("kcx,kcx->kc", np.cross(sides, points[:, None] - corners), normals[:, None]).min(axis=1) > 0
    return np.where(inside, np.abs(np.einsum("kx,kx->k", points - corners[:, 0], normals)), to_edges)


if __name__ == "__main__":
    sys.exit(main())
