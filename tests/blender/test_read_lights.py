"""Each kind of lamp against the radiometry of Cycles: radiant flux, place, shape, and what is left out."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.lights.area import AreaLight  # noqa: E402
from detp.core.lights.point import PointLight  # noqa: E402
from detp.core.lights.spot import SpotLight  # noqa: E402
from detp.core.lights.sun import SunLight  # noqa: E402
from made_scenes import fresh, lamp, linked, node, quad, read, with_nodes, world  # noqa: E402

WHITE = np.ones(3)


@pytest.fixture(autouse=True)
def scene():
    made = fresh()
    world((0, 0, 0))
    quad()
    return made


def only_light():
    (light,) = read().scene.lights
    return light


def test_point_light_ignores_its_scale():
    lamp("POINT", location=(1, 2, 3), scale=(2, 3, 4), energy=50.0, shadow_soft_size=0.25, use_soft_falloff=False)
    light = only_light()
    assert isinstance(light, PointLight)
    assert np.allclose(light.position, (1, 2, 3)) and np.allclose(light.power, 50 * WHITE)
    assert light.radius == 0.25 and not light.soft


def test_soft_falloff_is_told():
    lamp("POINT", energy=50.0, shadow_soft_size=0.25, use_soft_falloff=True)
    assert only_light().soft


@pytest.mark.skipif("exposure" not in bpy.types.Light.bl_rna.properties, reason="came after Blender 4.2")
@pytest.mark.parametrize("kind", ["POINT", "SPOT", "SUN", "AREA"])
def test_flux_is_energy_exposure_colour_and_temperature(kind):
    made = lamp(kind, energy=10.0, color=(1.0, 0.5, 0.25), exposure=1.5, use_temperature=True, temperature=3000)
    expected = 10 * 2**1.5 * np.array([1, 0.5, 0.25]) * np.array(made.data.temperature_color)
    light = only_light()
    assert np.allclose(light.irradiance if kind == "SUN" else light.power, expected, rtol=1e-5)


def test_a_light_that_takes_light_away_is_kept():
    lamp("POINT", energy=-5.0)
    assert np.allclose(only_light().power, -5 * WHITE)


def test_light_nodes_multiply_the_flux():
    made = lamp("POINT", energy=10.0)
    tree = with_nodes(made.data)
    emission = node(tree, "ShaderNodeEmission", Color=(1, 0.5, 0, 1), Strength=3.0)
    tree.links.new(emission.outputs[0], tree.nodes.new("ShaderNodeOutputLight").inputs["Surface"])
    assert np.allclose(only_light().power, (30, 15, 0))


def test_nodes_that_vary_the_light_are_named():
    made = lamp("POINT", "patterned", energy=10.0)
    tree = with_nodes(made.data)
    emission = node(tree, "ShaderNodeEmission", Strength=tree.nodes.new("ShaderNodeTexIES").outputs[0])
    tree.links.new(emission.outputs[0], tree.nodes.new("ShaderNodeOutputLight").inputs["Surface"])
    result = read()
    assert np.allclose(result.scene.lights[0].power, 10 * WHITE)
    assert any("patterned" in warning for warning in result.warnings)


OWN = {
    ("ObjectInfo", "Color"): (0.2, 0.5, 0.8),
    ("ObjectInfo", "Alpha"): (0.3, 0.3, 0.3),
    ("ObjectInfo", "Location"): (1, 2, 3),
    ("ObjectInfo", "Object Index"): (7, 7, 7),
    ("OBJECT", "warmth"): (0.25, 0.25, 0.25),
    ("OBJECT", "data.energy"): (10, 10, 10),
    ("OBJECT", "none"): (0, 0, 0),
    ("VIEW_LAYER", "mood"): (0.5, 0.75, 1),
}


@pytest.mark.parametrize("asked", OWN, ids=" ".join)
def test_what_a_lamps_nodes_ask_of_its_object(scene, asked):
    """Values as Cycles showed them, on lamps that stand alone and on instances."""
    made = lamp("POINT", "asking", location=(1, 2, 3), energy=10.0)
    made.color, made.pass_index, made["warmth"], scene["mood"] = (0.2, 0.5, 0.8, 0.3), 7, 0.25, (0.5, 0.75, 1.0)
    lamp("SUN", energy=1.0)
    kind, name = asked
    tree = with_nodes(made.data)
    if kind == "ObjectInfo":
        given = tree.nodes.new("ShaderNodeObjectInfo").outputs[name]
    else:
        settings = {"attribute_type": kind, "attribute_name": name}
        given = node(tree, "ShaderNodeAttribute", settings).outputs["Color"]
    emission = node(tree, "ShaderNodeEmission", Color=given)
    tree.links.new(emission.outputs[0], tree.nodes.new("ShaderNodeOutputLight").inputs["Surface"])
    result = read()
    powers = [light.power for light in result.scene.lights if hasattr(light, "power")]
    assert np.allclose(sum(powers, np.zeros(3)), 10 * np.array(OWN[asked]), rtol=1e-6)
    assert not result.warnings and not result.left_out


def test_each_instance_of_a_lamp_has_what_is_its_own(scene):
    group, inside = bpy.data.collections.new("group"), bpy.data.objects.new("in", bpy.data.lights.new("in", "POINT"))
    group.objects.link(inside)
    inside.data.energy = 10.0
    tree = with_nodes(inside.data)
    settings = {"attribute_type": "INSTANCER", "attribute_name": "warmth"}
    emission = node(tree, "ShaderNodeEmission", Color=node(tree, "ShaderNodeAttribute", settings).outputs["Color"])
    tree.links.new(emission.outputs[0], tree.nodes.new("ShaderNodeOutputLight").inputs["Surface"])
    for x in (2.0, 5.0):
        instancer = linked("instancer", None, (x, 0, 0))
        instancer.instance_type, instancer.instance_collection = "COLLECTION", group
        instancer["warmth"] = x
    powers = {light.position[0]: light.power[0] for light in read().scene.lights}
    assert powers == pytest.approx({2.0: 20.0, 5.0: 50.0})


def test_spot_light_shines_along_its_own_minus_z():
    made = lamp("SPOT", location=(0, 0, 5), energy=40.0, spot_size=1.0, spot_blend=0.3, shadow_soft_size=0.0)
    made.rotation_euler = (math.pi / 2, 0, 0)
    light = only_light()
    assert isinstance(light, SpotLight)
    assert np.allclose(light.power, 40 * WHITE)
    assert (light.size, light.blend, light.radius) == (pytest.approx(1.0), pytest.approx(0.3), 0.0)
    assert np.allclose(light.axis @ (0, 0, -1), (0, 1, 0), atol=1e-6)


def test_sun_light():
    made = lamp("SUN", scale=(3, 3, 3), energy=4.0, angle=0.2)
    made.rotation_euler = (0, math.pi / 2, 0)
    light = only_light()
    assert isinstance(light, SunLight)
    assert np.allclose(light.direction, (-1, 0, 0), atol=1e-6)
    assert np.allclose(light.irradiance, 4 * WHITE) and light.angle == pytest.approx(0.2)


@pytest.mark.parametrize("shape, height, area", [
    ("SQUARE", 2.0, 4.0), ("RECTANGLE", 0.5, 1.0), ("DISK", 2.0, math.pi), ("ELLIPSE", 0.5, math.pi / 4),
])  # fmt: skip
def test_area_light_has_its_size_in_the_world(shape, height, area):
    lamp("AREA", location=(0, 0, 4), scale=(3, 2, 1), energy=12.0, shape=shape, size=2.0, size_y=0.5, spread=2.0)
    light = only_light()
    assert isinstance(light, AreaLight)
    assert np.allclose(light.centre, (0, 0, 4)) and np.allclose(light.normal, (0, 0, -1))
    assert np.allclose(light.edge_u, (6, 0, 0)) and np.allclose(light.edge_v, (0, 2 * height, 0))
    assert light.area == pytest.approx(6 * area) and np.allclose(light.power, 12 * WHITE)
    assert light.spread == pytest.approx(2.0)


def test_a_mirrored_area_light_keeps_to_its_own_minus_z():
    lamp("AREA", location=(0, 0, 4), scale=(-1, 1, 1), energy=12.0)
    assert np.allclose(only_light().normal, (0, 0, -1))
    bpy.data.objects["lamp"].scale = (1, 1, -1)
    assert np.allclose(only_light().normal, (0, 0, 1))


@pytest.mark.skipif("normalize" not in bpy.types.Light.bl_rna.properties, reason="came with Blender 4.5")
@pytest.mark.parametrize("kind, settings, factor", [
    ("POINT", {"shadow_soft_size": 0.5}, 4 * math.pi * 0.25),
    ("POINT", {"shadow_soft_size": 0.0}, 4.0),
    ("SPOT", {"shadow_soft_size": 0.5}, 4 * math.pi * 0.25),
    ("SUN", {"angle": 0.4}, math.pi * math.sin(0.2) ** 2),
    ("SUN", {"angle": 0.0}, 1.0),
    ("AREA", {"shape": "RECTANGLE", "size": 2.0, "size_y": 3.0}, 6.0),
    ("AREA", {"shape": "DISK", "size": 2.0}, math.pi),
])  # fmt: skip
def test_lights_that_are_not_normalised(kind, settings, factor):
    lamp(kind, energy=7.0, normalize=False, **settings)
    light = only_light()
    assert np.allclose(light.irradiance if kind == "SUN" else light.power, 7 * factor * WHITE, rtol=1e-5)


def test_hidden_lights_do_not_shine():
    lamp("POINT", "hidden").hide_render = True
    lamp("POINT", "unseen").visible_diffuse = False
    lamp("POINT", "off", energy=0.0)
    lamp("POINT", "closed", energy=3.0).hide_set(True)
    portal = lamp("AREA", "portal")
    portal.data.cycles.is_portal = True
    result = read()
    assert len(result.scene.lights) == 1 and np.allclose(result.scene.lights[0].power, 3 * WHITE)
    assert result.lights == 1 and "1 point light" in result.modelled
    for name in ("unseen", "portal"):
        assert any(name in sentence for sentence in result.left_out)


def test_lights_in_collection_instances_shine_where_they_stand(scene):
    group = bpy.data.collections.new("group")
    group.objects.link(bpy.data.objects.new("inside", bpy.data.lights.new("inside", "POINT")))
    for x in (2.0, 5.0):
        instancer = linked("instancer", None, (x, 0, 0))
        instancer.instance_type, instancer.instance_collection = "COLLECTION", group
    result = read()
    assert sorted(light.position[0] for light in result.scene.lights) == [2.0, 5.0]
    assert "2 point lights" in result.modelled


def test_what_a_light_cannot_have_here_is_named(scene):
    lamp("POINT", "shadowless", use_shadow=False)
    square = lamp("SPOT", "square")
    square.data.use_square = True
    chosen = lamp("POINT", "choosy")
    chosen.light_linking.receiver_collection = bpy.data.collections.new("chosen")
    left_out = read().left_out
    for name in ("shadowless", "square", "choosy"):
        assert sum(name in sentence for sentence in left_out) == 1


@pytest.mark.parametrize("kind", ["AREA", "SPOT"])
@pytest.mark.parametrize("turn, named", [(0.0, False), (0.5, True)])
def test_a_sheared_light_is_named(kind, turn, named):
    """Cycles gives one half more light than its flux, turned by 0.3 under this parent; of a spot in another cone."""
    light = lamp(kind, "slanted", energy=10.0)
    light.parent = linked("parent", None, (0, 0, 2), (2, 0.5, 1))
    light.rotation_euler.z = turn
    assert any("slanted" in each for each in read().left_out) == named


def test_an_area_light_without_an_area_is_named():
    lamp("AREA", "line", shape="RECTANGLE", size=1.0, size_y=0.0)
    lamp("POINT", "bulb")
    result = read()
    assert result.lights == 1 and any("line" in warning for warning in result.warnings)
