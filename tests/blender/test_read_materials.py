"""Albedo, emission and transmittance of faces: constants, images, attributes, mixes, and what replaces the rest."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.detp_addon.reading.glass_bodies import mean_reflectance  # noqa: E402
from detp.detp_addon.reading.highlights import reflected_above  # noqa: E402
from made_scenes import (  # noqa: E402
    constant,
    diffuse,
    image,
    linked,
    map_to_unit_square,
    material,
    mesh,
    node,
    quad,
    read,
    with_nodes,
)

pytestmark = pytest.mark.usefixtures("scene")


def surface_of(build, obj=None):
    """The one albedo, emission and transmittance of a quad with the material, and all that was read."""
    obj = obj or quad()
    obj.data.materials.clear()
    obj.data.materials.append(material(build))
    result = read()
    scene = result.scene
    assert len(scene.triangles) == 2
    return scene.albedo.mean(axis=0), scene.emission.mean(axis=0), scene.transmittance.mean(axis=0), result


def principled(tree, **inputs):
    return node(tree, "ShaderNodeBsdfPrincipled", **inputs)


def colour(node_made, identifier="Color"):
    return next(socket for socket in node_made.outputs if socket.identifier == identifier)


def test_faces_without_material_are_blenders_grey():
    quad()
    bare = linked("slot", mesh([(0, 0, 1), (1, 0, 1), (0, 1, 1)], [(0, 1, 2)]))
    bare.data.materials.append(None)
    assert np.allclose(read().scene.albedo, 0.8)


def test_each_face_has_its_own_material():
    obj = linked("strip", mesh([(x, y, 0) for x in range(4) for y in (0, 1)], [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1)
                                                                               for k in range(3)]))  # fmt: skip
    for shade in ((1, 0, 0), (0, 1, 0)):
        obj.data.materials.append(diffuse(shade))
    for face, index in zip(obj.data.polygons, (1, 0, 7), strict=True):
        face.material_index = index
    result = read()
    place = result.scene.corners[:, :, 0].max(axis=1)
    expected = np.where((place == 2)[:, None], (1, 0, 0), (0, 1, 0))
    assert np.allclose(result.scene.albedo, expected)
    assert np.allclose(result.targets[0].albedo, np.repeat([(0, 1, 0), (1, 0, 0), (0, 1, 0)], 4, axis=0))


def test_slots_linked_to_the_object_win():
    first = quad("first")
    first.data.materials.append(diffuse((1, 0, 0)))
    second = linked("second", first.data, (5, 0, 0))
    second.material_slots[0].link = "OBJECT"
    second.material_slots[0].material = diffuse((0, 0, 1))
    scene = read().scene
    left = scene.corners[:, 0, 0] < 3
    assert np.allclose(scene.albedo[left], (1, 0, 0)) and np.allclose(scene.albedo[~left], (0, 0, 1))


def test_the_view_layers_material_override_wins():
    quad().data.materials.append(diffuse((1, 0, 0)))
    bpy.context.view_layer.material_override = diffuse((0, 1, 0))
    assert np.allclose(read().scene.albedo, (0, 1, 0))


def test_principled_splits_its_base_colour():
    albedo, emission, through, result = surface_of(lambda tree: principled(
        tree, Base_Color=(0.64, 0.36, 0.16, 1), Metallic=0.5, Transmission_Weight=0.5, Alpha=0.75,
        Emission_Color=(1, 2, 3, 1), Emission_Strength=2.0))  # fmt: skip
    base = np.array([0.64, 0.36, 0.16])
    clear = 0.5 * 0.5
    lost = mean_reflectance(np.array([[1.5]]), True)[0, 0]
    above = reflected_above(*np.array([1.5, 0.5])[:, None, None], np.ones((1, 3)), np.full((1, 1), 0.5))
    assert np.allclose(albedo, 0.75 * (base + above * (1 - base)) * (1 - 0.5 - clear), atol=1e-6)
    assert np.allclose(emission, 0.75 * 2 * np.array([1, 2, 3]))
    assert np.allclose(through, 0.25 + 0.75 * clear * (1 - lost) * np.sqrt(base))
    assert np.allclose(result.scene.specular.mirror, 0.75 * (0.5 * base + clear * lost))
    assert "highlights on the diffuse part of 1 material (material), which count as diffuse" in result.left_out
    for feature in ("emission of 1 material", "mirror reflection of 1 material"):
        assert feature in result.modelled


@pytest.mark.parametrize("kind, albedo, through", [
    ("ShaderNodeBsdfDiffuse", 1, 0),
    ("ShaderNodeSubsurfaceScattering", 1, 0),
    ("ShaderNodeBsdfTranslucent", 0, 0),
    ("ShaderNodeBsdfTransparent", 0, 1),
])  # fmt: skip
def test_plain_shaders(kind, albedo, through):
    shade = np.array([0.2, 0.4, 0.6])
    result = surface_of(lambda tree: node(tree, kind, Color=(*shade, 1)))
    assert np.allclose(result[0], albedo * shade) and np.allclose(result[2], through * shade)
    spread = result[3].scene.translucency
    assert spread is None if albedo + through else np.allclose(spread, shade)


def test_mixed_and_added_shaders_and_groups():
    def build(tree):
        group = bpy.data.node_groups.new("group", "ShaderNodeTree")
        group.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
        group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
        given, result = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
        inner = node(group, "ShaderNodeBsdfDiffuse", Color=given.outputs[0])
        group.links.new(inner.outputs[0], result.inputs[0])
        outer = tree.nodes.new("ShaderNodeGroup")
        outer.node_tree = group
        outer.inputs[0].default_value = (0.4, 0.4, 0.4, 1)
        bend = tree.nodes.new("NodeReroute")
        tree.links.new(outer.outputs[0], bend.inputs[0])
        glow = node(tree, "ShaderNodeEmission", Color=(1, 0.5, 0, 1), Strength=4.0)
        both = node(tree, "ShaderNodeAddShader", Shader=bend.outputs[0], Shader_001=glow.outputs[0])
        clear = node(tree, "ShaderNodeBsdfTransparent", Color=(1, 1, 1, 1))
        return node(tree, "ShaderNodeMixShader", Fac=0.25, Shader=both.outputs[0], Shader_001=clear.outputs[0])

    albedo, emission, through, _ = surface_of(build)
    assert np.allclose(albedo, 0.3) and np.allclose(emission, (3, 1.5, 0)) and np.allclose(through, 0.25)


def test_an_output_without_shader_is_black_and_a_volume_alone_is_clear():
    def volume(tree):
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(tree.nodes.new("ShaderNodeVolumePrincipled").outputs[0], output.inputs["Volume"])

    for build, clear in ((lambda tree: tree.nodes.new("ShaderNodeOutputMaterial"), 0), (volume, 1)):
        made = bpy.data.materials.new("bare")
        build(with_nodes(made))
        obj = quad()
        obj.data.materials.append(made)
        result = read()
        assert np.allclose(result.scene.albedo, 0) and np.allclose(result.scene.transmittance, clear)
        obj.hide_render = True
    assert any("volumes of 1 material (bare.001)" in sentence for sentence in result.left_out)


def test_impossible_colours_are_brought_down_and_named():
    def build(tree):
        white = node(tree, "ShaderNodeBsdfDiffuse", Color=(1, 0.2, -0.5, 1))
        clear = node(tree, "ShaderNodeBsdfTransparent", Color=(1, 0.2, 0, 1))
        return node(tree, "ShaderNodeAddShader", Shader=white.outputs[0], Shader_001=clear.outputs[0])

    albedo, _, through, result = surface_of(build)
    assert np.allclose(albedo, (0.5, 0.2, 0)) and np.allclose(through, (0.5, 0.2, 0))
    assert any("more light" in warning and "material" in warning for warning in result.warnings)


def halves(left, right, size=64):
    """Pixels (size, size, 4): the left half of one colour, the right half of another."""
    return np.concatenate([np.tile(side, (size, size // 2, 1)) for side in (left, right)], axis=1)


def textured(picture, settings=None, **vector):
    def build(tree):
        made = node(tree, "ShaderNodeTexImage", {"image": picture, **(settings or {})}, **vector)
        return node(tree, "ShaderNodeBsdfDiffuse", Color=colour(made))

    return build


def linear(value):
    return ((value + 0.055) / 1.055) ** 2.4


def test_images_are_averaged_over_each_triangle_as_linear_light():
    picture = image(halves((0.5, 0.5, 0.5, 1), (1, 0, 0, 1)))
    obj = quad()
    map_to_unit_square(obj)
    albedo = surface_of(textured(picture), obj)[0]
    assert np.allclose(albedo, [(linear(0.5) + 1) / 2, linear(0.5) / 2, linear(0.5) / 2], atol=2e-3)
    scene = read().scene
    # The triangle below the diagonal covers a quarter of the left half's weight: areas 1/8 and 3/8 of 1/2.
    shares = scene.corners[:, :, 0].mean(axis=1)
    right = np.where(shares > 0.5, 0.75, 0.25)
    assert np.allclose(scene.albedo[:, 0], right + (1 - right) * linear(0.5), atol=0.03)


@pytest.mark.parametrize("shader, socket", [
    ("Emission", "Color"), ("BsdfTransparent", "Color"), ("BsdfTranslucent", "Color"), ("BsdfDiffuse", "Color"),
])  # fmt: skip
def test_patterns_are_named_on_large_faces_alone(shader, socket):
    picture = image(halves((1, 0, 0, 1), (0, 0, 1, 1)))

    def build(tree):
        shown = node(tree, "ShaderNodeTexImage", {"image": picture})
        return node(tree, f"ShaderNode{shader}", **{socket: shown.outputs[0]})

    window = quad()
    map_to_unit_square(window)
    window.data.materials.append(material(build, "window"))
    assert ["window" in each for each in read().warnings] == [True]
    for corner in window.data.uv_layers[0].uv:
        corner.vector.x *= 0.4
    assert read().warnings == ()
    map_to_unit_square(window)
    quad("ground", size=50.0, location=(0, 0, -1))
    assert read().warnings == ()


def test_small_triangles_see_their_own_texels():
    picture = image(np.random.default_rng(3).random((8, 8, 4)) * (1, 1, 1, 0) + (0, 0, 0, 1), colour_space="Non-Color")
    vertices = [(x / 8, y / 8, 0) for y in range(9) for x in range(9)]
    faces = [(9 * y + x, 9 * y + x + 1, 9 * y + x + 10, 9 * y + x + 9) for y in range(8) for x in range(8)]
    obj = linked("grid", mesh(vertices, faces))
    map_to_unit_square(obj)
    obj.data.materials.append(material(textured(picture)))
    scene = read().scene
    cell = np.floor(scene.corners.mean(axis=1)[:, :2] * 8).astype(int)
    stored = np.array(picture.pixels[:]).reshape(8, 8, 4)
    assert np.allclose(scene.albedo, stored[cell[:, 1], cell[:, 0], :3], atol=1e-3)


@pytest.mark.parametrize("extension, expected", [("REPEAT", 0.5), ("EXTEND", 1.0), ("CLIP", 0.0)])
def test_mapping_and_extension(extension, expected):
    picture = image(halves((0, 0, 0, 1), (1, 1, 1, 1)), colour_space="Non-Color")

    def build(tree):
        uv = node(tree, "ShaderNodeUVMap", {"uv_map": "UVMap"})
        moved = node(tree, "ShaderNodeMapping", Vector=uv.outputs[0], Location=(4, 0, 0), Scale=(2, 2, 2))
        made = node(tree, "ShaderNodeTexImage", {"image": picture, "extension": extension}, Vector=moved.outputs[0])
        return node(tree, "ShaderNodeBsdfDiffuse", Color=colour(made))

    obj = quad()
    map_to_unit_square(obj)
    assert np.allclose(surface_of(build, obj)[0], expected, atol=0.02)


@pytest.mark.parametrize("turn", ["POINT", "TEXTURE"])
def test_mapping_turns_about_z(turn):
    picture = image(halves((0, 0, 0, 1), (1, 1, 1, 1)), colour_space="Non-Color")
    settings = {"vector_type": turn}

    def build(tree):
        uv = node(tree, "ShaderNodeUVMap")
        moved = node(tree, "ShaderNodeMapping", settings, Vector=uv.outputs[0], Rotation=(0, 0, np.pi / 2))
        made = node(tree, "ShaderNodeTexImage", {"image": picture, "extension": "EXTEND"}, Vector=moved.outputs[0])
        return node(tree, "ShaderNodeBsdfDiffuse", Color=colour(made))

    obj = quad()
    map_to_unit_square(obj)
    # Turned left, every U is negative; turned back, U is what V was.
    assert np.allclose(surface_of(build, obj)[0], 0.0 if turn == "POINT" else 0.5, atol=0.05)


def test_leaf_cards_let_light_pass_by_their_mean_alpha():
    picture = image(halves((0, 1, 0, 1), (1, 0, 1, 0)))

    def build(tree):
        made = node(tree, "ShaderNodeTexImage", {"image": picture})
        shades = {"Base_Color": colour(made), "Alpha": colour(made, "Alpha")}
        return principled(tree, **shades, Specular_IOR_Level=0.0)

    obj = quad()
    map_to_unit_square(obj)
    albedo, _, through, result = surface_of(build, obj)
    assert np.allclose(albedo, (0, 0.5, 0), atol=0.01) and np.allclose(through, 0.5, atol=0.01)
    assert "light passing straight through 1 material" in result.modelled


def test_clear_texels_are_black_where_the_alpha_is_not_used():
    picture = image(halves((0, 1, 0, 1), (1, 0, 1, 0)))
    obj = quad()
    map_to_unit_square(obj)
    assert np.allclose(surface_of(textured(picture), obj)[0], (0, 0.5, 0), atol=0.01)


def test_an_alpha_that_leads_nowhere_is_not_used():
    """Cycles drops the nodes that feed no output before it asks whether the alpha is used."""
    picture = image(halves((0, 1, 0, 1), (1, 0, 1, 0)))

    def build(tree):
        made = node(tree, "ShaderNodeTexImage", {"image": picture})
        node(tree, "ShaderNodeInvert", Color=made.outputs["Alpha"])
        return node(tree, "ShaderNodeBsdfDiffuse", Color=colour(made))

    obj = quad()
    map_to_unit_square(obj)
    assert np.allclose(surface_of(build, obj)[0], (0, 0.5, 0), atol=0.01)


def test_images_drive_emission():
    picture = image(halves((8, 0, 0, 1), (0, 4, 0, 1)), colour_space="Non-Color", is_float=True)

    def build(tree):
        made = node(tree, "ShaderNodeTexImage", {"image": picture})
        return node(tree, "ShaderNodeEmission", Color=colour(made), Strength=3.0)

    obj = quad()
    map_to_unit_square(obj)
    _, emission, _, result = surface_of(build, obj)
    assert np.allclose(emission, (12, 6, 0), atol=0.01)
    assert np.allclose(result.targets[0].emission.mean(axis=0), (12, 6, 0), atol=0.01)


def test_large_images_are_halved_without_losing_light():
    rows = np.zeros((1500, 3000, 4), np.float32)
    rows[..., 3] = 1
    rows[::2, ::3, 0] = 1
    obj = quad()
    map_to_unit_square(obj)
    assert np.allclose(surface_of(textured(image(rows, colour_space="Non-Color")), obj)[0], (1 / 6, 0, 0), rtol=0.01)


def test_missing_images_are_grey_and_named(tmp_path):
    picture = bpy.data.images.new("lost", 4, 4)
    picture.source = "FILE"
    picture.filepath = str(tmp_path / "nowhere.png")
    obj = quad()
    map_to_unit_square(obj)
    albedo, _, _, result = surface_of(textured(picture), obj)
    assert np.allclose(albedo, 0.8, atol=1e-3)
    assert any("missing images" in warning and "lost" in warning for warning in result.warnings)


def test_reading_an_image_does_not_keep_it_in_memory(tmp_path):
    made = image(halves((1, 1, 1, 1), (0, 0, 0, 1)))
    made.filepath_raw, made.file_format = str(tmp_path / "stored.png"), "PNG"
    made.save()
    stored = bpy.data.images.load(made.filepath_raw)
    assert not stored.has_data
    obj = quad()
    map_to_unit_square(obj)
    assert np.allclose(surface_of(textured(stored), obj)[0], 0.5, atol=0.01)
    assert not stored.has_data


@pytest.mark.parametrize(
    "kind, domain", [("FLOAT_COLOR", "POINT"), ("FLOAT_COLOR", "CORNER"), ("BYTE_COLOR", "CORNER")]
)
@pytest.mark.parametrize("asking", ["Vertex Color", "Attribute"])
def test_colour_attributes(kind, domain, asking):
    obj = quad()
    obj.data.color_attributes.new("paint", kind, domain)
    layer = obj.data.color_attributes["paint"]
    layer.data.foreach_set("color", np.tile((0.25, 0.5, 0.75, 1), 4).astype(np.float32))

    def build(tree):
        if asking == "Attribute":
            made = node(tree, "ShaderNodeAttribute", {"attribute_name": "paint"})
        else:
            made = node(tree, "ShaderNodeVertexColor", {"layer_name": ""})
        return node(tree, "ShaderNodeBsdfDiffuse", Color=colour(made))

    assert np.allclose(surface_of(build, obj)[0], (0.25, 0.5, 0.75), atol=0.01)


@pytest.mark.parametrize("asked, kind, output, found", [
    ("UVMap", "Attribute", "Fac", 0.2), ("UVMap", "Attribute", "Color", (0.2, 0.6, 0)), ("", "Attribute", "Color", 0),
    ("paint", "Attribute", "Fac", 0.3), ("none", "Attribute", "Alpha", 1), ("none", "VertexColor", "Alpha", 0),
    ("", "VertexColor", "Color", (0.1, 0.2, 0.6)), ("", "VertexColor", "Alpha", 0.4),
])  # fmt: skip
def test_attributes_are_what_cycles_makes_of_them(asked, kind, output, found):
    """As Cycles' EMIT bake gave them."""
    obj = quad()
    obj.data.uv_layers.new(name="UVMap").data.foreach_set("uv", [0.2, 0.6] * 4)
    paint = obj.data.color_attributes.new("paint", "FLOAT_COLOR", "CORNER")
    paint.data.foreach_set("color", [0.1, 0.2, 0.6, 0.4] * 4)
    obj.data.attributes.default_color_name = "paint"

    def build(tree):
        made = tree.nodes.new(f"ShaderNode{kind}")
        setattr(made, "attribute_name" if kind == "Attribute" else "layer_name", asked)
        return node(tree, "ShaderNodeEmission", Color=made.outputs[output])

    obj.data.materials.append(material(build))
    assert np.allclose(read().scene.emission, found, atol=1e-6)


