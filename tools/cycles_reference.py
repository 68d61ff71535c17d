"""Bakes what Cycles finds just inside every face corner, as a reference that is reliable at every vertex.

    python tools/cycles_reference.py SCENE.blend -o REFERENCE.npz [--objects NAME ...] [--like OTHER.npz] [--samples N]

What "just inside" is and why, see detp_addon/face_copies.py. The result has the format that compare_cycles.py reads:
"<object>|<seed>" (corners, 3), E/pi from DIFFUSE, direct and indirect, without colour.
"""

import argparse
import sys
from pathlib import Path

import bpy
import numpy as np
from detp.detp_addon.cycles_bake import bake_with_cycles, light_of, set_up_cycles
from detp.detp_addon.face_copies import Faces, centred, copy_in, render_faces
from detp.detp_addon.files import open_blend


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
    everything, radius = centred(scene, everything)
    set_up_cycles(scene)
    arrays, seconds = {"__spp": np.array(arguments.samples)}, []
    with copy_in(scene, Faces.joined([everything[name] for name in names]).just_inside(radius)) as copy:
        for seed in (1, 2):
            seconds.append(bake_with_cycles([copy], arguments.samples, seed).seconds)
            ends = np.cumsum([len(everything[name].corners) for name in names])[:-1]
            arrays |= {f"{name}|{seed}": part for name, part in zip(names, np.split(light_of(copy), ends), strict=True)}
    np.savez_compressed(arguments.output, __seconds=np.array(seconds), **arrays)
    print(f"Baked {len(names)} objects twice in {sum(seconds):.0f} s: {arguments.output}")
    return 0


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("-o", dest="output", required=True)
    parser.add_argument("--objects", nargs="+", help="default: all meshes")
    parser.add_argument("--like", help="the objects of this reference")
    parser.add_argument("--samples", type=int, default=1024)
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
