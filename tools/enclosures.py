"""White furnaces in Blender: closed rooms in which all surfaces shine alike, so that every point must read the same.

Each is made of mesh objects whose faces look into the room. Solid things shine outward only and are dark inside, so
that a point that looks into one is found out; sheets without thickness shine on both sides.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import bpy
import numpy as np
from detp.core.lights.emissive import EmissiveTriangles
from detp.core.scene import Scene
from detp.core.triangles import normals_and_areas
from detp.detp_addon.reading.read_scene import ExportedScene, read_scene
from made_objects import mesh_object, one_shader

#: what the furnace's surfaces reflect, so that the exitance 1 - ALBEDO gives the irradiance one everywhere
ALBEDO = 0.5

#: emission strength by which sheets are told from solid things
SOLID, SHEET = 1.0, 2.0

#: how far along its way a particle is looked at, metres
STEP = 1e-5

#: the name of an object whose points lie outside the furnace
OUTSIDE = "outside"


class ShiningSurfaces(EmissiveTriangles):
    """Emissive triangles of which only the side of their normal shines, and not into the ``bodies`` on them."""

    def __init__(self, corners: np.ndarray, radiance: np.ndarray, bodies: list):
        super().__init__(corners, radiance)
        object.__setattr__(self, "bodies", bodies)

    def flux(self, bounds):
        """Radiant flux (3,) in W of the fronts, what would go into solid things included."""
        return super().flux(bounds) / 2

    def emit(self, uniforms, bounds):
        """Particles from the fronts; uniforms (P, 4)."""
        sent = super().emit(np.array((1, 1, 0.5, 1)) * uniforms, bounds)
        outside = ~_inside(self.bodies, sent.origins + STEP * sent.directions)
        return type(sent)(sent.origins, sent.directions, sent.flux * outside[:, None] / 2)


@dataclass(frozen=True)
class Furnace:
    """An enclosure as the add-on reads it, with E = 1 wherever one looks into the room.

    exported   centres, normals, targets; its scene shines
    both_sides (T,) triangles that shine on both sides
    bodies     convex solid things in it, the planes around each: places (F, 3) on them and normals (F, 3) outward
    """

    exported: ExportedScene
    both_sides: np.ndarray
    bodies: list[tuple[np.ndarray, np.ndarray]]

    @property
    def scene(self) -> Scene:
        """What photons meet."""
        return self.exported.scene

    def lit(self, origins: np.ndarray, directions: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """Whether (R,) rays from ``origins`` along ``directions`` that meet ``triangle``, -1 for none, see light."""
        normals, _ = normals_and_areas(self.scene.corners)
        front = np.einsum("ij,ij->i", normals[triangle], directions) < 0
        return (triangle >= 0) & (front | self.both_sides[triangle]) & ~_inside(self.bodies, origins)


def _planes(mesh) -> tuple[np.ndarray, np.ndarray]:
    return tuple(np.array([getattr(face, name) for face in mesh.polygons], float) for name in ("center", "normal"))


def _inside(bodies: list[tuple[np.ndarray, np.ndarray]], points: np.ndarray) -> np.ndarray:
    """Whether each of ``points`` (P, 3) lies inside one of the ``bodies``."""
    inside = np.zeros(len(points), bool)
    for places, normals in bodies:
        planes = zip(places, normals, strict=True)
        inside |= np.logical_and.reduce([(points - place) @ normal < 0 for place, normal in planes])
    return inside


def furnace(build: Callable[[], None], domain: str) -> Furnace:
    """The enclosure that ``build`` makes in an empty Blender scene, read for a bake of ``domain``."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    build()
    objects = list(bpy.context.scene.objects)
    targets = [obj for obj in objects if obj.name != OUTSIDE and not obj.hide_render]
    exported = read_scene(bpy.context.scene, bpy.context.view_layer, targets, domain)
    scene = exported.scene
    both = scene.emission[:, 0] > (SOLID + SHEET) / 2
    corners = np.concatenate([scene.corners, scene.corners[both][:, ::-1]])
    bodies = [_planes(obj.data) for obj in objects if obj.get("body")]
    light = ShiningSurfaces(corners, np.full((len(corners), 3), (1 - ALBEDO) / np.pi), bodies)
    dark = np.zeros((len(scene.triangles), 3))
    lit = Scene(scene.vertices, scene.triangles, dark + ALBEDO, dark, dark, (light,))
    return Furnace(replace(exported, scene=lit), both, bodies)


