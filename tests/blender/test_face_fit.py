"""Colours fitted to faces: right between the vertices, and what faces cannot show is named and divided."""

import math

import bpy
import numpy as np
import pytest
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.core.triangles import normals_and_areas
from detp.detp_addon.job import bake_scene
from detp.detp_addon.panel import session
from detp.detp_addon.reading.read_scene import read_scene
from detp.detp_addon.request import BakeRequest
from detp.detp_addon.writing.face_division import divide_faces
from detp.detp_addon.writing.lossy_faces import LossyFaces
from small_scenes import colours, cube, grid, lamp

DIRECT = BakeSettings(indirect="off", quality="draft")


pytestmark = pytest.mark.usefixtures("addon")


def baked(settings=DIRECT, **request):
    return finished(bake_scene(bpy.context.scene, bpy.context.view_layer, BakeRequest(settings=settings, **request)))


def plane(name="Floor", size=4.0, location=(0, 0, 0)):
    bpy.ops.mesh.primitive_plane_add(size=size, location=location)
    bpy.context.object.name = name
    return bpy.context.object


def polygons(name, vertices, faces):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    bpy.context.collection.objects.link(bpy.data.objects.new(name, mesh))
    return bpy.data.objects[name]


def sun(energy=math.pi, turn=0.0):
    """From straight above: the lighting on a floor is 1. Or turned by so many radians."""
    light = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    light.data.energy, light.data.angle = energy, 0.0
    light.rotation_euler.y = turn
    bpy.context.collection.objects.link(light)


def even_light():
    """From all around: the lighting on a free face is 1."""
    world = bpy.data.worlds.new("White")
    world.color = (1.0, 1.0, 1.0)
    bpy.context.scene.world = world
    if bpy.app.version < (5, 0):
        world.use_nodes = False
    else:
        world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)


def lighting(name):
    return colours(name)[:, 0]


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
def test_a_floor_whose_corners_lie_in_boxes_shows_the_light_between_them(domain):
    plane()
    for x, y in ((-2, -2), (-2, 2), (2, -2), (2, 2)):
        cube(f"Box {x} {y}", (x, y, 0.2))
    sun()
    baked(domain=domain)
    assert lighting("Floor") == pytest.approx(1.0, rel=0.02)


def test_a_floor_half_under_a_roof_keeps_its_light():
    plane()
    plane("Roof", 4.0, (2.0, 0.0, 1.0))
    sun()
    report = baked()
    assert lighting("Roof") == pytest.approx(1.0, rel=0.01)
    assert lighting("Floor").max() == pytest.approx(1.0, abs=0.06)
    assert lighting("Floor").min() >= 0.0
    assert 0.03 < report.lossy_faces.whole < 0.2


def test_a_face_that_cannot_show_its_light_is_named():
    plane()
    lamp(location=(0.0, 0.0, 0.3))
    report = baked()
    assert report.lossy_faces.wrong[("Floor", None)].tolist() == [0]
    assert "more than 25 %" in report.faces()
    assert report.as_json()["wrong_faces"] == {"Floor": 1}


def test_a_large_floor_that_loses_a_small_spot_is_named_too():
    plane()
    sun()
    sun(1.0, turn=1.0)
    plane("Roof", 1.0, (0.9, 0.9, 0.5))
    report = baked()
    assert report.lossy_faces.shares[0] < 0.25
    assert report.lossy_faces.wrong[("Floor", None)].tolist() == [0]
    assert "1 face of 1 object by more than 5 %" in report.faces()


def test_named_faces_are_selected_and_divided_with_their_layers():
    floor = plane()
    floor.data.uv_layers.active.name = "Map"
    other = cube("Other", (0, 0, 5))
    other.select_set(True)
    lamp(location=(0.0, 0.0, 0.3))
    bpy.ops.detp.bake("EXEC_DEFAULT", indirect="OFF", quality="DRAFT")
    before = session.latest().outcome.report.lossy_faces.whole
    bpy.ops.detp.select_faces()
    assert bpy.context.view_layer.objects.active == floor
    assert [face.select for face in floor.data.polygons] == [True]
    assert not other.select_get()
    bpy.ops.detp.divide_faces()
    assert len(floor.data.polygons) == 4
    assert not bpy.ops.detp.select_faces.poll()
    corners = np.array([tuple(each.uv) for each in floor.data.uv_layers["Map"].data])
    places = np.array([tuple(floor.data.vertices[loop.vertex_index].co[:2]) for loop in floor.data.loops])
    assert corners == pytest.approx(places / 4.0 + 0.5, abs=1e-6)
    bpy.ops.detp.bake("EXEC_DEFAULT", indirect="OFF", quality="DRAFT")
    assert session.latest().outcome.report.lossy_faces.whole < 0.8 * before


