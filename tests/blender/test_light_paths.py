"""Light Path nodes, also inside node groups, tell what diffuse light sees: in worlds, lamps and materials."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.lights.environment import EnvironmentWorld  # noqa: E402
from detp.core.lights.world import UniformWorld  # noqa: E402
from made_scenes import all_counts, fresh, lamp, material, node, quad, read, with_nodes, world  # noqa: E402

#: E / pi that Cycles' bake gives under a world of radiance 0.8 times the output
CYCLES_WORLD = {"Is Camera Ray": 0, "Is Shadow Ray": 0, "Is Diffuse Ray": 1, "Is Glossy Ray": 0, "Is Singular Ray": 0,
                "Is Reflection Ray": 1, "Is Transmission Ray": 0, "Ray Length": 0, "Ray Depth": 2, "Diffuse Depth": 1,
                "Glossy Depth": 0, "Transparent Depth": 0, "Transmission Depth": 0}  # fmt: skip
CYCLES_LAMP = CYCLES_WORLD | {"Is Diffuse Ray": 0, "Is Reflection Ray": 0, "Ray Depth": 1, "Diffuse Depth": 0}


@pytest.fixture(autouse=True)
def floor():
    fresh()
    return quad()


def grouped(tree, build, depth=1, kind="NodeSocketShader"):
    """A node of ``tree`` whose group, that many groups deep, gives the output that ``build(tree)`` returns."""
    group = bpy.data.node_groups.new("group", "ShaderNodeTree")
    group.interface.new_socket("Result", in_out="OUTPUT", socket_type=kind)
    output = build(group) if depth == 1 else grouped(group, build, depth - 1, kind)
    group.links.new(output, group.nodes.new("NodeGroupOutput").inputs[0])
    holder = tree.nodes.new("ShaderNodeGroup")
    holder.node_tree = group
    return holder.outputs[0]


def path(tree, output, mute=False):
    made = tree.nodes.new("ShaderNodeLightPath")
    made.mute = mute
    return made.outputs[output]


def gradient(tree):
    """Radiance 0.5 z + 0.6 in the direction (x, y, z), in all channels."""
    towards = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    height = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(towards, height.inputs[0])
    return node(tree, "ShaderNodeMath", {"operation": "MULTIPLY_ADD"}, Value=height.outputs[2], Value_001=0.5,
                Value_002=0.6).outputs[0]  # fmt: skip


def background(tree, **inputs):
    return node(tree, "ShaderNodeBackground", **inputs).outputs[0]


def world_of(build):
    made = world((0, 0, 0))
    tree = with_nodes(made)
    tree.links.new(build(tree), tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    return made


def radiance():
    """The mean colour of the world's light, 0 without any."""
    lights = read().scene.lights
    return (
        np.mean([light.radiance for light in lights], axis=tuple(range(np.ndim(lights[0].radiance)))) if lights else 0
    )


@pytest.mark.parametrize("depth", [0, 1, 3])
@pytest.mark.parametrize("output", CYCLES_WORLD)
def test_even_worlds_show_what_cycles_sees(output, depth):
    def build(tree):
        return background(tree, Color=(0.8, 0.8, 0.8, 1), Strength=path(tree, output))

    world_of(lambda tree: grouped(tree, build, depth) if depth else build(tree))
    assert radiance() == pytest.approx(0.8 * CYCLES_WORLD[output], rel=1e-6)


@pytest.mark.parametrize("how", ["shader", "colour", "old colour"])
def test_a_background_for_the_camera_alone_is_no_light(how):
    """The rest is one colour, so no picture is needed, and no noise comes in."""

    def mixed(tree):
        seen = path(tree, "Is Camera Ray")
        if how == "shader":
            return node(tree, "ShaderNodeMixShader", Fac=seen, Shader=background(tree, Color=(0.5, 0.4, 0.3, 1)),
                        Shader_001=background(tree, Strength=gradient(tree))).outputs[0]  # fmt: skip
        if how == "colour":
            mix = node(tree, "ShaderNodeMix", {"data_type": "RGBA"}, Factor_Float=seen, A_Color=(0.5, 0.4, 0.3, 1),
                       B_Color=gradient(tree))  # fmt: skip
            return background(tree, Color=next(socket for socket in mix.outputs if socket.type == "RGBA"))
        mix = node(tree, "ShaderNodeMixRGB", Fac=seen, Color1=(0.5, 0.4, 0.3, 1), Color2=gradient(tree))
        return background(tree, Color=mix.outputs[0])

    world_of(lambda tree: grouped(tree, mixed, 2))
    (light,) = read().scene.lights
    assert isinstance(light, UniformWorld) and np.allclose(light.radiance, (0.5, 0.4, 0.3))