def closed_box() -> None:
    steps = np.linspace(0, 2, 5)
    _add("room", *around_cells(steps, steps, steps, np.ones((4, 4, 4), bool)))


def l_shaped_room_with_thin_walls() -> None:
    """Walls of 1 cm that end on the middle of faces; floor vertices lie under them and on their sides."""
    _l_shaped_room()
    _add_body("beside a row of vertices", *cuboid((0.5, 1.2, 0), (0.51, 2, 2)))
    _add_body("over a row of vertices", *cuboid((1.3, 0.495, 0), (2, 0.505, 2), (3, 1, 2)))
    _add_body("across faces", *cuboid((0, 0.8, 0), (0.4, 0.81, 2)))


def l_shaped_room_with_sheets() -> None:
    """Walls that are one sheet of faces, one of them above a row of the floor's vertices."""
    _l_shaped_room()
    along = np.array([(0.5, 1.2, 0), (0.5, 2, 0), (0.5, 2, 2), (0.5, 1.2, 2)])
    across = np.array([(1.3, 0.6, 0), (2, 0.6, 0), (2, 0.6, 2), (1.3, 0.6, 2)])
    _add("over a row of vertices", along, [(0, 1, 2, 3)], SHEET)
    _add("across faces", across, [(0, 1, 2, 3)], SHEET)


def icosphere_flat() -> None:
    _sphere(bpy.ops.mesh.primitive_ico_sphere_add, False, subdivisions=3)


def icosphere_smooth() -> None:
    _sphere(bpy.ops.mesh.primitive_ico_sphere_add, True, subdivisions=3)


def uv_sphere_flat() -> None:
    _sphere(bpy.ops.mesh.primitive_uv_sphere_add, False)


def uv_sphere_smooth() -> None:
    _sphere(bpy.ops.mesh.primitive_uv_sphere_add, True)


def smooth_box() -> None:
    """A box with one averaged normal at each corner, as careless shading makes it."""
    closed_box()
    bpy.data.objects["room"].data.shade_smooth()


def box_on_the_floor() -> None:
    """A box that touches the floor exactly; floor vertices lie under it and on its edges."""
    steps = np.linspace(0, 2, 9)
    _add("room", *around_cells(steps, steps, np.linspace(0, 2, 3), np.ones((8, 8, 2), bool)))
    _add_body("box", *cuboid((0.5, 0.75, 0), (1.15, 1.25, 0.8), (2, 2, 2)))


def welded_box_on_the_floor() -> None:
    """The same box as a part of the room's own faces."""
    steps = np.linspace(0, 2, 9)
    free = np.ones((8, 8, 8), bool)
    free[2:5, 3:5, :3] = False
    _add("room", *around_cells(steps, steps, steps, free))


def box_sunk_into_the_floor() -> None:
    """A box that reaches into the floor, which has a thickness; the floor's vertices under it lie inside it."""
    steps = np.linspace(0, 2, 9)
    _add("room", *around_cells(steps, steps, np.linspace(0, 2, 3), np.ones((8, 8, 2), bool)))
    _add(OUTSIDE, *cuboid((-0.2, -0.2, -0.2), (2.2, 2.2, 2.2)))
    # The floor as a body, into which the box does not shine; its surfaces are the room's and the outside's.
    _add_body("floor", *cuboid((-0.2, -0.2, -0.2), (2.2, 2.2, 0)))
    bpy.data.objects["floor"].hide_render = True
    _add_body("box", *cuboid((0.55, 0.77, -0.05), (1.15, 1.25, 0.8), (2, 2, 2)))


