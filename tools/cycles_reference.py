"""Bakes what Cycles finds just inside every face corner, as a reference that is reliable at every vertex.

    python tools/cycles_reference.py SCENE.blend -o REFERENCE.npz [--objects NAME ...] [--like OTHER.npz] [--samples N]
        [--faces N | --standpoints N]

What "just inside" is and why, see detp_addon/tradeoff/face_copies.py. The result has the format that
compare_cycles.py reads: "<object>|<seed>" (corners, 3), E/pi from DIFFUSE, direct and indirect, without colour. With
--faces only so many of all faces, drawn at random, are baked, so that there is time for many samples; the corners of
the others are NaN. With --standpoints paths start exactly where our own bake stands, at so many of its points, so that
what differs is not the place.
"""

import argparse
import sys
from pathlib import Path

import bpy
import numpy as np
from cycles_places import light_at
from detp.core.estimator.standpoints import Standpoints, standpoints
from detp.core.rays import RayCaster
from detp.detp_addon.files.open_files import open_blend
from detp.detp_addon.reading.read_scene import read_scene
from detp.detp_addon.tradeoff.cycles_bake import bake_with_cycles, light_of, set_up_cycles
from detp.detp_addon.tradeoff.face_copies import CopiedFaces, centred, copy_in, render_faces
from detp.detp_addon.units import metres_per_unit


def main() -> int:
    arguments = parse(sys.argv[1:])
    open_blend(Path(arguments.scene))
    scene, layer = bpy.context.scene, bpy.context.view_layer
    names = arguments.objects or [obj.name for obj in layer.objects if obj.type == "MESH"]
    if arguments.like:
        names = list(dict.fromkeys(key.rsplit("|", 1)[0] for key in np.load(arguments.like) if key[:2] != "__"))
    everything = render_faces(scene, layer, [obj.name for obj in layer.objects if obj.type == "MESH"])
    for name in names:
        if len(everything[name].corners) != len(bpy.data.objects[name].data.loops):
            raise SystemExit(f"The modifiers of '{name}' change its faces, so it has no corners to compare.")
    if arguments.standpoints:
        arrays = at_standpoints(names, arguments)
        np.savez_compressed(arguments.output, **arrays)
        return 0
    everything, radius = centred(scene, everything)
    drawn = draw([len(everything[name].sizes) for name in names], arguments.faces)
    parts = [everything[name].taken(faces) for name, faces in zip(names, drawn, strict=True)]
    set_up_cycles(scene)
    arrays, seconds = {"__spp": np.array(arguments.samples)}, []
    with copy_in(scene, CopiedFaces.joined(parts).just_inside(radius)) as copy:
        for seed in (1, 2):
            seconds.append(bake_with_cycles([copy], arguments.samples, seed).seconds)
            lights = np.split(light_of(copy), np.cumsum([len(part.corners) for part in parts])[:-1])
            for name, faces, light in zip(names, drawn, lights, strict=True):
                arrays[f"{name}|{seed}"] = np.full((len(everything[name].corners), 3), np.nan)
                arrays[f"{name}|{seed}"][faces[everything[name].face]] = light
    np.savez_compressed(arguments.output, __seconds=np.array(seconds), **arrays)
    print(f"Baked {len(names)} objects twice in {sum(seconds):.0f} s: {arguments.output}")
    return 0


def at_standpoints(names: list[str], arguments: argparse.Namespace) -> dict[str, np.ndarray]:
    """The light at the corners of these objects where our bake stands for them, NaN for those that are not drawn."""
    scene = bpy.context.scene
    read = read_scene(scene, bpy.context.view_layer, [bpy.data.objects[name] for name in names], "CORNER")
    caster = RayCaster(read.scene.corners)
    standing = Standpoints.joined([*standpoints(caster, read.centres, read.normals, read.inward)])
    count = len(read.centres)
    drawn = np.random.default_rng(0).permutation(count)[: arguments.standpoints]
    origins, normals = standing.origins[drawn] / metres_per_unit(scene), read.normals[drawn]
    near, _ = centred(scene, {"": CopiedFaces(origins, normals, np.ones(len(drawn), int))})
    halves = np.full((2, count + 1, 3), np.nan)
    halves[:, drawn] = light_at(near[""].corners, normals, arguments.samples)
    print(f"Baked at {len(drawn)} of {count} standpoints of {len(names)} objects: {arguments.output}")
    return {"__spp": np.array(arguments.samples)} | {
        f"{target.object_name}|{seed}": halves[seed - 1, target.point_rows]
        for target in read.targets for seed in (1, 2)
    }  # fmt: skip


def draw(sizes: list[int], count: int | None) -> list[np.ndarray]:
    """Which faces are baked, a mask for each object with so many faces as ``sizes`` say: ``count`` of all, or each."""
    faces = np.full(sum(sizes), count is None or count >= sum(sizes))
    if not faces.any():
        faces[np.random.default_rng(0).choice(len(faces), count, replace=False)] = True
    return np.split(faces, np.cumsum(sizes)[:-1])


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("-o", dest="output", required=True)
    parser.add_argument("--objects", nargs="+", help="default: all meshes")
    parser.add_argument("--like", help="the objects of this reference")
    parser.add_argument("--samples", type=int, default=1024)
    some = parser.add_mutually_exclusive_group()
    some.add_argument("--faces", type=int, help="only so many faces, drawn at random")
    some.add_argument("--standpoints", type=int, help="where our bake stands, at so many of its points")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