@pytest.mark.parametrize("kind, mean", [
    ("LINEAR", 1 / 2), ("QUADRATIC", 1 / 3), ("EASING", 1 / 2), ("DIAGONAL", 1 / 2), ("RADIAL", 5 / 8),
    ("SPHERICAL", np.pi / 12), ("QUADRATIC_SPHERE", np.pi / 24), (1.0, 0.2), (2.0, 0.5), (1e6, 0.5),
])  # fmt: skip
def test_gradients_and_checkers_have_their_means_over_faces(kind, mean):
    """Integrals over the unit square; a number is a checker's scale, its colours 0.8 and 0.2."""
    obj = quad()
    obj.data.uv_layers.new(name="UVMap").data.foreach_set("uv", [0, 0, 1, 0, 1, 1, 0, 1])

    def build(tree):
        place = tree.nodes.new("ShaderNodeUVMap").outputs[0]
        if isinstance(kind, str):
            made = node(tree, "ShaderNodeTexGradient", {"gradient_type": kind}, Vector=place)
        else:
            given = {"Color1": (0.8, 0.8, 0.8, 1), "Color2": (0.2, 0.2, 0.2, 1)}
            made = node(tree, "ShaderNodeTexChecker", Vector=place, Scale=kind, **given)
        return node(tree, "ShaderNodeBsdfDiffuse", Color=colour(made))

    albedo, _, _, result = surface_of(build, obj)
    assert np.allclose(albedo.mean(axis=0), mean, atol=0.01)
    assert all("patterns on large faces" in warning for warning in result.warnings)


