"""Thin walls between a lit and a dark room, read from Blender: no light may come through or under them."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.bake import baked  # noqa: E402
from detp.core.settings import BakeSettings  # noqa: E402
from detp.detp_addon.writing.element_values import spread  # noqa: E402
from detp.detp_addon.writing.write_attributes import faces_of  # noqa: E402
from enclosures import around_cells, cuboid  # noqa: E402
from made_scenes import diffuse, fresh, lamp, linked, mesh, read  # noqa: E402


def add(name, vertices, faces):
    obj = linked(name, mesh(vertices.tolist(), faces, name))
    obj.data.materials.append(diffuse((0.5, 0.5, 0.5)))
    return obj


@pytest.mark.parametrize("direct", ["shadow-rays", "photons"])
@pytest.mark.parametrize("wall", ["box of 1 cm", "sheet"])
def test_the_dark_side_gets_less_than_a_thousandth(wall, direct):
    fresh()
    bpy.context.scene.world = None
    room = add(
        "room", *around_cells(np.linspace(0, 2, 5), np.linspace(0, 1, 3), np.array((0, 1)), np.ones((4, 2, 1), bool))
    )
    if wall == "sheet":
        add("wall", np.array([(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)], float), [(0, 1, 2, 3)])
    else:
        add("wall", *cuboid((0.995, 0, 0), (1.005, 1, 1)))
    lamp("POINT", location=(0.5, 0.5, 0.5), energy=10.0)
    exported = read()
    settings = BakeSettings(photons=50_000, radius=0.1, direct=direct)
    result = baked(exported.scene, exported.points, settings)
    (target,) = (target for target in exported.targets if target.object_name == "room")
    rows = np.where((target.point_rows >= 0) & ~result.hidden[target.point_rows], target.point_rows, -1)
    light = spread(result.irradiance, rows, faces_of(room.data, "CORNER")).sum(axis=1)
    middles = np.repeat([face.center.x for face in room.data.polygons], 4)
    # A ray in thousands lands where a wall cuts a cell of records in which no scout had landed behind it.
    assert light[middles > 1].mean() < 0.001 * light[middles < 1].mean()
    assert light[middles > 1].max() < 0.02 * light[middles < 1].mean()
    assert light[middles < 1].min() > 0.1 * light[middles < 1].mean()
