"""Writes a copy of a scene with Cycles' own vertex bake in it, to be held against ours by measure_faces.py.

    python tools/bake_with_cycles.py SCENE.blend -o BAKED.blend [--samples N]

Each mesh object gets what its bake button gives (DIFFUSE, direct and indirect, without colour), one by one, in the
attribute `irradiance` of its face corners. Left out is what the button refuses, and objects whose modifiers change
their faces. Meshes that objects share become each one's own.
"""

import argparse
import sys
from pathlib import Path

import bpy
from detp.detp_addon.files.open_files import open_blend
from detp.detp_addon.tradeoff.cycles_bake import bake_with_cycles, set_up_cycles
from detp.detp_addon.tradeoff.face_copies import LIGHT, give_light_attribute, render_faces


def main() -> int:
    arguments = parse(sys.argv[1:])
    open_blend(Path(arguments.scene))
    scene, layer = bpy.context.scene, bpy.context.view_layer
    names = [obj.name for obj in layer.objects if obj.type == "MESH" and obj.data.polygons and not obj.hide_render]
    rendered, objects = render_faces(scene, layer, names), []
    for obj in map(bpy.data.objects.get, names):
        if obj.data.library is None and len(rendered[obj.name].corners) == len(obj.data.loops):
            if obj.data.users > 1:
                obj.data = obj.data.copy()
            give_light_attribute(obj.data)
            objects.append(obj)
    set_up_cycles(scene)
    baked = bake_with_cycles(objects, arguments.samples, seed=1)
    for obj in objects:
        if obj in baked.baked:
            obj.data.attributes[LIGHT].name = "irradiance"
    bpy.ops.wm.save_as_mainfile(filepath=str(Path(arguments.output).resolve()), copy=True, compress=True)
    print(f"Cycles baked {len(baked.baked)} of {len(names)} objects in {baked.seconds:.0f} s: {arguments.output}")
    for name, reason in baked.refused.items():
        print(f"'{name}': {reason}")
    return 0


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("-o", dest="output", required=True)
    parser.add_argument("--samples", type=int, default=256)
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