#: Borders of faces, and of how many faces each becomes: also those with a vertex on a side, where a neighbour was
#: divided.
FACES_DIVIDED = {
    "triangle": ([(0, 0), (4, 0), (0, 4)], 4),
    "triangle, divided beside": ([(0, 0), (2, 0), (4, 0), (0, 4)], 4),
    "quad": ([(0, 0), (4, 0), (4, 4), (0, 4)], 4),
    "quad, divided beside twice": ([(0, 0), (1, 0), (2, 0), (4, 0), (4, 4), (0, 4)], 4),
    "long triangle": ([(0, 0), (4, 0), (0, 1)], 2),
    "long quad": ([(0, 0), (4, 0), (4, 1), (0, 1)], 2),
    "kite": ([(0, 0), (1, 0), (4, 4), (0, 1)], 4),
    "concave quad": ([(0, 0), (4, 0), (2, 2), (0, 8)], 6),
    "hexagon": ([(2, 0), (4, 0), (6, 2), (4, 4), (2, 4), (0, 2)], 12),
    "floor around a corner": ([(0, 0), (4, 0), (4, 1), (1, 1), (1, 4), (0, 4)], 8),
}


@pytest.mark.parametrize("border, parts", FACES_DIVIDED.values(), ids=FACES_DIVIDED)
def test_a_face_of_any_kind_is_divided_into_parts_half_as_long(border, parts):
    floor = polygons("Floor", [(*place, 0.0) for place in border], [tuple(range(len(border)))])
    layer = floor.data.uv_layers.new(name="Map")
    layer.data.foreach_set("uv", np.ravel(border).astype(np.float32))
    area = floor.data.polygons[0].area
    lossy = LossyFaces((("Floor", None),), np.zeros(1, int), np.zeros(1, int), np.ones(1), 1.0)
    assert divide_faces(lossy, 100) == (1, 1, len(floor.data.vertices) - len(border))
    assert len(floor.data.polygons) == parts
    assert sum(face.area for face in floor.data.polygons) == pytest.approx(area)
    assert not floor.data.validate()
    places = [tuple(floor.data.vertices[loop.vertex_index].co[:2]) for loop in floor.data.loops]
    assert np.array([tuple(each.uv) for each in floor.data.uv_layers["Map"].data]) == pytest.approx(np.array(places))


def test_triangles_beside_divided_faces_show_the_new_vertices():
    floor = polygons("Floor", [(0, 0, 0), (4, 0, 0), (0, 4, 0), (4, 4, 0)], [(0, 1, 2), (1, 3, 2)])
    divide_faces(LossyFaces((("Floor", None),), np.zeros(1, int), np.zeros(1, int), np.ones(1), 1.0), 100)
    floor.data.calc_loop_triangles()
    assert min(triangle.area for triangle in floor.data.loop_triangles) == pytest.approx(2.0)
    assert len(floor.data.loop_triangles) == 6


def test_divisions_stay_within_their_vertices_and_take_only_what_can_be_divided():
    shared, other = cube("Shared"), cube("Other")
    twin = bpy.data.objects.new("Twin", shared.data)
    bpy.context.collection.objects.link(twin)
    keys = (("Shared", None), ("Other", None))
    lossy = LossyFaces(keys, np.repeat([0, 1], 6), np.tile(np.arange(6), 2), np.full(12, 0.5), 0.5)
    assert divide_faces(lossy, 8)[:2] == (2, 1)
    assert len(shared.data.polygons) == 6
    assert len(other.data.polygons) == 12


