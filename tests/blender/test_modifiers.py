"""Modifiers that repeat: words that say whose light copies show, and applying them for light of their own."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.errors import NoMeshError  # noqa: E402
from detp.detp_addon.command.command import main  # noqa: E402
from detp.detp_addon.writing.baked_layers import LAYERS_MARK  # noqa: E402
from detp.detp_addon.writing.modifiers import KEEPS_FACES, REPEATS, apply_modifiers  # noqa: E402
from made_scenes import diffuse, lamp, linked, map_to_unit_square, quad, read  # noqa: E402
from small_scenes import colours, opened, saved  # noqa: E402

DIRECT = ["--error", "50%", "--indirect", "off", "--quiet"]


pytestmark = pytest.mark.usefixtures("dark_scene")


def add(obj, kind, **settings):
    modifier = obj.modifiers.new(kind, kind)
    for name, value in settings.items():
        setattr(modifier, name, value)
    return modifier


def array(obj, count=3):
    return add(obj, "ARRAY", count=count, use_relative_offset=False, use_constant_offset=True,
               constant_offset_displace=(4, 0, 0))  # fmt: skip


def applied(scene, *objects):
    return apply_modifiers(scene, bpy.context.view_layer, list(objects) or None)


def places(obj):
    return np.array([obj.data.vertices[loop.vertex_index].co for loop in obj.data.loops])


def under_a_point_lamp(at, lamp_at, power):
    """E / pi on a floor: power / (4 pi) cos / r^2 / pi."""
    way = np.array(lamp_at) - at
    distance = np.linalg.norm(way, axis=1)
    return power / (4 * np.pi**2) * way[:, 2] / distance**3


@pytest.mark.parametrize("kind, settings", [
    ("ARRAY", {"count": 2}), ("MIRROR", {}), ("SOLIDIFY", {"thickness": 0.1}), ("SCREW", {"iterations": 2}),
])  # fmt: skip
def test_what_repeats_is_said(kind, settings):
    add(quad("tile", location=(1, 0, 0)), kind, **settings)
    (warning,) = (sentence for sentence in read().warnings if sentence.startswith(REPEATS[kind]))
    assert "1 object (tile)" in warning and "--apply-modifiers" in warning


def node_group(name, *kinds):
    """A group of geometry nodes of these kinds, or of other groups, one after the other."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    last = tree.nodes.new("NodeGroupInput").outputs[0]
    for kind in kinds:
        node = tree.nodes.new(kind if isinstance(kind, str) else "GeometryNodeGroup")
        if not isinstance(kind, str):
            node.node_tree = kind
        tree.links.new(last, node.inputs[0])
        last = node.outputs[0]
    tree.links.new(last, tree.nodes.new("NodeGroupOutput").inputs[0])
    return tree


@pytest.mark.parametrize("inner", ["GeometryNodeSetShadeSmooth", "GeometryNodeExtrudeMesh"])
def test_geometry_nodes_that_keep_the_faces_repeat_nothing(scene, inner):
    smooth = node_group("inner", inner)
    box = quad("box")
    add(box, "BEVEL", width=0.1, affect="VERTICES")
    add(box, "NODES", node_group=node_group("Auto Smooth", "GeometryNodeSetMaterial", "NodeReroute", smooth))
    repeats = any(words.startswith(REPEATS["NODES"]) for words in read().warnings)
    assert repeats == (inner == "GeometryNodeExtrudeMesh")
    applied(scene)
    assert [modifier.type for modifier in box.modifiers] == ([] if repeats else ["NODES"])


def test_what_does_not_repeat_needs_no_such_word():
    array(quad("one"), count=1)
    hidden = array(quad("hidden", location=(0, 9, 0)))
    hidden.show_render = False
    add(quad("divided", location=(0, 5, 0)), "SUBSURF", render_levels=1)
    (warning,) = read().warnings
    assert warning.startswith("light is taken from the nearest point") and "1 object (divided)" in warning


def test_names_of_modifiers_are_blenders():
    known = {item.identifier for item in bpy.types.Modifier.bl_rna.properties["type"].enum_items}
    assert known >= KEEPS_FACES and known >= set(REPEATS) and not KEEPS_FACES & set(REPEATS)


