"""What few points see is right, too, where most of a scene lies in the open sun and is exact after a few rays."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.settings import BakeSettings  # noqa: E402
from detp.core.stages import finished  # noqa: E402
from detp.detp_addon.job import bake_scene  # noqa: E402
from detp.detp_addon.request import BakeRequest  # noqa: E402
from detp.detp_addon.tradeoff.cycles_bake import bake_with_cycles, light_of, set_up_cycles  # noqa: E402
from detp.detp_addon.tradeoff.face_copies import give_light_attribute  # noqa: E402
from made_scenes import fresh, lamp, material, node, world  # noqa: E402

SAMPLES = 1024


def grid(name, size, across, place, turn=(0.0, 0.0, 0.0)):
    bpy.ops.mesh.primitive_grid_add(
        size=size, x_subdivisions=across, y_subdivisions=across, location=place, rotation=turn
    )
    bpy.context.object.name = name
    return bpy.context.object


def inside(obj):
    """Which corners (C,) of a grid are not on its rim."""
    places = np.array([obj.data.vertices[loop.vertex_index].co[:2] for loop in obj.data.loops])
    return (np.abs(places) < 0.99 * np.abs(places).max()).all(axis=1)


def test_the_walls_of_a_shed_on_sunlit_ground_are_as_bright_as_in_cycles():
    fresh()
    grid("ground", 30.0, 20, (0, 0, 0))
    quarter = 0.5 * np.pi
    walls = [
        grid("lid", 2.4, 4, (0, 0, 1.8), (2 * quarter, 0, 0)),
        grid("left", 2.4, 4, (-1.2, 0, 0.6), (0, quarter, 0)),
        grid("back", 2.4, 4, (0, 1.2, 0.6), (quarter, 0, 0)),
        grid("front", 2.4, 4, (0, -1.2, 0.6), (-quarter, 0, 0)),
        grid("screen", 1.6, 4, (1.2, -0.4, 0.8), (0, -quarter, 0)),
    ]
    # Without a material they would be glossy too, from Blender 5.0 on.
    white = material(lambda tree: node(tree, "ShaderNodeBsdfDiffuse", Color=(0.8, 0.8, 0.8, 1.0)))
    for obj in bpy.context.scene.objects:
        obj.data.materials.append(white)
    sun = lamp("SUN", energy=3.0, angle=0.01)
    sun.rotation_euler = (0.3, -0.9, 0.0)
    world((0.3, 0.4, 0.6))
    request = BakeRequest(BakeSettings("final", seed=1), activate=False, fit="vertices")
    finished(bake_scene(bpy.context.scene, bpy.context.view_layer, request))
    ours = {obj: light_of(obj, "irradiance").sum(axis=1) for obj in walls}
    set_up_cycles(bpy.context.scene, bounces=32)
    for obj in walls:
        give_light_attribute(obj.data)
    assert bake_with_cycles(walls, SAMPLES, 1).complete
    off = []
    for obj, light in ours.items():
        rows = inside(obj)
        off.append(light[rows].mean() / light_of(obj).sum(axis=1)[rows].mean() - 1.0)
    # Photons leave some 3 % to all walls alike, rays and Cycles less to each.
    assert np.abs(off).max() < 0.1 and np.sqrt(np.mean(np.square(off))) < 0.06, off