def test_pictures_of_worlds_see_into_groups_and_leave_them_alone():
    """Of the gradient's zenith comes 1.1 as diffuse rays see it; as the camera does, 5 more."""

    def mixed(tree):
        lit = background(tree, Strength=gradient(tree), Color=(1, 1, 1, 1))
        shown = background(tree, Strength=5.0, Color=(1, 1, 1, 1))
        both = node(tree, "ShaderNodeAddShader", Shader=lit, Shader_001=shown).outputs[0]
        return node(tree, "ShaderNodeMixShader", Fac=path(tree, "Is Camera Ray"), Shader=lit, Shader_001=both).outputs[
            0
        ]

    made = world_of(lambda tree: grouped(tree, mixed, 2))
    before = all_counts()
    (light,) = read().scene.lights
    assert all_counts() == before
    assert isinstance(light, EnvironmentWorld)
    assert np.allclose(light.radiance[-1], 1.1, atol=0.01) and np.allclose(light.radiance[0], 0.1, atol=0.01)
    inner = made.node_tree.nodes["Group"].node_tree.nodes["Group"].node_tree
    assert any(link.from_node.bl_idname == "ShaderNodeLightPath" for link in inner.links)


@pytest.mark.parametrize("colour", ["even", "gradient"])
def test_a_muted_light_path_leaves_the_value_that_is_set(colour):
    """In Cycles, too: a background's strength of 1."""

    def build(tree):
        tint = (0.6, 0.6, 0.6, 1) if colour == "even" else gradient(tree)
        return background(tree, Color=tint, Strength=path(tree, "Is Camera Ray", mute=True))

    world_of(build)
    assert np.allclose(radiance(), 0.6, atol=0.01)


def test_what_only_mirrors_see_is_named_where_there_are_any(floor):
    def glowing(tree):
        return node(tree, "ShaderNodeEmission", Strength=path(tree, "Is Glossy Ray"))

    world_of(lambda tree: background(tree, Color=(1, 1, 1, 1), Strength=path(tree, "Is Transmission Ray")))
    floor.data.materials.append(material(glowing))
    assert not any("mirrors" in each for each in read().left_out)
    quad("mirror").data.materials.append(material(lambda tree: tree.nodes.new("ShaderNodeBsdfGlass")))
    named = [each for each in read().left_out if "mirrors" in each]
    assert len(named) == 2 and any("world" in each for each in named)


@pytest.mark.parametrize("tint", [lambda tree: (0.6, 0.6, 0.6, 1), gradient])
def test_the_world_is_infinitely_far_away(tint):
    """Cycles tells the largest number there is, which most scenes cut."""

    def build(tree):
        cut = node(tree, "ShaderNodeMath", {"operation": "MINIMUM"}, Value=path(tree, "Ray Length"), Value_001=0.5)
        return background(tree, Color=tint(tree), Strength=cut.outputs[0])

    world_of(build)
    assert np.allclose(radiance(), 0.3, atol=0.01)


@pytest.mark.parametrize("build, word", [
    (lambda tree: tree.nodes.new("ShaderNodeTexCoord").outputs["Window"], "camera"),
    (lambda tree: tree.nodes.new("ShaderNodeCameraData").outputs["View Vector"], "camera"),
    (lambda tree: path(tree, "Ray Depth"), "Ray Depth"),
    (gradient, None),
])  # fmt: skip
def test_what_no_picture_of_a_world_can_show_is_named(build, word):
    world_of(lambda tree: background(tree, Color=build(tree)))
    found = read()
    assert [word in each for each in (*found.left_out, *found.warnings)] == ([] if word is None else [True])