def test_attributes_that_a_mesh_lacks_are_black_and_named():
    def build(tree):
        made = node(tree, "ShaderNodeAttribute", {"attribute_name": "nothing"})
        return node(tree, "ShaderNodeBsdfDiffuse", Color=colour(made))

    albedo, _, _, result = surface_of(build)
    assert np.allclose(albedo, 0)
    assert any("nothing" in warning for warning in result.warnings)


def test_unknown_nodes_keep_the_sockets_own_value_and_are_named():
    def build(tree):
        made = tree.nodes.new("ShaderNodeWavelength")
        shader = node(tree, "ShaderNodeBsdfDiffuse", Color=(0.1, 0.2, 0.3, 1))
        tree.links.new(made.outputs[0], shader.inputs["Color"])
        return shader

    albedo, _, _, result = surface_of(build)
    assert np.allclose(albedo, (0.1, 0.2, 0.3))
    assert any("Wavelength" in warning and "1 material (material)" in warning for warning in result.warnings)


def test_patterns_count_as_their_mean_and_are_named():
    def build(tree):
        made = tree.nodes.new("ShaderNodeTexNoise")
        ramp = tree.nodes.new("ShaderNodeValToRGB")
        tree.links.new(made.outputs["Fac" if bpy.app.version < (5, 0) else 0], ramp.inputs[0])
        ramp.color_ramp.elements[1].color = (0.6, 0.2, 0.4, 1)
        return node(tree, "ShaderNodeBsdfDiffuse", Color=colour(ramp))

    albedo, _, _, result = surface_of(build)
    assert np.allclose(albedo, (0.3, 0.1, 0.2), atol=0.01)
    assert any("Noise" in warning for warning in result.warnings)