@pytest.mark.parametrize("kind", ["ARRAY", "MIRROR"])
def test_each_copy_has_the_light_of_its_place(tmp_path, kind):
    tile = quad("tile", location=(1, 0, 0))
    if kind == "ARRAY":
        array(tile)
    else:
        add(tile, "MIRROR", mirror_object=linked("middle", None))
    lamp("POINT", location=(-1, 0.5, 1), energy=50.0, shadow_soft_size=0.0)
    path = saved(tmp_path / "scene.blend")
    assert main(["bake", str(path), *DIRECT, "--fit", "vertices", "--apply-modifiers"]) == 0
    opened(tmp_path / "scene_baked.blend")
    tile = bpy.data.objects["tile"]
    assert not tile.modifiers and len(tile.data.polygons) == {"ARRAY": 3, "MIRROR": 2}[kind]
    at = places(tile) + (1, 0, 0)
    light = colours("tile")[:, 0]
    # Rays start a little above the surface, which is 1e-3 of the way to the lamp.
    assert np.allclose(light, under_a_point_lamp(at, (-1, 0.5, 1), 50.0), rtol=1e-3)
    assert light.max() / light.min() > 3


def test_nothing_is_applied_without_being_asked(tmp_path):
    array(quad("tile"))
    lamp("SUN", energy=1.0)
    path = saved(tmp_path / "scene.blend")
    assert main(["bake", str(path), *DIRECT]) == 0
    opened(tmp_path / "scene_baked.blend")
    tile = bpy.data.objects["tile"]
    assert [modifier.type for modifier in tile.modifiers] == ["ARRAY"] and len(tile.data.polygons) == 1


def test_the_render_shows_the_same_before_and_after(scene):
    tile = quad("tile")
    map_to_unit_square(tile)
    tile.data.materials.append(diffuse((1, 0, 0)))
    tile.material_slots[0].link = "OBJECT"
    tile.material_slots[0].material = diffuse((0, 1, 0))
    tile.vertex_groups.new(name="group").add([0, 1], 1.0, "REPLACE")
    tile.data[LAYERS_MARK] = {"paint": "", "layers": {"day": 1}}
    tile.data.color_attributes.new("Col", "BYTE_COLOR", "CORNER")
    other = linked("other", tile.data, (0, 5, 0))
    divided = add(tile, "SUBSURF", levels=0, render_levels=2)
    array(tile)
    add(tile, "SIMPLE_DEFORM", deform_method="TWIST", angle=0.5)
    before = read()
    assert len(applied(scene, tile)) == 1
    after = read()
    assert np.allclose(after.scene.vertices, before.scene.vertices, atol=1e-6)
    assert np.array_equal(after.scene.triangles, before.scene.triangles)
    assert np.array_equal(after.scene.albedo, before.scene.albedo)
    assert [modifier.type for modifier in tile.modifiers] == ["SIMPLE_DEFORM"] and tile.modifiers[0].show_render
    assert divided is not None and len(tile.data.polygons) == 48 and len(other.data.polygons) == 1
    assert tile.data.uv_layers.active.name == "UVMap" and tile.vertex_groups.keys() == ["group"]
    assert tile.data[LAYERS_MARK]["layers"].to_dict() == {"day": 1}
    assert tile.data.attributes.default_color_name == tile.data.attributes.active_color_name == "Col"


def test_shape_keys_count_as_they_are_set(scene):
    tile = quad("tile")
    tile.shape_key_add(name="Basis")
    key = tile.shape_key_add(name="up")
    for point in key.data:
        point.co.z = 2.0
    key.value = 0.5
    array(tile)
    applied(scene)
    assert not tile.modifiers and tile.data.shape_keys is None
    assert set(read().scene.vertices[:, 2]) == {1.0}


def test_deforming_modifiers_alone_stay(scene):
    add(quad("bent"), "SIMPLE_DEFORM")
    assert applied(scene) == [] and len(bpy.data.objects["bent"].modifiers) == 1


def test_an_object_that_shows_instances_is_left_alone_and_named(scene):
    tree = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    box = tree.nodes.new("GeometryNodeMeshCube")
    place = tree.nodes.new("GeometryNodeInstanceOnPoints")
    tree.links.new(tree.nodes.new("NodeGroupInput").outputs[0], place.inputs["Points"])
    tree.links.new(box.outputs[0], place.inputs["Instance"])
    tree.links.new(place.outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
    points = quad("points")
    add(points, "NODES", node_group=tree)
    (note,) = applied(scene)
    assert "'points'" in note and "not applied" in note and len(points.modifiers) == 1
    with pytest.raises(NoMeshError, match=r"instances that geometry nodes make .'points'.: add a Realize Instances"):
        read()
    quad("floor")
    exported = read()
    assert [target.object_name for target in exported.targets] == ["floor"] and not exported.warnings
    assert any("instances that geometry nodes make of 1 object (points)" in words for words in exported.left_out)