def test_an_object_whose_mesh_modifiers_change_shows_its_light_everywhere():
    box = cube("Round", (0, 0, 2))
    box.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    even_light()
    baked()
    assert lighting("Round") == pytest.approx(1.0, rel=0.03)


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 2)], ids=["plain", "mirrored"])
@pytest.mark.parametrize("harden", [False, True])
def test_a_rounded_box_is_shaded_by_the_normals_that_its_modifier_makes(scale, harden):
    """By the smooth normals of the box below, which lean by 55 degrees, it would lose a tenth of even light."""
    box = cube("Round")
    box.data.shade_smooth()
    bevel = box.modifiers.new("Bevel", "BEVEL")
    bevel.segments, bevel.width, bevel.harden_normals = 3, 0.15, harden
    box.scale = scale
    even_light()
    baked(BakeSettings(indirect="off", quality="final"))
    assert lighting("Round") == pytest.approx(1.0, abs=0.02)


def test_flat_faces_that_hardly_bend_have_no_seams_between_them():
    floor = grid("Floor")
    for vertex in floor.data.vertices:
        vertex.co.z = 0.004 * math.sin(3.0 * vertex.co.x + 2.0 * vertex.co.y)
    lamp(location=(0.3, 0.2, 1.0))
    baked()
    light = lighting("Floor")
    at = np.array([loop.vertex_index for loop in floor.data.loops])
    spread = [np.ptp(light[at == vertex]) / light[at == vertex].mean() for vertex in np.unique(at)]
    assert max(spread) < 0.02


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
def test_faces_that_importers_split_along_a_seam_show_no_border_there(domain):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=2, y_subdivisions=1, size=4.0)
    floor = bpy.context.object
    floor.modifiers.new("Split", "EDGE_SPLIT").split_angle = 0.0
    bpy.ops.object.modifier_apply(modifier="Split")
    assert len(floor.data.vertices) == 8
    lamp(location=(1.2, 0.5, 1.0))
    baked(domain=domain)
    light = lighting(floor.name)
    at = [loop.vertex_index for loop in floor.data.loops] if domain == "CORNER" else range(8)
    places = [tuple(floor.data.vertices[vertex].co) for vertex in at]
    assert all(np.ptp([light[i] for i, other in enumerate(places) if other == place]) == 0.0 for place in set(places))


def test_vertices_may_have_their_own_light_as_cycles_bakes_it():
    plane()
    lamp(location=(0.0, 0.0, 2.0))
    baked(fit="vertices")
    # A point lamp of 100 W: intensity 100 / 4 pi^2 ... over pi for the lighting, at the corners of the floor.
    expected = 100.0 / (4.0 * math.pi) * 2.0 / 12.0**1.5 / math.pi
    assert lighting("Floor") == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 2)], ids=["plain", "mirrored"])
@pytest.mark.parametrize("modified", [False, True], ids=["as it is", "subdivided"])
def test_places_know_which_way_their_faces_lie(scale, modified):
    """On a smooth-shaded ball normals turn within a face; the faces' own are those of flat pieces, and point out."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=6)
    ball = bpy.context.object
    ball.scale = scale
    ball.data.shade_smooth()
    if modified:
        ball.modifiers.new("Finer", "SUBSURF").levels = ball.modifiers["Finer"].render_levels = 1
    read = read_scene(bpy.context.scene, bpy.context.view_layer, None, "CORNER", fit="faces")
    assert np.linalg.norm(read.facing, axis=1) == pytest.approx(1.0)
    assert (np.einsum("ij,ij->i", read.facing, read.centres) > 0).all()
    flat = normals_and_areas(read.scene.corners)[0]
    closest = (read.facing @ flat.T).max(axis=1)
    assert closest == pytest.approx(1.0, abs=1e-6)
    assert np.median(np.einsum("ij,ij->i", read.facing, read.normals)) < 0.9999


def test_a_floor_that_runs_on_under_a_low_platform_shows_the_light_beside_it():
    plane()
    cube("Platform", (1.5, 0, 0.53), 1.0)
    bpy.context.object.scale = (1.0, 4.0, 1.0)
    sun()
    baked()
    # A quarter of the floor lies in the dark of a gap of 3 cm, from which nobody looks.
    assert lighting("Floor") == pytest.approx(1.0, rel=0.06)
