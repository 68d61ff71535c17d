"""The world: one colour where it is one, otherwise the picture that Cycles makes of it, the right way round."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.lights.environment import EnvironmentWorld  # noqa: E402
from detp.core.lights.world import UniformWorld  # noqa: E402
from detp.detp_addon.reading.world_picture import _seen_by_diffuse_light  # noqa: E402
from detp.detp_addon.reading.world_spots import spots  # noqa: E402
from made_scenes import all_counts, fresh, image, lamp, node, quad, read, with_nodes, world  # noqa: E402


@pytest.fixture(autouse=True)
def scene():
    made = fresh()
    quad()
    return made


def world_of(build):
    """A world whose background has the colour and strength that ``build(tree)`` gives."""
    made = bpy.data.worlds.new("made")
    tree = with_nodes(made)
    colour, strength = build(tree)
    background = node(tree, "ShaderNodeBackground", Color=colour, Strength=strength)
    tree.links.new(background.outputs[0], tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    bpy.context.scene.world = made
    return made


def only_light():
    (light,) = read().scene.lights
    return light


def directions(picture):
    """Unit vectors (H, W, 3) of the picture's pixels and their solid angles (H, 1)."""
    height, width = picture.shape[:2]
    latitude = np.pi * ((np.arange(height) + 0.5) / height - 0.5)[:, None]
    azimuth = 2 * np.pi * (0.5 - (np.arange(width) + 0.5) / width)[None, :]
    level = np.cos(latitude)
    towards = [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(latitude) * np.ones((1, width))]
    return np.stack(towards, axis=-1), level * (np.pi / height) * (2 * np.pi / width)


def test_one_colour():
    world_of(lambda tree: ((0.1, 0.2, 0.3, 1), 2.0))
    light = only_light()
    assert isinstance(light, UniformWorld) and np.allclose(light.radiance, (0.2, 0.4, 0.6))
    assert "a world of one colour" in read().modelled


def test_one_colour_made_by_nodes():
    world_of(lambda tree: (node(tree, "ShaderNodeGamma", Color=(0.5, 0.5, 0.5, 1), Gamma=2.0).outputs[0], 1.0))
    assert np.allclose(only_light().radiance, 0.25)


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="every world has nodes since 5.0")
def test_a_world_without_nodes_has_its_own_colour():
    made = bpy.data.worlds.new("plain")
    made.color = (0.3, 0.2, 0.1)
    bpy.context.scene.world = made
    assert np.allclose(only_light().radiance, (0.3, 0.2, 0.1))


def test_black_missing_and_hidden_worlds_are_no_lights(scene):
    lamp("POINT")
    for make in (lambda: world((0, 0, 0)), lambda: setattr(scene, "world", None)):
        make()
        assert read().lights == 1
    made = world((1, 1, 1))
    made.cycles_visibility.diffuse = False
    result = read()
    assert result.lights == 1 and any("world" in sentence for sentence in result.left_out)


def test_a_world_that_varies_is_seen_the_right_way_round():
    # Radiance 0.6 + 0.5 x, 0.6 + 0.3 y, 0.6 + 0.2 z in the direction (x, y, z).
    def build(tree):
        towards = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
        made = node(tree, "ShaderNodeVectorMath", {"operation": "MULTIPLY_ADD"}, Vector=towards,
                    Vector_001=(0.5, 0.3, 0.2), Vector_002=(0.6, 0.6, 0.6))  # fmt: skip
        return made.outputs[0], 1.0

    world_of(build)
    before = all_counts()
    light = only_light()
    assert all_counts() == before
    assert isinstance(light, EnvironmentWorld)
    expected = 0.6 + directions(light.radiance)[0] * (0.5, 0.3, 0.2)
    assert np.abs(light.radiance - expected).max() < 0.01


def test_the_picture_shows_what_diffuse_rays_see():
    def build(tree):
        path = tree.nodes.new("ShaderNodeLightPath").outputs["Is Camera Ray"]
        towards = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
        both = node(tree, "ShaderNodeVectorMath", {"operation": "MULTIPLY_ADD"}, Vector=towards,
                    Vector_001=(0.1, 0.1, 0.1), Vector_002=path)  # fmt: skip
        return both.outputs[0], 1.0

    world_of(build)
    assert abs(only_light().radiance.mean()) < 0.01


