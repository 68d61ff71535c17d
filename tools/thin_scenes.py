"""Makes scenes of small and thin things in large surroundings, where discs at the points themselves blur the light.

    python tools/thin_scenes.py FOLDER

writes chain.blend (links of a chain, 4 cm, that hangs in a lit room), boards.blend (boards of 4 cm close to a wall of a
room that is open to the sun) and grove.blend (leaf cards under sun and sky). What they show is told by
tools/cycles_reference.py --standpoints and tools/compare_cycles.py.
"""

import math
import sys
from pathlib import Path

import bmesh
import bpy
import numpy as np
from made_objects import diffuse, mesh_object, put, sky, sun

FACES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def main() -> int:
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for make in (chain, boards, grove):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        make()
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{make.__name__}.blend"), compress=True)
    return 0


def chain() -> None:
    """A room of 6 x 6 x 3 m with one small area lamp; 24 links of a chain hang from its ceiling."""
    add("Room", *box((-3, -3, 0), (3, 3, 3), inward=True), white(0.7), cuts=8)
    area_lamp((1.5, 1.0, 2.9), 0.5, 120.0)
    for number in range(24):
        bpy.ops.mesh.primitive_torus_add(
            major_radius=0.02, minor_radius=0.005, major_segments=12, minor_segments=6,
            location=(-0.5, 0.2, 2.98 - 0.03 * number), rotation=(math.pi / 2, 0.0, math.pi / 2 * (number % 2)),
        )  # fmt: skip
        link = bpy.context.object
        link.name = f"Link{number}"
        link.data.materials.append(white(0.5))


def boards() -> None:
    """A room of 8 x 6 x 3 m, open above one wall to sun and sky; boards of 4 cm lie close to the wall opposite."""
    add("Floor", *grid_of((-4, -3, 0), (8, 0, 0), (0, 6, 0), 16), white(0.5))
    add("Ceiling", *grid_of((-4, -3, 3), (0, 6, 0), (8, 0, 0), 8), white(0.8))
    add("North", *grid_of((-4, 3, 0), (8, 0, 0), (0, 0, 3), 12), white(0.7))
    add("West", *grid_of((-4, -3, 0), (0, 6, 0), (0, 0, 3), 12), white(0.7))
    add("East", *grid_of((4, -3, 0), (0, 0, 3), (0, 6, 0), 12), white(0.7))
    add("South", *grid_of((-4, -3, 0), (0, 0, 1), (8, 0, 0), 12), white(0.7))
    for number in range(12):
        x, z = -3.8 + 0.64 * number, 0.01 + 0.22 * (number % 6)
        low, high = (x, 2.93, z), (x + 0.5, 2.97, z + 0.04)
        add(f"Board{number}", *box(low, high), white(0.6), cuts=2)
    sun(4.0, (math.radians(50), 0.0, math.radians(-20)))
    sky((0.3, 0.4, 0.6))


def grove() -> None:
    """300 twigs of leaf cards, 6 x 10 cm, over a ground of 30 m, under sun and sky."""
    chance = np.random.default_rng(4)
    add("Ground", *grid_of((-15, -15, 0), (30, 0, 0), (0, 30, 0), 30), white(0.3))
    for tree in range(6):
        middle = np.append(chance.uniform(-6, 6, 2), 2.0)
        corners, faces = [], []
        for _ in range(150):
            place = middle + chance.normal(0.0, 0.6, 3)
            first, second = np.linalg.qr(chance.normal(size=(3, 3)))[0][:2]
            first, second = 0.05 * first, 0.03 * second
            begin = len(corners)
            corners += [place - first - second, place + first - second, place + first + second, place - first + second]
            faces.append(tuple(range(begin, begin + 4)))
        add(f"Leaves{tree}", corners, faces, white(0.4))
    sun(3.0, (0.5, 0.3, 0.0))
    sky((0.4, 0.5, 0.7))


def add(name: str, corners, faces, material, cuts: int = 0) -> None:
    """A mesh object, its faces cut so often along each edge."""
    made = mesh_object(name, corners, faces, material)
    if cuts:
        work = bmesh.new()
        work.from_mesh(made.data)
        bmesh.ops.subdivide_edges(work, edges=work.edges[:], cuts=cuts, use_grid_fill=True)
        work.to_mesh(made.data)
        work.free()


def box(low, high, inward: bool = False):
    """Corners and faces of a box, whose normals point outward or into it."""
    (a, b, c), (d, e, f) = low, high
    corners = [(a, b, c), (d, b, c), (d, e, c), (a, e, c), (a, b, f), (d, b, f), (d, e, f), (a, e, f)]
    return corners, [face[::-1] for face in FACES] if inward else FACES


def grid_of(corner, first, second, cuts: int):
    """Corners and faces of a parallelogram in ``cuts`` x ``cuts`` parts; the normal is first x second."""
    corner, first, second = (np.array(each, float) for each in (corner, first, second))
    steps = np.linspace(0.0, 1.0, cuts + 1)
    corners = [corner + u * first + v * second for v in steps for u in steps]
    row = cuts + 1
    faces = [
        (i + j * row, i + 1 + j * row, i + 1 + (j + 1) * row, i + (j + 1) * row)
        for j in range(cuts) for i in range(cuts)
    ]  # fmt: skip
    return corners, faces


def white(albedo: float):
    """A diffuse material."""
    return diffuse("Diffuse", (albedo,) * 3)


def area_lamp(place, size: float, power: float) -> None:
    """A square lamp that shines down."""
    lamp = bpy.data.lights.new("Lamp", "AREA")
    lamp.energy, lamp.size = power, size
    put("Lamp", lamp).location = place


if __name__ == "__main__":
    sys.exit(main())
