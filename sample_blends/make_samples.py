"""Makes the sample scenes: ``python sample_blends/make_samples.py [--folder FOLDER] [NAME ...]``.

Needs the bpy module (Blender 4.5 wrote the files of the repository, so that every later version opens them).
The same scenes come out each time: random numbers have fixed seeds, though Blender never writes the same bytes twice.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import bpy
from making import atrium, caustic, cornell_box, game_corner, tree, window_room

SAMPLES = {
    "atrium": atrium.build,
    "caustic": caustic.build,
    "cornell_box": cornell_box.build,
    "game_corner": game_corner.build,
    "tree": tree.build,
    "window_room": window_room.build,
}


def triangles() -> int:
    """How many triangles the open file shows, modifiers applied and instances counted."""
    total = 0
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:
        if instance.object.type == "MESH":
            total += sum(len(polygon.vertices) - 2 for polygon in instance.object.data.polygons)
    return total


def look_through_the_camera() -> None:
    """Let every 3D View of the file start in its camera, in which the scene can be made out."""
    for screen in bpy.data.screens:
        for area in screen.areas:
            if area.type == "VIEW_3D":
                area.spaces.active.region_3d.view_perspective = "CAMERA"


def main() -> None:
    """Make the named scenes, or all of them."""
    parser = argparse.ArgumentParser(description="Make the sample scenes.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(SAMPLES)}; default: all")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="default: beside this script")
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.names) - set(SAMPLES))
    if unknown:
        parser.error(f"no such sample: {', '.join(unknown)} (choose from {', '.join(SAMPLES)})")
    bpy.context.preferences.filepaths.save_version = 0
    for name in arguments.names or SAMPLES:
        SAMPLES[name]()
        look_through_the_camera()
        path = arguments.folder.resolve() / f"{name}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, check_existing=False)
        print(f"{name}: {triangles()} triangles, {path.stat().st_size / 1e6:.2f} MB", flush=True)


if __name__ == "__main__":
    main()