def test_volumes_are_left_out_of_groups_too():
    # Cycles takes the outputs inside groups, and a volume at every sample, which costs fifty times as much.
    inner = bpy.data.node_groups.new("inner", "ShaderNodeTree")
    inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    background = inner.nodes.new("ShaderNodeBackground").outputs[0]
    inner.links.new(background, inner.nodes.new("NodeGroupOutput").inputs[0])
    volume = node(inner, "ShaderNodeVolumePrincipled", Density=5.0).outputs[0]
    inner.links.new(volume, inner.nodes.new("ShaderNodeOutputWorld").inputs["Volume"])
    world = bpy.data.worlds.new("made")
    tree = with_nodes(world)
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    tree.links.new(group.outputs[0], tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    with _seen_by_diffuse_light(world) as copy:
        (seen,) = (each.node_tree for each in copy.node_tree.nodes if each.bl_idname == "ShaderNodeGroup")
        assert seen is not inner and not any(link.to_socket.name == "Volume" for link in seen.links)
    assert any(link.to_socket.name == "Volume" for link in inner.links) and len(bpy.data.node_groups) == 1


def sky_image(spots, size=(1024, 2048), turn=None):
    """A world of grey 0.01 with bright texels, {(row, column): colour}, turned by a Mapping node."""
    pixels = np.full((*size, 4), 0.01, np.float32)
    pixels[..., 3] = 1
    for place, colour in spots.items():
        pixels[place][:3] = colour
    picture = image(pixels, "sky", "Non-Color", is_float=True)

    def build(tree):
        made = node(tree, "ShaderNodeTexEnvironment", {"image": picture, "interpolation": "Closest"})
        if turn is not None:
            towards = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
            mapping = node(tree, "ShaderNodeMapping", Vector=towards, Rotation=turn)
            tree.links.new(mapping.outputs[0], made.inputs[0])
        return made.outputs[0], 1.0

    world_of(build)


def texel(row, column, size=(1024, 2048)):
    """Towards the middle of a texel, and its solid angle."""
    latitude, azimuth = np.pi * ((row + 0.5) / size[0] - 0.5), 2 * np.pi * (0.5 - (column + 0.5) / size[1])
    level = math.cos(latitude)
    towards = np.array((level * math.cos(azimuth), level * math.sin(azimuth), math.sin(latitude)))
    edges = np.sin(np.pi * ((row + np.array([0, 1])) / size[0] - 0.5))
    return towards, np.diff(edges)[0] * 2 * math.pi / size[1]


def test_a_single_bright_texel_is_a_sun():
    """Two texels of a large image: each becomes a light of its own, and nothing of it stays in the picture."""
    places = {(800, 400): (9e4, 6e4, 3e4), (600, 1500): (2e4, 2e4, 4e4)}
    sky_image(places)
    *suns, sky = read().scene.lights
    assert len(suns) == 2 and np.allclose(sky.radiance, 0.01, rtol=1e-3)
    for sun, (place, colour) in zip(suns, places.items(), strict=True):
        towards, solid_angle = texel(*place)
        assert np.allclose(sun.irradiance, solid_angle * np.array(colour), rtol=0.02)
        assert np.degrees(np.arccos(-sun.direction @ towards)) < 0.02 and 0.05 < np.degrees(sun.angle) < 0.4


@pytest.mark.parametrize("angle", [0.4, 2.0, 3.7])
def test_a_sun_is_found_however_its_image_is_turned(angle):
    sky_image({(700, 1000): (5e4, 5e4, 5e4)}, turn=(0.0, 0.0, angle))
    (spot,) = spots(bpy.context.scene.world.node_tree, None)
    towards, _ = texel(700, 1000)
    # The node turns coordinates, so the image goes the other way.
    turn = np.array([[math.cos(angle), math.sin(angle), 0], [-math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    assert np.degrees(np.arccos(min(spot.towards @ (turn @ towards), 1.0))) < 0.02


def suns_of(*shown):
    """The suns under a world that mixes what the outputs of these nodes show, half of each."""
    tree = bpy.context.scene.world.node_tree
    mixed = node(tree, "ShaderNodeMixRGB", Fac=0.5, Color1=shown[0], Color2=shown[-1])
    background = next(each for each in tree.nodes if each.bl_idname == "ShaderNodeBackground")
    tree.links.new(mixed.outputs[0], background.inputs["Color"])
    return [light for light in read().scene.lights if hasattr(light, "irradiance")]


@pytest.mark.parametrize("kind", ["ShaderNodeTexSky", "ShaderNodeTexEnvironment"])
def test_a_sun_that_two_nodes_show_counts_once(kind):
    """Such as an image for the light, and the same turned darker for the camera."""
    sky_image({(700, 1000): (5e4, 5e4, 5e4)})
    tree = bpy.context.scene.world.node_tree
    picture = bpy.data.images["sky"]

    def made():
        other = tree.nodes.new(kind)
        if kind == "ShaderNodeTexSky":
            other.sun_elevation, other.sun_size = 0.7, 0.005
        else:
            other.image, other.interpolation = picture, "Closest"
        return other

    first = made()
    tree.nodes.remove(next(each for each in tree.nodes if each.bl_idname == "ShaderNodeTexEnvironment"))
    (once,) = suns_of(first.outputs[0])
    (both,) = suns_of(first.outputs[0], made().outputs[0])
    np.testing.assert_allclose(both.direction, once.direction, atol=1e-4)
    np.testing.assert_allclose(both.irradiance, once.irradiance, rtol=0.02)


def test_properties_of_the_scene_count_in_a_sky(scene):
    """The picture of it is made in a scene of its own, which has none."""
    scene["strength"], scene["tint"] = 0.5, (0.2, 0.4, 0.8)

    def build(tree):
        asked = [
            node(tree, "ShaderNodeAttribute", {"attribute_type": "VIEW_LAYER", "attribute_name": name}).outputs
            for name in ("strength", "tint")
        ]
        towards = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
        colour = node(tree, "ShaderNodeVectorMath", {"operation": "MULTIPLY_ADD"}, Vector=towards,
                      Vector_001=(0.1, 0.1, 0.1), Vector_002=asked[1]["Color"])  # fmt: skip
        return colour.outputs[0], asked[0]["Fac"]

    world_of(build)
    radiance = only_light().radiance
    mean = (radiance * directions(radiance)[1][..., None]).sum(axis=(0, 1)) / (4 * math.pi)
    np.testing.assert_allclose(mean, (0.1, 0.2, 0.4), rtol=0.01)


def test_what_is_no_small_spot_stays_in_the_picture():
    """A lamp of ten degrees, and a texel that is bright but brings next to nothing."""
    pixels = {(row, column): (30.0, 30.0, 30.0) for row in range(600, 656) for column in range(500, 556)}
    sky_image(pixels | {(300, 300): (5.0, 5.0, 5.0)})
    (light,) = read().scene.lights
    solid_angle = sum(texel(*place)[1] for place in pixels)
    flux = (light.radiance * directions(light.radiance)[1][..., None]).sum(axis=(0, 1)) - 4 * math.pi * 0.01
    assert np.allclose(flux, solid_angle * 30.0, rtol=0.02)


def test_sky_with_sun_against_cycles_own_bake(scene, size=0.1):
    """The light on planes facing many ways, as Cycles bakes it and as the sun and the picture give it."""

    def build(tree):
        sky = tree.nodes.new("ShaderNodeTexSky")
        sky.sun_elevation, sky.sun_rotation, sky.sun_size = 0.4, 0.7, math.radians(size)
        return sky.outputs[0], 0.1

    world_of(build)
    facing = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (-1, 0, 1)]
    sun, sky = read().scene.lights
    assert np.degrees(sun.angle) == pytest.approx(size, rel=1e-4)
    towards, solid_angle = directions(sky.radiance)
    expected = []
    for normal in facing:
        unit = np.array(normal) / np.linalg.norm(normal)
        weight = np.maximum(towards @ unit, 0) * solid_angle
        direct = sun.irradiance * max(-sun.direction @ unit, 0.0)
        expected.append(((sky.radiance * weight[..., None]).sum(axis=(0, 1)) + direct) / math.pi)
    baked = _baked_by_cycles(scene, facing)
    assert np.allclose(baked, expected, rtol=0.02)


def _baked_by_cycles(scene, facing):
    """E / pi that Cycles bakes onto small, far apart triangles with these normals."""
    from mathutils import Vector

    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples, scene.cycles.use_adaptive_sampling = "CPU", 256, False
    bpy.data.objects.remove(bpy.data.objects["quad"])
    objects = []
    for index, normal in enumerate(facing):
        turn = Vector(normal).to_track_quat("Z", "Y")
        data = bpy.data.meshes.new("plane")
        corners = [turn @ Vector(corner) for corner in ((-0.1, -0.1, 0), (0.1, -0.1, 0), (0, 0.1, 0))]
        data.from_pydata(corners, [], [(0, 1, 2)])
        data.color_attributes.new("bake", "FLOAT_COLOR", "CORNER")
        data.materials.append(bpy.data.materials.new("plane"))
        obj = bpy.data.objects.new("plane", data)
        obj.location = (1000 * index, 0, 0)
        scene.collection.objects.link(obj)
        obj.select_set(True)
        objects.append(obj)
    bpy.context.view_layer.objects.active = objects[0]
    settings = scene.render.bake
    settings.use_pass_color, settings.use_pass_direct, settings.use_pass_indirect = False, True, True
    bpy.ops.object.bake(type="DIFFUSE", target="VERTEX_COLORS")
    values = np.empty((len(objects), 3, 4), np.float32)
    for row, obj in zip(values, objects, strict=True):
        obj.data.attributes["bake"].data.foreach_get("color", row.ravel())
    return values[..., :3].mean(axis=1)
