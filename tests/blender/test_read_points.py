"""Estimation points: one per corner with its own normal, shared where equal, none where nothing faces anywhere."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.errors import NoMeshError  # noqa: E402
from detp.detp_addon.reading import joined_rows  # noqa: E402
from made_scenes import cube, linked, mesh, quad, read  # noqa: E402

pytestmark = pytest.mark.usefixtures("scene")


def smooth(obj):
    obj.data.shade_smooth()
    return obj


def target_of(result, name):
    return next(target for target in result.targets if target.object_name == name)


def original(obj):
    """Positions (C, 3) of the face corners of the mesh before modifiers, in its own space."""
    return np.array([obj.data.vertices[loop.vertex_index].co for loop in obj.data.loops])


@pytest.mark.parametrize("shade, domain, count", [
    ("flat", "CORNER", 24), ("smooth", "CORNER", 8), ("flat", "POINT", 24), ("smooth", "POINT", 8),
])  # fmt: skip
def test_corners_with_one_normal_share_a_point(shade, domain, count):
    obj = smooth(cube()) if shade == "smooth" else cube()
    result = read(domain=domain)
    rows = result.targets[0].point_rows
    assert len(result.centres) == count and len(rows) == 24
    assert sorted(set(rows)) == list(range(count))
    assert np.allclose(result.centres[rows], original(obj))
    if shade == "flat":
        faces = [face.index for face in obj.data.polygons for _ in face.loop_indices]
        expected = np.array([obj.data.polygons[face].normal for face in faces])
    else:
        expected = original(obj) / np.sqrt(3)
    assert np.allclose(result.normals[rows], expected, atol=1e-6)


def test_rows_of_several_objects_follow_each_other():
    quad("first")
    quad("second", location=(5, 0, 0))
    result = read()
    first, second = target_of(result, "first"), target_of(result, "second")
    assert np.allclose(result.centres[first.point_rows][:, 0].max(), 1)
    assert np.allclose(result.centres[second.point_rows][:, 0].min(), 5)
    assert len(np.intersect1d(first.point_rows, second.point_rows)) == 0
    assert (first.mesh_name, first.domain) == ("first", "CORNER")


def test_points_move_with_modifiers_that_keep_the_faces():
    obj = quad()
    obj.shape_key_add(name="basis")
    key = obj.shape_key_add(name="up")
    for place in key.data:
        place.co.z += 2
    key.value = 0.5
    cast = obj.modifiers.new("displace", "DISPLACE")
    cast.strength, cast.mid_level = 1.0, 0.0
    result = read()
    assert np.allclose(result.centres[:, 2], 2.0)
    assert not result.warnings


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
def test_loose_vertices_and_flat_faces_have_no_point(domain):
    vertices = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (3, 0, 0), (4, 0, 0), (5, 0, 0), (9, 9, 9)]
    linked("odd", mesh(vertices, [(0, 1, 2), (3, 4, 5)]))
    result = read(domain=domain)
    rows = result.targets[0].point_rows
    assert rows.tolist() == [0, 1, 2, -1, -1, -1]


def test_a_flat_face_between_good_ones_borrows_their_normal():
    data = mesh([(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, -1, 0), (1, 1, 0)], [(0, 3, 2), (0, 2, 4), (0, 1, 2)])
    smooth(linked("sliver", data))
    result = read()
    rows = result.targets[0].point_rows
    assert (rows[[6, 8]] >= 0).all() and rows[7] == -1
    assert np.allclose(result.normals[rows[rows >= 0]], (0, 0, 1))


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
def test_vertices_whose_faces_cancel_out_take_one_of_them(domain):
    # Two faces back to back on the same vertices: Blender's normals are the vertices' positions.
    data = mesh([(2, 0, 1), (3, 0, 1), (2, 1, 1)], [(0, 1, 2), (2, 1, 0)])
    smooth(linked("card", data))
    result = read(domain=domain)
    rows = result.targets[0].point_rows
    assert (rows >= 0).all()
    assert np.allclose(np.abs(result.normals[rows]), (0, 0, 1))
    assert np.allclose(result.normals[rows][:3], (0, 0, 1)) and np.allclose(result.normals[rows][3:], (0, 0, -1))


def test_custom_normals_count():
    obj = quad()
    obj.data.normals_split_custom_set([(0.6, 0, 0.8)] * 4)
    assert np.allclose(read().normals, (0.6, 0, 0.8), atol=1e-3)


@pytest.mark.parametrize("kind, settings, nearest_is_vertex", [
    ("ARRAY", {"count": 3}, True),
    ("SOLIDIFY", {"thickness": 0.1}, True),
    ("TRIANGULATE", {}, True),
    ("BEVEL", {"width": 0.2, "segments": 1}, False),
    ("REMESH", {"mode": "VOXEL", "voxel_size": 0.1}, False),
])  # fmt: skip
def test_changed_meshes_take_light_from_the_nearest_place(kind, settings, nearest_is_vertex):
    obj = cube(location=(7, 0, 0), scale=(2, 1, 1))
    modifier = obj.modifiers.new("change", kind)
    for name, value in settings.items():
        setattr(modifier, name, value)
    result = read()
    rows = result.targets[0].point_rows
    assert len(rows) == 24 and (rows >= 0).all()
    world = original(obj) * (2, 1, 1) + (7, 0, 0)
    apart = np.abs(result.centres[rows] - world).max()
    assert apart < (1e-5 if nearest_is_vertex else 0.45)
    assert any("nearest point" in warning and "cube" in warning for warning in result.warnings)
    faces = np.repeat([face.normal for face in obj.data.polygons], 4, axis=0)
    agreement = np.einsum("ij,ij->i", result.normals[rows], faces)
    assert agreement.min() > (0.999 if kind != "REMESH" else 0.7)


def test_faces_whose_edges_are_split_keep_their_corners():
    """A smooth-shaded box with Edge Split is shaded as a flat one, corner by corner, and no place is looked for."""
    split = smooth(cube())
    split.modifiers.new("Split", "EDGE_SPLIT").split_angle = 0.5
    result = read()
    assert not result.warnings
    rows = result.targets[0].point_rows
    assert np.allclose(result.centres[rows], original(split))
    faces = np.repeat([face.normal for face in split.data.polygons], 4, axis=0)
    assert np.allclose(result.normals[rows], faces, atol=1e-6)


def test_a_subdivided_surface_keeps_its_own_vertices():
    obj = cube()
    modifier = obj.modifiers.new("subdivide", "SUBSURF")
    modifier.render_levels = 3
    result = read(domain="POINT")
    centres = result.centres[result.targets[0].point_rows]
    inward = centres / original(obj)
    assert np.ptp(inward) < 1e-5 and 0.3 < inward.mean() < 0.7


def test_bones_take_the_points_of_a_subdivided_mesh_along(scene):
    obj = cube()
    group = obj.vertex_groups.new(name="bone")
    group.add(range(8), 1.0, "REPLACE")
    bones = bpy.data.armatures.new("bones")
    rig = linked("rig", bones)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bone = bones.edit_bones.new("bone")
    bone.tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="POSE")
    rig.pose.bones["bone"].location = (20, 0, 0)
    bpy.ops.object.mode_set(mode="OBJECT")
    obj.modifiers.new("bones", "ARMATURE").object = rig
    obj.modifiers.new("subdivide", "SUBSURF")
    result = read(domain="CORNER")
    moved = result.centres - result.centres.mean(axis=0)
    assert np.allclose(result.centres.mean(axis=0), (20, 0, 0), atol=1e-4)
    ordered = moved[result.targets[0].point_rows]
    assert (np.sign(ordered) == np.sign(original(obj))).all()


def test_shared_meshes_have_points_of_their_own():
    first = quad("first")
    linked("second", first.data, (5, 0, 0))
    result = read()
    assert len(result.centres) == 8 and len(result.targets) == 2
    assert result.targets[0].mesh_name == result.targets[1].mesh_name


def test_meshes_without_faces_are_no_targets():
    quad("floor")
    linked("empty", mesh([], []))
    linked("dots", mesh([(0, 0, 1), (0, 1, 1)], []))
    result = read(domain="POINT")
    assert [target.object_name for target in result.targets] == ["floor"]
    assert result.warnings == ("there is no light to bake on 2 objects (empty, dots), of which a render shows no face",)


def test_meshes_whose_faces_modifiers_make_are_named_with_the_remedy():
    profile = bpy.data.meshes.new("vase")
    profile.from_pydata([(1, 0, 0), (1, 0, 1)], [(0, 1)], [])
    vase = linked("vase", profile)
    vase.modifiers.new("turn", "SCREW")
    with pytest.raises(NoMeshError, match="faces that modifiers make \\('vase'\\): apply them"):
        read()
    quad("floor")
    (sentence,) = read().warnings
    assert sentence.startswith("there is no light to bake on 1 object (vase), whose faces modifiers make: apply them")


def floor_grid(name="floor"):
    """Four squares around the vertex in the middle of a floor from -1 to 1."""
    vertices = [(x, y, 0) for y in (-1, 0, 1) for x in (-1, 0, 1)]
    return linked(name, mesh(vertices, [(0, 1, 4, 3), (1, 2, 5, 4), (3, 4, 7, 6), (4, 5, 8, 7)]))


def test_corners_on_both_sides_of_a_wall_have_points_of_their_own():
    floor_grid()
    assert len(read().centres) == 9
    linked("wall", mesh([(0, -2, -1), (0, 2, -1), (0, 2, 1), (0, -2, 1)], [(0, 1, 2, 3)]))
    result = read()
    rows = target_of(result, "floor").point_rows
    # Face by face from the lower left: the second corner of the first face lies where the first one of the second does.
    assert rows[1] != rows[4] and np.allclose(result.centres[rows[1]], result.centres[rows[4]])
    assert result.inward[rows[1]][0] < 0 < result.inward[rows[4]][0]
    assert len(np.unique(rows)) == 6 + 4 + 4


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
def test_corners_behind_a_surface_are_moved_in_front_of_it(domain):
    quad("floor", size=4, location=(-2, -2, 0))
    cube("box", location=(0, 0, 0.9))
    result = read(domain=domain)
    rows = target_of(result, "box").point_rows
    used = result.centres[rows[rows >= 0]]
    sides = np.abs(result.normals[rows[rows >= 0]][:, 2]) < 0.5
    assert sides.sum() == 16 and np.allclose(used[sides][:, 2].min(), 0, atol=1e-3)
    assert (used[sides][:, 2] > -1e-3).all()
    # The bottom looks out of the room below: nobody sees it, and vertices take nothing from it.
    bottom = result.normals[rows[rows >= 0]][:, 2] < -0.5
    assert bottom.sum() == (4 if domain == "CORNER" else 0)


def test_a_mere_post_cuts_off_no_corner():
    quad("floor", size=4)
    cube("post", location=(0.4, 0.4, 1), scale=(0.05, 0.05, 1))
    rows = target_of(read(), "floor").point_rows
    assert np.allclose(read().centres[rows], original(bpy.data.objects["floor"]), atol=1e-6)


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
def test_faces_that_touch_cover_each_other(domain):
    quad("floor", size=4, location=(-2, -2, 0))
    cube("box", location=(0, 0, 1))
    result = read(domain=domain)
    rows = target_of(result, "box").point_rows
    bottom = np.repeat([face.normal.z < -0.5 for face in bpy.data.objects["box"].data.polygons], 4)
    if domain == "CORNER":
        assert result.covered[rows].tolist() == bottom.tolist()
    else:
        assert ((rows < 0) == bottom).all()


def test_objects_read_together_are_as_read_one_by_one(monkeypatch):
    shared = smooth(cube(location=(0, 0, 3), scale=(1, 2, 1))).data
    linked("mirrored", shared, location=(5, 0, 1), scale=(-1, 1, 2))
    linked("flattened", shared, location=(9, 0, 1), scale=(1, 1, 0))
    quad("alone", location=(0, 9, 0))
    linked("odd", mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (9, 9, 9)], [(0, 1, 2), (2, 1, 0)]))
    cube("cut", location=(-5, 0, 0)).modifiers.new("cut", "BEVEL")
    together = read()
    monkeypatch.setattr(joined_rows, "_ROWS", 1)
    alone = read()
    for name in ("centres", "normals", "inward", "covered"):
        np.testing.assert_array_equal(getattr(together, name), getattr(alone, name))
    for name in ("vertices", "triangles", "albedo"):
        np.testing.assert_array_equal(getattr(together.scene, name), getattr(alone.scene, name))
    for one, other in zip(together.targets, alone.targets, strict=True):
        assert one.object_name == other.object_name
        np.testing.assert_array_equal(one.point_rows, other.point_rows)
        np.testing.assert_array_equal(one.albedo, other.albedo)