def mixed(tree, blend, factor=0.5):
    made = node(tree, "ShaderNodeMix", {"data_type": "RGBA", "blend_type": blend}, Factor_Float=factor)
    tree.links.new(constant(tree, (0.2, 0.4, 0.8)), next(s for s in made.inputs if s.identifier == "A_Color"))
    tree.links.new(constant(tree, (0.6, 0.5, 0.1)), next(s for s in made.inputs if s.identifier == "B_Color"))
    return colour(made, "Result_Color")


def ramp_output(tree):
    ramp = node(tree, "ShaderNodeValToRGB", Fac=0.25)
    ramp.color_ramp.elements[1].color = (1, 0.5, 0.25, 1)
    return colour(ramp)


COLOURS = {
    "mix": (lambda tree: mixed(tree, "MIX"), (0.4, 0.45, 0.45)),
    "multiply": (lambda tree: mixed(tree, "MULTIPLY", 1.0), (0.12, 0.2, 0.08)),
    "add": (lambda tree: mixed(tree, "ADD"), (0.5, 0.65, 0.85)),
    "screen": (lambda tree: mixed(tree, "SCREEN", 1.0), (0.68, 0.7, 0.82)),
    "ramp": (ramp_output, (0.25, 0.125, 0.0625)),
    "invert": (lambda tree: colour(node(tree, "ShaderNodeInvert", Fac=1.0, Color=(0.1, 0.2, 0.3, 1))), (0.9, 0.8, 0.7)),
    "gamma": (lambda tree: colour(node(tree, "ShaderNodeGamma", Color=(0.5, 0.4, 0.3, 1), Gamma=2.0)),
              (0.25, 0.16, 0.09)),
    "hue": (lambda tree: colour(node(tree, "ShaderNodeHueSaturation", Hue=5 / 6, Saturation=1.0, Value=1.0, Fac=1.0,
                                     Color=(0.6, 0.1, 0.1, 1))), (0.1, 0.6, 0.1)),
    "grey": (lambda tree: node(tree, "ShaderNodeMath", {"operation": "MULTIPLY"}, Value=0.5, Value_001=0.6).outputs[0],
             (0.3, 0.3, 0.3)),
    "luminance": (lambda tree: node(tree, "ShaderNodeRGBToBW", Color=(1, 0, 0, 1)).outputs[0], (0.2126,) * 3),
    "split": (lambda tree: node(tree, "ShaderNodeCombineColor", Red=0.1,
                                Green=node(tree, "ShaderNodeSeparateColor", Color=(0.3, 0.7, 0, 1)).outputs[1]
                                ).outputs[0], (0.1, 0.7, 0)),
    "curves": (lambda tree: colour(node(tree, "ShaderNodeRGBCurve", Fac=1.0, Color=(0.2, 0.4, 0.6, 1))),
               (0.2, 0.4, 0.6)),
    "blackbody": (lambda tree: node(tree, "ShaderNodeBlackbody", Temperature=12000.0).outputs[0], (0.826, 0.995, 1.0)),
}  # fmt: skip


