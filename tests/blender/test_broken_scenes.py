"""What broken scenes once made of a bake: each a finding of tools/fuzz_scenes.py, built as small as it can be."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.discs import TangentDiscs  # noqa: E402
from detp.core.errors import InvalidSettingError  # noqa: E402
from detp.core.gatherers.choose import make_gatherer  # noqa: E402
from detp.core.segments import Segments  # noqa: E402
from detp.core.settings import BakeSettings  # noqa: E402
from detp.core.stages import finished  # noqa: E402
from detp.detp_addon.job import bake_scene  # noqa: E402
from detp.detp_addon.reading.remembered import DEEPEST, Remembered  # noqa: E402
from detp.detp_addon.request import BakeRequest  # noqa: E402
from detp.detp_addon.writing.write_attributes import MeshColours, write_colours  # noqa: E402
from made_scenes import cube, lamp, material, node, quad, read, world  # noqa: E402
from small_scenes import colours  # noqa: E402

pytestmark = pytest.mark.usefixtures("scene")


def baked(**settings):
    """The report of a bake with few photons."""
    request = BakeRequest(BakeSettings(**{"photons": 200, **settings}), quantity="irradiance")
    return finished(bake_scene(bpy.context.scene, bpy.context.view_layer, request))


def albedo_of(build):
    quad().data.materials.append(material(build))
    return read().scene.albedo


def test_shaders_mixed_with_themselves_are_looked_at_once():
    """Two to the power of forty paths lead through these nodes."""

    def ladder(tree):
        shader = node(tree, "ShaderNodeBsdfDiffuse", Color=(0.5, 0.25, 0.125, 1))
        for _ in range(40):
            shader = node(tree, "ShaderNodeMixShader", Fac=0.3, Shader=shader.outputs[0], Shader_001=shader.outputs[0])
        return shader

    assert np.allclose(albedo_of(ladder), (0.5, 0.25, 0.125))


def test_node_trees_may_be_deeper_than_pythons_stack():
    def chain(tree):
        value = node(tree, "ShaderNodeValue")
        value.outputs[0].default_value = 0.0
        for _ in range(300):
            value = node(tree, "ShaderNodeMath", {"operation": "ADD"}, Value=value.outputs[0], Value_001=0.002)
        shader = node(tree, "ShaderNodeBsdfDiffuse", Color=value.outputs[0])
        for _ in range(100):
            shader = node(tree, "ShaderNodeMixShader", Fac=0.0, Shader=shader.outputs[0])
        return shader

    assert np.allclose(albedo_of(chain), 0.6)


def test_what_is_remembered_is_found_once_at_any_depth_and_loops_end():
    asked = []

    def number(n):
        asked.append(n)
        return 1 + known.of(n - 1, lambda: number(n - 1)) if n else 0

    known = Remembered(in_a_loop=None)
    assert known.of(50 * DEEPEST, lambda: number(50 * DEEPEST)) == 50 * DEEPEST
    assert len(asked) < 3 * 50 * DEEPEST
    for length in (1, DEEPEST - 1, DEEPEST, 3 * DEEPEST):
        ring = Remembered(in_a_loop="loop")

        def follow(n, ring=ring, length=length):
            after = (n + 1) % length
            return ring.of(after, lambda: follow(after))

        assert ring.of(0, lambda follow=follow: follow(0)) == "loop"


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "SUN", "AREA"])
@pytest.mark.parametrize("number", [np.nan, np.inf, 1e30])
def test_lamps_of_a_strength_that_is_not_a_number_are_left_out(kind, number):
    quad()
    lamp(kind, "sane", (0, 0, 2), energy=10.0)
    lamp(kind, "mad", (0, 0, 2), energy=number, color=(number, 1.0, 1.0))
    result = read()
    if number == 1e30:
        assert len(result.scene.lights) == 3
    else:
        assert len(result.scene.lights) == 2
        assert "lights whose strength is not a number are left out: 1 light (mad)" in result.warnings


@pytest.mark.parametrize("settings", [{"size": np.nan}, {"shape": "DISK", "size": np.nan}])
def test_lamps_of_no_possible_size_are_left_out(settings):
    quad()
    lamp("AREA", "mad", (0, 0, 2), **settings)
    result = read()
    assert len(result.scene.lights) == 1 and "(mad)" in " ".join(result.warnings)


def test_a_world_that_is_not_a_number_gives_no_light():
    quad()
    lamp("POINT", "lamp", (0, 0, 2))
    world((np.nan, 1, 1))
    result = read()
    assert len(result.scene.lights) == 1
    assert any("the world gives no light" in warning for warning in result.warnings)


def test_light_beyond_what_a_colour_holds_is_cut_and_named():
    obj = quad()
    (note,) = write_colours([MeshColours(obj, {"light": np.array([(1e39, -1e300, np.inf), (1, 2, 3)] * 2)})], "CORNER")
    assert "brighter than a colour can hold" in note and "'quad'" in note
    largest = np.finfo(np.float32).max
    assert np.array_equal(colours(obj.name, "light")[:2], [(largest, -largest, largest, 1), (1, 2, 3, 1)])


@pytest.mark.parametrize("estimator", ["visible", "plain"])
@pytest.mark.parametrize("radius", [1e-300, 1e-20, 1e-11, 1e-6, 1e6, 1e11, 1e20, 1e200])
def test_a_radius_out_of_all_proportion_is_refused_and_any_other_gives_finite_light(radius, estimator):
    lamp("POINT", "lamp", (0.5, 0.5, 1), energy=10)
    obj = quad()
    if 1e-12 < radius < 1e12:
        for gatherer in ("disc-index", "sphere-cache", "brute-force"):
            baked(radius=radius, estimator=estimator, gatherer=gatherer, direct="photons")
            assert np.isfinite(colours(obj.name)).all()
    else:
        with pytest.raises(InvalidSettingError, match="out of all proportion"):
            baked(radius=radius, estimator=estimator)


def test_links_from_the_blank_socket_of_a_group_keep_the_sockets_own_value():
    def grouped(tree):
        group = bpy.data.node_groups.new("group", "ShaderNodeTree")
        group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
        given, result = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
        inner = node(group, "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1))
        group.links.new(inner.outputs[0], result.inputs[0])
        group.links.new(given.outputs[-1], inner.inputs["Normal"])
        mixed = node(group, "ShaderNodeMixShader", Shader=inner.outputs[0], Shader_001=inner.outputs[0])
        group.links.new(given.outputs[-1], mixed.inputs["Fac"])
        group.links.new(mixed.outputs[0], result.inputs[0])
        outer = tree.nodes.new("ShaderNodeGroup")
        outer.node_tree = group
        return outer

    assert np.allclose(albedo_of(grouped), 0.5)


def test_glass_and_metal_so_far_away_that_all_their_corners_are_in_one_place():
    metal = "ShaderNodeBsdfMetallic" if hasattr(bpy.types, "ShaderNodeBsdfMetallic") else "ShaderNodeBsdfGlossy"
    for name in ("ShaderNodeBsdfGlass", metal):
        obj = quad(name, location=(1e30, 0, 0))
        obj.data.materials.append(material(lambda tree, name=name: node(tree, name)))
    quad()
    assert np.isfinite(read().scene.specular.normals).all()


def test_normals_stored_on_edges_do_not_end_blender():
    obj = cube("quad")
    obj.data.polygons[0].use_smooth = True
    obj.data.attributes.new("custom_normal", "FLOAT_VECTOR", "EDGE")
    result = read()
    assert len(result.centres) == 24 and np.allclose(np.abs(result.normals).max(axis=1), 1.0)


@pytest.mark.parametrize("number", [np.nan, np.inf, 0.0, 1e38])
def test_custom_normals_that_are_no_directions_give_way_to_the_faces(number):
    obj = quad()
    obj.data.polygons[0].use_smooth = True
    layer = obj.data.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
    layer.data.foreach_set("vector", [0.0, 0.0, number] * 4)
    assert np.allclose(read().normals, (0, 0, 1))


@pytest.mark.parametrize("kind", ["FLOAT", "FLOAT_COLOR", "BOOLEAN", "INT8"])
def test_material_indices_that_are_no_whole_numbers_mean_the_first_slot(kind):
    obj = quad()
    for colour in ((0.5, 0.5, 0.5, 1), (0.1, 0.1, 0.1, 1)):
        obj.data.materials.append(
            material(lambda tree, colour=colour: node(tree, "ShaderNodeBsdfDiffuse", Color=colour))
        )
    obj.data.attributes.new("material_index", kind, "FACE")
    assert np.allclose(read().scene.albedo, 0.5)


def test_a_material_whose_plain_colour_is_not_a_number_is_grey_there():
    made = bpy.data.materials.new("mad")
    if bpy.app.version >= (5, 0):
        made.node_tree.nodes.clear()
        made.node_tree.links.new(
            node(made.node_tree, "ShaderNodeBsdfDiffuse", Color=(np.nan, 0.25, 0.5, 1)).outputs[0],
            node(made.node_tree, "ShaderNodeOutputMaterial").inputs["Surface"],
        )
    else:
        made.use_nodes = False
        made.diffuse_color = (np.nan, 0.25, 0.5, 1)
    quad().data.materials.append(made)
    result = read()
    assert np.allclose(result.scene.albedo, (0.8, 0.25, 0.5))
    assert "values that are not numbers count as grey or none in 1 material (mad)" in result.warnings


@pytest.mark.parametrize("kind", ["ShaderNodeOutputWorld", "ShaderNodeOutputLight"])
def test_a_material_may_have_the_output_of_a_world_or_lamp(kind):
    made = material(lambda tree: node(tree, "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1)), "odd")
    tree = made.node_tree
    shader = tree.nodes["Diffuse BSDF"]
    tree.nodes.remove(next(other for other in tree.nodes if other != shader))
    tree.links.new(shader.outputs[0], node(tree, kind).inputs["Surface"])
    quad().data.materials.append(made)
    assert (read().scene.albedo <= 0.8).all()


@pytest.mark.parametrize("length", [1, 3])
def test_rings_of_reroutes_feed_nothing(length):
    def ring(tree):
        bends = [tree.nodes.new("NodeReroute") for _ in range(length)]
        for bend, following in zip(bends, bends[1:] + bends[:1], strict=True):
            tree.links.new(bend.outputs[0], following.inputs[0])
        shader = node(tree, "ShaderNodeBsdfDiffuse")
        tree.links.new(bends[0].outputs[0], shader.inputs["Color"])
        return node(tree, "ShaderNodeAddShader", Shader=shader.outputs[0], Shader_001=bends[0].outputs[0])

    assert (albedo_of(ring) <= 1.0).all()


@pytest.mark.parametrize("gatherer", ["disc-index", "sphere-cache", "brute-force"])
def test_discs_smaller_than_the_rounding_of_their_place_do_not_stop_a_search(gatherer):
    """Which of them are met there is a matter of rounding."""
    centres = np.array([(1e17, 0, 0), (1e17, 1, 0), (1e17, 0, 1)])
    search, _ = make_gatherer(gatherer, TangentDiscs.of_radius(centres, np.tile((0.0, 0, 1), (3, 1)), 2.0))
    path = Segments(np.array([(1e17, 0, 5.0)]), np.array([(1e17, 0, -5.0)]), np.ones((1, 3)), np.zeros(1, np.uint16))
    found = [pair for part in search.crossings(path) for pair in zip(part.segment, part.disc, strict=True)]
    assert set(found) <= {(0, 0), (0, 1), (0, 2)}


def test_light_that_is_as_much_below_zero_as_above():
    """Of a world in the colours of its directions, as much light is taken as is given."""
    tree = world((0, 0, 0)).node_tree
    towards = tree.nodes.new("ShaderNodeTexCoord").outputs["Normal"]
    tree.links.new(towards, tree.nodes["Background"].inputs["Color"])
    quad(size=4.0)
    cube(location=(2, 2, 1.5))
    report = baked(photons=2000)
    assert np.isfinite(report.photons) and np.isfinite(colours("quad")).all()


@pytest.mark.parametrize("scale", [(1, 1, 0), (0, 1, 1)])
def test_a_box_scaled_flat_under_a_modifier_that_changes_its_faces(scale):
    """The faces along the flat axis have no direction left, but the vertices near them lie on the others."""
    box = cube(scale=scale)
    box.modifiers.new("bevel", "BEVEL").segments = 2
    report = baked()
    assert report.objects == 1 and np.isfinite(colours(box.name)).all()
