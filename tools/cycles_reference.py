"""Bakes what Cycles finds just inside every face corner, as a reference that is reliable at every vertex.

    python tools/cycles_reference.py SCENE.blend -o REFERENCE.npz [--objects NAME ...] [--like OTHER.npz] [--samples N]

Cycles' own vertex bake samples exactly at the corner. Where two faces meet in a concave edge, or the corner lies on
another surface, it is then chance on which side of that surface the paths start. Here each object's faces are copied,
taken apart, drawn 2 % of the way towards their middles and lifted a little, with the corner normals of the original;
these copies are baked, invisible to all but the camera, in the unchanged scene. The result has the format that
compare_cycles.py reads: "<object>|<seed>" (corners, 3), E/pi from DIFFUSE, direct and indirect, without colour.

The scene is moved to the origin first, because Cycles computes in single precision.
"""

import argparse
import sys
import time

import bpy
import numpy as np
from mathutils import Matrix, Vector

#: Share of the way from a corner to the middle of its face, and lift in shares of the scene's radius.
INWARD = 0.02
LEAST_LIFT, MOST_LIFT = 4e-6, 5e-5


def main() -> int:
    arguments = parse(sys.argv[1:])
    bpy.ops.wm.open_mainfile(filepath=arguments.scene, load_ui=False, use_scripts=False)
    names = arguments.objects or [obj.name for obj in bpy.context.view_layer.objects if obj.type == "MESH"]
    if arguments.like:
        names = list(dict.fromkeys(key.rsplit("|", 1)[0] for key in np.load(arguments.like) if key[:2] != "__"))
    radius = centre_scene()
    copies = {name: face_copies(bpy.data.objects[name], radius) for name in names}
    set_up_cycles(arguments.samples)
    arrays, seconds = {"__spp": np.array(arguments.samples)}, []
    for seed in (1, 2):
        start = time.perf_counter()
        bake(list(copies.values()), seed)
        seconds.append(time.perf_counter() - start)
        for name, copy in copies.items():
            arrays[f"{name}|{seed}"] = colours(copy)
    np.savez_compressed(arguments.output, __seconds=np.array(seconds), **arrays)
    print(f"Baked {len(copies)} objects twice in {sum(seconds):.0f} s: {arguments.output}")
    return 0


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("-o", dest="output", required=True)
    parser.add_argument("--objects", nargs="+", help="default: all meshes")
    parser.add_argument("--like", help="the objects of this reference")
    parser.add_argument("--samples", type=int, default=1024)
    return parser.parse_args(arguments)


def centre_scene() -> float:
    """Move everything so that the meshes' middle is the origin, and return the radius around them."""
    meshes = [obj for obj in bpy.context.view_layer.objects if obj.type == "MESH"]
    boxes = np.array([[obj.matrix_world @ corner for corner in map(Vector, obj.bound_box)] for obj in meshes])
    lower, upper = boxes.reshape(-1, 3).min(axis=0), boxes.reshape(-1, 3).max(axis=0)
    back = Matrix.Translation(-(lower + upper) / 2)
    for obj in bpy.data.objects:
        if obj.parent is None:
            obj.matrix_world = back @ obj.matrix_world
    bpy.context.view_layer.update()
    return float(np.linalg.norm(upper - lower) / 2)


def face_copies(obj: bpy.types.Object, radius: float) -> bpy.types.Object:
    """The faces of ``obj``, apart and moved, as a new object that no path meets; its corners keep their order."""
    source = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    matrix = np.array(obj.matrix_world)
    positions, normals = np.empty(3 * len(source.vertices)), np.empty(3 * len(source.loops))
    vertex_of, sizes = np.empty(len(source.loops), int), np.empty(len(source.polygons), int)
    source.vertices.foreach_get("co", positions)
    source.corner_normals.foreach_get("vector", normals)
    source.loops.foreach_get("vertex_index", vertex_of)
    source.polygons.foreach_get("loop_total", sizes)
    if len(source.loops) != len(obj.data.loops):
        raise SystemExit(f"The modifiers of '{obj.name}' change its faces, so it has no corners to compare.")
    corners = positions.reshape(-1, 3)[vertex_of] @ matrix[:3, :3].T + matrix[:3, 3]
    normals = normals.reshape(-1, 3) @ np.linalg.inv(matrix[:3, :3])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
    face = np.repeat(np.arange(len(sizes)), sizes)
    middles = np.stack([np.bincount(face, corners[:, axis]) for axis in range(3)], axis=1) / sizes[:, None]
    inward = INWARD * (middles[face] - corners)
    lift = np.clip(0.25 * np.linalg.norm(inward, axis=1), LEAST_LIFT * radius, MOST_LIFT * radius)
    moved = corners + inward + lift[:, None] * normals

    mesh = bpy.data.meshes.new("reference")
    starts = np.cumsum(sizes) - sizes
    mesh.from_pydata(moved.tolist(), [], [list(range(s, s + n)) for s, n in zip(starts, sizes, strict=True)])
    mesh.normals_split_custom_set(normals.tolist())
    mesh.attributes.new("light", "FLOAT_COLOR", "CORNER")
    mesh.attributes.active_color_name = "light"
    material = bpy.data.materials.new("reference")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    mesh.materials.append(material)
    copy = bpy.data.objects.new("reference", mesh)
    bpy.context.scene.collection.objects.link(copy)
    for kind in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(copy, f"visible_{kind}", False)
    return copy


def set_up_cycles(samples: int) -> None:
    """Unbiased paths of up to 64 bounces, a fixed number of samples."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", samples, False, False
    cycles.max_bounces = cycles.diffuse_bounces = cycles.transparent_max_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy = 0.0


def bake(copies: list[bpy.types.Object], seed: int) -> None:
    """Bake all ``copies`` at once into their active colours."""
    bpy.context.scene.cycles.seed = seed
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in copies)
    bpy.context.view_layer.objects.active = copies[0]
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, target="VERTEX_COLORS")


def colours(copy: bpy.types.Object) -> np.ndarray:
    """The baked colours (corners, 3)."""
    layer = copy.data.attributes["light"]
    rgba = np.empty(4 * len(layer.data), np.float32)
    layer.data.foreach_get("color", rgba)
    return rgba.reshape(-1, 4)[:, :3]


if __name__ == "__main__":
    sys.exit(main())