@pytest.mark.parametrize("name", COLOURS)
def test_colours_are_computed_as_by_cycles(name):
    make, expected = COLOURS[name]
    albedo = surface_of(lambda tree: node(tree, "ShaderNodeBsdfDiffuse", Color=make(tree)))[0]
    assert np.allclose(albedo, expected, atol=4e-3)


def test_light_paths_are_those_of_diffuse_light():
    def build(tree):
        path = tree.nodes.new("ShaderNodeLightPath")
        solid = node(tree, "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1))
        clear = tree.nodes.new("ShaderNodeBsdfTransparent")
        return node(tree, "ShaderNodeMixShader", Fac=path.outputs["Is Camera Ray"], Shader=solid.outputs[0],
                    Shader_001=clear.outputs[0])  # fmt: skip

    albedo, _, through, _ = surface_of(build)
    assert np.allclose(albedo, 0.5) and np.allclose(through, 0)


@pytest.mark.skipif(bpy.app.version < (5, 2), reason="shaders have no menus before")
@pytest.mark.parametrize("kind", ["RGBA", "SHADER"])
def test_menus_choose_what_they_show(kind):
    def build(tree):
        red, green = (node(tree, "ShaderNodeEmission", Color=(*rgb, 1)).outputs[0] for rgb in np.eye(3)[:2])
        switch = node(tree, "GeometryNodeMenuSwitch", {"data_type": kind})
        for socket, shader, rgb in zip(switch.inputs[1:3], (red, green), np.eye(3), strict=False):
            if kind == "SHADER":
                tree.links.new(shader, socket)
            else:
                socket.default_value = (*rgb, 1)
        switch.inputs[0].default_value = "B"
        return switch.outputs[0]

    _, emission, _, result = surface_of(build, quad())
    assert np.allclose(emission, (0, 1, 0)) and result.warnings == ()


def test_parts_of_properties_are_none_as_in_cycles():
    def build(tree):
        asked = {"attribute_type": "OBJECT", "attribute_name": "color[0]"}
        return node(tree, "ShaderNodeEmission", Color=node(tree, "ShaderNodeAttribute", asked).outputs["Color"])

    obj = quad()
    obj.color = (1, 1, 1, 1)
    assert np.allclose(surface_of(build, obj)[1], 0)


def test_one_sentence_names_many_materials():
    for index in range(5):
        obj = quad(location=(index, 0, 0))
        obj.data.materials.append(material(lambda tree: principled(tree, Coat_Weight=1.0), f"varnish {index}"))
    sentences = [sentence for sentence in read().left_out if "coat" in sentence]
    assert sentences == ["coat of 5 materials (varnish 0, varnish 1, varnish 2, ...)"]


def test_a_shader_that_cycles_does_not_know_is_black_as_there():
    """Half of an EEVEE Specular BSDF and half of a diffuse one."""

    def build(tree):
        mix = tree.nodes.new("ShaderNodeMixShader")
        for number, kind in ((1, "ShaderNodeEeveeSpecular"), (2, "ShaderNodeBsdfDiffuse")):
            tree.links.new(tree.nodes.new(kind).outputs[0], mix.inputs[number])
        return mix.outputs[0]

    albedo, _, _, result = surface_of(build)
    assert np.allclose(albedo, 0.4)
    assert not result.warnings and not result.left_out


def test_light_that_differs_by_the_kind_of_ray_is_named_and_is_that_of_rays_to_lamps():
    """Cycles finds it by both kinds, each by a share that depends on its sampling."""

    def build(tree):
        strength = node(tree, "ShaderNodeMath", {"operation": "MULTIPLY_ADD"})
        tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs["Is Diffuse Ray"], strength.inputs[0])
        strength.inputs[1].default_value, strength.inputs[2].default_value = 5.0, 2.0
        shader = tree.nodes.new("ShaderNodeEmission")
        tree.links.new(strength.outputs[0], shader.inputs["Strength"])
        return shader.outputs[0]

    _, emission, _, result = surface_of(build)
    assert np.allclose(emission, 2.0)
    assert [sentence.split(" of ")[0] for sentence in result.left_out] == ["light"]