@pytest.mark.parametrize("depth", [0, 2])
@pytest.mark.parametrize("output", [name for name in CYCLES_LAMP if name != "Ray Length"])
def test_lamps_give_what_cycles_gives(output, depth):
    world((0, 0, 0))
    lamp("SUN", energy=0.125)
    made = lamp("POINT", energy=10.0)

    def build(tree):
        return node(tree, "ShaderNodeEmission", Strength=path(tree, output), Color=(1, 1, 1, 1)).outputs[0]

    tree = with_nodes(made.data)
    tree.links.new(grouped(tree, build, depth) if depth else build(tree),
                   tree.nodes.new("ShaderNodeOutputLight").inputs["Surface"])  # fmt: skip
    powers = [light.power for light in read().scene.lights if hasattr(light, "power")]
    assert np.allclose(sum(powers, np.zeros(3)), 10 * CYCLES_LAMP[output])


def test_a_strength_that_grows_with_the_way_of_the_light_is_named():
    tree = with_nodes(lamp("POINT", "far").data)
    emission = node(tree, "ShaderNodeEmission", Strength=path(tree, "Ray Length"))
    tree.links.new(emission.outputs[0], tree.nodes.new("ShaderNodeOutputLight").inputs["Surface"])
    assert any("far" in warning for warning in read().warnings)


@pytest.mark.parametrize("depth", [1, 3])
def test_materials_for_the_camera_alone_reflect_what_diffuse_light_sees(floor, depth):
    def build(tree):
        pattern = node(tree, "ShaderNodeBsdfDiffuse", Color=tree.nodes.new("ShaderNodeTexNoise").outputs[0]).outputs[0]
        plain = node(tree, "ShaderNodeBsdfDiffuse", Color=(0.3, 0.2, 0.1, 1)).outputs[0]
        return node(tree, "ShaderNodeMixShader", Fac=path(tree, "Is Camera Ray"), Shader=plain,
                    Shader_001=pattern).outputs[0]  # fmt: skip

    floor.data.materials.append(material(lambda tree: grouped(tree, build, depth)))
    result = read()
    assert np.allclose(result.scene.albedo, (0.3, 0.2, 0.1))
    assert result.warnings == ()  # the pattern is seen by the camera alone


def test_groups_hand_on_what_stands_outside_them(floor):
    """An input that is linked, one that has a value of its own, and one of a group in a group."""

    def build(tree):
        group = bpy.data.node_groups.new("mix", "ShaderNodeTree")
        for name, kind in (("Share", "NodeSocketFloat"), ("Tint", "NodeSocketColor")):
            group.interface.new_socket(name, in_out="INPUT", socket_type=kind)
        group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
        given = group.nodes.new("NodeGroupInput")
        tinted = node(group, "ShaderNodeBsdfDiffuse", Color=given.outputs["Tint"]).outputs[0]
        glow = node(group, "ShaderNodeEmission", Color=given.outputs["Tint"], Strength=2.0).outputs[0]
        mix = node(group, "ShaderNodeMixShader", Fac=given.outputs["Share"], Shader=tinted, Shader_001=glow)
        group.links.new(mix.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
        holder = tree.nodes.new("ShaderNodeGroup")
        holder.node_tree = group
        holder.inputs["Tint"].default_value = (0.4, 0.6, 0.8, 1)
        quarter = grouped(tree, lambda inner: node(inner, "ShaderNodeMath", {"operation": "MULTIPLY"}, Value=0.25,
                                                   Value_001=path(inner, "Ray Depth")).outputs[0],
                          2, "NodeSocketFloat")  # fmt: skip
        tree.links.new(quarter, holder.inputs["Share"])
        return holder

    floor.data.materials.append(material(build))
    scene = read().scene
    assert np.allclose(scene.albedo, np.multiply(0.75, (0.4, 0.6, 0.8)))
    assert np.allclose(scene.emission, np.multiply(0.5, (0.4, 0.6, 0.8)))
