"""The sample scenes: they open, have the stated sizes, and come out of their script again as they are."""

import re
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

FOLDER = Path(__file__).parents[2] / "sample_blends"
MAKER = FOLDER / "make_samples.py"
#: triangles; the Tree's and the Atrium's are the study's
TRIANGLES = {
    **{"atrium": 122_318, "caustic": 58_976, "cornell_box": 6_238, "game_corner": 8_153, "tree": 72_500},
    "window_room": 25_104,
}


def triangles():
    total = 0
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:
        if instance.object.type == "MESH":
            total += sum(len(polygon.vertices) - 2 for polygon in instance.object.data.polygons)
    return total


def positions(mesh):
    values = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", values.ravel())
    return values


def mesh_objects():
    return {obj.name: obj for obj in bpy.data.objects if obj.type == "MESH"}


def opened(name, folder=FOLDER):
    bpy.ops.wm.open_mainfile(filepath=str(folder / f"{name}.blend"), use_scripts=False)


def published(name, millimetres):
    """The published corners (x to the left, y up), found among the vertices of an object of the Cornell box."""
    found = positions(mesh_objects()[name].data)
    for x, y, z in millimetres:
        assert np.linalg.norm(found - (-x / 1000, z / 1000, y / 1000), axis=1).min() < 1e-6, (name, x, y, z)
    return found


def test_every_sample_has_its_row_in_the_table():
    rows = re.findall(r"^\| `(\w+)\.blend` \| ([\d ]+) \|", (FOLDER / "README.md").read_text(encoding="utf-8"), re.M)
    assert {name for name, _ in rows} == set(TRIANGLES) == {path.stem for path in FOLDER.glob("*.blend")}
    for name, count in rows:
        assert int(count.replace(" ", "")) == pytest.approx(TRIANGLES[name], rel=0.01)


@pytest.mark.parametrize("name", TRIANGLES)
def test_sample_is_complete(name):
    assert (FOLDER / f"{name}.blend").stat().st_size < 5e6
    opened(name)
    assert triangles() == pytest.approx(TRIANGLES[name], rel=0.01)
    assert bpy.context.scene.camera is not None
    for obj in mesh_objects().values():
        mesh = obj.data
        assert np.isfinite(positions(mesh)).all()
        assert len(mesh.materials) > 0 and all(mesh.materials)
        assert min(polygon.area for polygon in mesh.polygons) > 0
        assert len({index for polygon in mesh.polygons for index in polygon.vertices}) == len(mesh.vertices)


@pytest.mark.parametrize("name", ["caustic", "cornell_box", "game_corner", "window_room"])
def test_script_makes_the_sample_again(name, tmp_path):
    subprocess.run([sys.executable, MAKER, name, "--folder", tmp_path], check=True, capture_output=True, timeout=100)
    opened(name)
    shipped = {key: positions(obj.data) for key, obj in mesh_objects().items()}
    opened(name, tmp_path)
    remade = {key: positions(obj.data) for key, obj in mesh_objects().items()}
    assert shipped.keys() == remade.keys()
    for key in shipped:
        assert shipped[key].shape == remade[key].shape, key
        np.testing.assert_allclose(shipped[key], remade[key], rtol=0, atol=1e-5, err_msg=key)


def test_unknown_sample_is_refused():
    done = subprocess.run([sys.executable, MAKER, "teapot"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert "no such sample: teapot" in done.stderr


def test_cornell_box_has_its_published_dimensions():
    opened("cornell_box")
    floor = published("Floor", [(552.8, 0, 0), (0, 0, 0), (0, 0, 559.2), (549.6, 0, 559.2)])
    assert np.ptp(floor, axis=0) == pytest.approx((0.5528, 0.5592, 0.0))
    published("Ceiling", [(556.0, 548.8, 0), (556.0, 548.8, 559.2), (0, 548.8, 559.2), (0, 548.8, 0)])
    published("Left wall", [(552.8, 0, 0), (549.6, 0, 559.2), (556.0, 548.8, 559.2), (556.0, 548.8, 0)])
    published("Right wall", [(0, 0, 559.2), (0, 0, 0), (0, 548.8, 0), (0, 548.8, 559.2)])
    published("Short block", [(130, 165, 65), (82, 165, 225), (240, 165, 272), (290, 165, 114), (290, 0, 114)])
    published("Tall block", [(423, 330, 247), (265, 330, 296), (314, 330, 456), (472, 330, 406), (472, 0, 406)])
    light = published("Light", [(343, 548.8, 227), (343, 548.8, 332), (213, 548.8, 332), (213, 548.8, 227)])
    assert np.ptp(light, axis=0) == pytest.approx((0.130, 0.105, 0.0))


def test_cornell_box_faces_its_inside():
    opened("cornell_box")
    middle = np.array([-0.278, 0.28, 0.274])
    for name, obj in mesh_objects().items():
        towards = -1 if "block" in name else 1
        centre = np.mean(positions(obj.data), axis=0) if towards < 0 else middle
        for polygon in obj.data.polygons:
            assert towards * np.dot(polygon.normal, centre - polygon.center) > 0, name


def test_caustic_has_closed_glass_and_a_metal():
    opened("caustic")
    for name, obj in mesh_objects().items():
        inputs = obj.data.materials[0].node_tree.nodes["Principled BSDF"].inputs
        assert inputs["Transmission Weight"].default_value == ("ball" in name)
        assert inputs["Metallic"].default_value == (name == "Ring")
        if "ball" in name:
            edges = {key: 0 for key in obj.data.edge_keys}
            for polygon in obj.data.polygons:
                for key in polygon.edge_keys:
                    edges[key] += 1
            assert set(edges.values()) == {2}


def test_game_corner_shows_what_games_bring_along():
    opened("game_corner")
    objects = mesh_objects()
    assert objects["Lamp post mirrored"].matrix_world.is_negative
    assert any(obj.data.users > 1 for obj in objects.values())
    assert any(modifier.type == "BEVEL" for obj in objects.values() for modifier in obj.modifiers)
    assert sum(obj.instance_type == "COLLECTION" for obj in bpy.data.objects) == 3
    assert any(len(obj.data.materials) > 2 for obj in objects.values())
    assert {light.type for light in bpy.data.lights} == {"POINT", "SPOT"}
    assert bpy.data.objects["Sign"].type == "FONT"