def half_open_door() -> None:
    """Two rooms, in the wall between them a doorway, and a door of 4 cm that stands open by 40 degrees."""
    x, y, z = np.array((0, 0.6, 1.2, 1.3, 1.9, 2.5)), np.array((0, 0.5, 0.6, 1.4, 2)), np.array((0, 1, 1.9, 2.2))
    free = np.ones((5, 4, 3), bool)
    free[2] = False
    free[2, 2, :2] = True
    _add("rooms", *around_cells(x, y, z, free))
    vertices, faces = cuboid((0, 0, 0), (0.79, 0.04, 1.89), (2, 1, 2))
    turn = np.radians(40)
    across, along = vertices[:, 0].copy(), vertices[:, 1].copy()
    vertices[:, 0] = 1.3 + across * np.cos(turn) - along * np.sin(turn)
    vertices[:, 1] = 0.6 + across * np.sin(turn) + along * np.cos(turn)
    _add_body("door", vertices, faces)


ENCLOSURES = {
    "closed box": closed_box,
    "closed box, smooth shaded": smooth_box,
    "L-shaped room, inner walls of 1 cm": l_shaped_room_with_thin_walls,
    "L-shaped room, inner walls of one sheet": l_shaped_room_with_sheets,
    "icosphere, flat": icosphere_flat,
    "icosphere, smooth": icosphere_smooth,
    "UV sphere, flat": uv_sphere_flat,
    "UV sphere, smooth": uv_sphere_smooth,
    "box standing on the floor": box_on_the_floor,
    "box sunk into the floor": box_sunk_into_the_floor,
    "box as a part of the floor": welded_box_on_the_floor,
    "half-open door": half_open_door,
}


def _l_shaped_room() -> None:
    steps = np.linspace(0, 2, 5)
    free = np.ones((4, 4, 2), bool)
    free[2:, 2:] = False
    _add("room", *around_cells(steps, steps, np.linspace(0, 2, 3), free))


def _sphere(add, smooth: bool, **settings) -> None:
    add(radius=1, **settings)
    mesh = bpy.context.object.data
    mesh.flip_normals()
    if smooth:
        mesh.shade_smooth()
    else:
        mesh.shade_flat()
    mesh.materials.append(shining(SOLID))


def cuboid(lower, upper, steps=(1, 1, 1)):
    """Vertices and faces of a box that looks outward, cut into ``steps`` along each axis."""
    axes = [np.linspace(a, b, n + 1) for a, b, n in zip(lower, upper, steps, strict=True)]
    vertices, faces = around_cells(*axes, np.ones(steps, bool))
    return vertices, [face[::-1] for face in faces]


def around_cells(x, y, z, free: np.ndarray):
    """Vertices and faces around the ``free`` cells (X, Y, Z) of a grid of planes, looking into them."""
    shape = (len(x), len(y), len(z))
    padded = np.pad(free, 1)
    faces = []
    for axis in range(3):
        first, second = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
        below, above = (np.take(padded, np.arange(shift, padded.shape[axis] + shift - 1), axis) for shift in (0, 1))
        for cell in np.argwhere(below != above):
            # Padding shifts the cells by one across the axis; along it the plane between two cells has the lower's row.
            corner = cell - 1 + np.eye(3, dtype=int)[axis]
            quad = np.array([corner, corner + first, corner + first + second, corner + second])
            inward = above[tuple(cell)]
            faces.append(np.ravel_multi_index(quad.T, shape)[:: 1 if inward else -1])
    used, rows = np.unique(np.array(faces), return_inverse=True)
    grid = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid[used].astype(float), rows.reshape(-1, 4).tolist()


def _add_body(name: str, vertices: np.ndarray, faces: list) -> None:
    _add(name, vertices, faces)
    bpy.data.objects[name]["body"] = True


def _add(name: str, vertices: np.ndarray, faces: list, strength: float = SOLID) -> None:
    mesh_object(name, vertices, faces, shining(strength))


def shining(strength: float) -> bpy.types.Material:
    return one_shader("shining", "Emission", Strength=strength)
