"""A bake is never an input of the next one: what renders below it is read, by node and by name."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.errors import OutOfMemoryError  # noqa: E402
from detp.core.stages import finished  # noqa: E402
from detp.detp_addon.command.command import main  # noqa: E402
from detp.detp_addon.job import bake_scene  # noqa: E402
from detp.detp_addon.request import BakeRequest  # noqa: E402
from detp.detp_addon.writing.baked_layers import LAYERS_MARK, colour_layers  # noqa: E402
from made_scenes import fresh, linked, material, mesh, node, quad, read, world  # noqa: E402
from small_scenes import colours, opened, saved  # noqa: E402

PAINT = np.array([0.8, 0.4, 0.2])
QUICK = ["--error", "50%", "--quiet"]


def painted_by(settings, kind="ShaderNodeVertexColor"):
    def build(tree):
        return node(tree, "ShaderNodeBsdfDiffuse", Color=node(tree, kind, settings).outputs[0])

    return material(build)


def paint(obj, name="Col", kind="BYTE_COLOR", colour=PAINT):
    layer = obj.data.color_attributes.new(name, kind, "CORNER")
    layer.data.foreach_set("color", np.tile((*colour, 1.0), 4).astype(np.float32))
    obj.data.attributes.default_color_name = obj.data.attributes.active_color_name = name


@pytest.fixture(autouse=True)
def walls():
    """Two walls that face each other, painted, in an even world; and what they reflect before any bake."""
    fresh()
    world((1, 1, 1))
    low = quad("low")
    high = linked("high", mesh([(0, 0, 0.5), (0, 1, 0.5), (1, 1, 0.5), (1, 0, 0.5)], [(0, 1, 2, 3)]))
    for obj in (low, high):
        obj.data.materials.append(painted_by({"layer_name": ""}))
        paint(obj)
    return low, high


def bake(attribute="irradiance", **options):
    from detp.core.settings import BakeSettings

    request = BakeRequest(BakeSettings(error=0.5), attribute=attribute, **options)
    return finished(bake_scene(bpy.context.scene, bpy.context.view_layer, request))


@pytest.mark.parametrize("activate", [True, False])
@pytest.mark.parametrize("names", [("day", "night", "night"), ("irradiance", "irradiance", "irradiance")])
def test_the_next_bake_is_the_same_bit_by_bit(walls, names, activate):
    found = []
    for name in names:
        report = bake(name, activate=activate, split=name == "day")
        found.append(colours(walls[0].name, name))
        shown = name if activate else "Col"
        assert walls[0].data.attributes.default_color_name == walls[0].data.attributes.active_color_name == shown
    assert report.warnings == ()
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])
    assert np.allclose(read().scene.albedo, PAINT, atol=0.01)


def test_a_layer_that_was_renamed_is_light_still(walls):
    bake("day")
    for obj in walls:
        obj.data.attributes["day"].name = "noon"
        assert obj.data.attributes.default_color_name == "noon"
    assert np.allclose(read().scene.albedo, PAINT, atol=0.01)


def test_paint_that_was_chosen_after_a_bake_counts(walls):
    bake("day")
    for obj in walls:
        paint(obj, "Other", "FLOAT_COLOR", (0.1, 0.2, 0.3))
    assert np.allclose(read().scene.albedo, (0.1, 0.2, 0.3), atol=1e-6)
    bake("night")
    assert np.allclose(read().scene.albedo, (0.1, 0.2, 0.3), atol=1e-6)
    for obj in walls:
        obj.data.attributes.remove(obj.data.attributes["Other"])
    assert np.allclose(read().scene.albedo, PAINT, atol=0.01)


@pytest.mark.parametrize(
    "kind, setting", [("ShaderNodeVertexColor", "layer_name"), ("ShaderNodeAttribute", "attribute_name")]
)
def test_light_that_a_shader_asks_for_by_name_is_black_before_and_after(walls, kind, setting):
    for obj in walls:
        obj.data.materials[0] = painted_by({setting: "day"}, kind)
    assert not read().scene.albedo.any()
    bake("day")
    result = read()
    assert not result.scene.albedo.any()
    assert any("earlier bakes" in warning and "day" in warning for warning in result.warnings)


def test_bakes_of_earlier_versions_are_no_paint(walls):
    # They left no mark, and their layer as the one that renders.
    for obj in walls:
        paint(obj, "irradiance", "FLOAT_COLOR", (3, 3, 3))
        paint(obj, "night", "FLOAT_COLOR", (2, 2, 2))
        assert LAYERS_MARK not in obj.data
    result = read()
    assert any("'night'" in warning or "night" in warning for warning in result.warnings)
    report = bake("night")
    assert not any("paint" in warning for warning in report.warnings)
    assert np.allclose(read().scene.albedo, PAINT, atol=0.01)


def test_the_only_colours_of_a_mesh_are_paint_even_where_the_bake_writes(walls):
    for obj in walls:
        obj.data.attributes.remove(obj.data.attributes["Col"])
        paint(obj, "light", "FLOAT_COLOR")
    assert colour_layers(walls[0].data, ("light",)).paint == "light"
    assert any("paint" in warning for warning in bake("light").warnings)


def test_a_mesh_without_paint_stays_without(walls):
    for obj in walls:
        obj.data.attributes.remove(obj.data.attributes["Col"])
    bake("day")
    first = colours(walls[0].name, "day")
    bake("night")
    np.testing.assert_array_equal(colours(walls[0].name, "night"), first)
    assert not read().scene.albedo.any()


def test_light_that_geometry_nodes_bring_along_is_no_paint(walls):
    bake("day")
    tree = bpy.data.node_groups.new("bring", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    source = tree.nodes.new("GeometryNodeObjectInfo")
    source.inputs["Object"].default_value = walls[0]
    tree.links.new(source.outputs["Geometry"], tree.nodes.new("NodeGroupOutput").inputs[0])
    copy = quad("copy", location=(5, 0, 0))
    copy.data.materials.append(walls[0].data.materials[0])
    copy.modifiers.new("bring", "NODES").node_group = tree
    scene = read().scene
    there = scene.corners[:, 0, 0] > 3
    assert there.any()
    assert np.allclose(scene.albedo, PAINT, atol=0.01)


def test_a_failed_write_leaves_no_mark(walls, monkeypatch):
    from detp.detp_addon.writing import write_attributes

    real = write_attributes.leave_mark

    def fail_on_the_second(mesh, *rest):
        if mesh == walls[1].data:
            raise MemoryError
        return real(mesh, *rest)

    monkeypatch.setattr(write_attributes, "leave_mark", fail_on_the_second)
    with pytest.raises(OutOfMemoryError):
        bake("day")
    assert all(LAYERS_MARK not in obj.data and "day" not in obj.data.attributes for obj in walls)


def test_the_command_bakes_day_then_night_and_leaves_active_layers_alone(tmp_path):
    path = saved(tmp_path / "scene.blend")
    day, night = tmp_path / "day.blend", tmp_path / "night.blend"
    assert main(["bake", str(path), "-o", str(day), "--attribute", "day", *QUICK]) == 0
    keep = ["--attribute", "night", "--activate", "off"]
    assert main(["bake", str(day), "-o", str(night), *keep, *QUICK]) == 0
    opened(night)
    assert bpy.data.objects["low"].data.attributes.default_color_name == "day"
    np.testing.assert_array_equal(colours("low", "day"), colours("low", "night"))
