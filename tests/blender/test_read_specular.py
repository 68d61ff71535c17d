"""Metals and glass as they are read: colours, roughness, normals, and which glass refracts."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.bake import bake  # noqa: E402
from detp.core.points import Points  # noqa: E402
from detp.core.settings import BakeSettings  # noqa: E402
from detp.core.stages import finished  # noqa: E402
from detp.detp_addon.reading.glass_bodies import mean_reflectance  # noqa: E402
from made_scenes import cube, fresh, image, lamp, linked, map_to_unit_square, material, mesh, node, quad, read  # noqa: E402

pytestmark = pytest.mark.usefixtures("scene")


def worn(obj, kind, settings=None, **inputs):
    """What is read of ``obj`` alone, in a shader of that kind."""
    obj.data.materials.append(material(lambda tree: node(tree, f"ShaderNode{kind}", settings, **inputs)))
    result = read()
    return result.scene, result


def sphere(segments=48, location=(0, 0, 0)):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=segments // 2, location=location)
    bpy.ops.object.shade_smooth()
    return bpy.context.object


SHADE = (0.2, 0.4, 0.6)


@pytest.mark.parametrize("kind, inputs", [
    ("BsdfPrincipled", {"Base_Color": (*SHADE, 1), "Metallic": 1.0, "Roughness": 0.3}),
    ("BsdfAnisotropic", {"Color": (*SHADE, 1), "Roughness": 0.3}),
    pytest.param("BsdfMetallic", {"Base_Color": (*SHADE, 1), "Roughness": 0.3}, marks=pytest.mark.skipif(
        not hasattr(bpy.types, "ShaderNodeBsdfMetallic"), reason="came with Blender 4.3")),
])  # fmt: skip
def test_metals_reflect_their_colour_and_nothing_else(kind, inputs):
    settings = {"fresnel_type": "F82"} if kind == "BsdfMetallic" else None
    scene, result = worn(quad(), kind, settings, **inputs)
    assert not scene.albedo.any() and not scene.transmittance.any()
    assert np.allclose(scene.specular.mirror, SHADE) and not scene.specular.clear.any()
    assert scene.specular.triangles.tolist() == [0, 1]
    assert np.allclose(scene.specular.roughness, 0.3**2)
    assert np.allclose(scene.specular.normals, (0, 0, 1))
    assert "mirror reflection of 1 material" in result.modelled
    assert not any("highlights" in sentence for sentence in result.left_out)
    # What is shown in the metal's own colour stays so.
    assert np.allclose(result.targets[0].albedo, SHADE)


def test_a_physical_conductor_reflects_by_its_index_and_extinction():
    if not hasattr(bpy.types, "ShaderNodeBsdfMetallic"):
        pytest.skip("came with Blender 4.3")
    scene, _ = worn(quad(), "BsdfMetallic", {"fresnel_type": "PHYSICAL_CONDUCTOR"},
                    IOR=(2.0, 1.0, 0.5), Extinction=(3.0, 2.0, 4.0))  # fmt: skip
    assert np.allclose(scene.specular.mirror, [(1 + 9) / (9 + 9), 4 / 8, (0.25 + 16) / (2.25 + 16)])


def test_plain_plastic_makes_no_specular_scene():
    scene, _ = worn(quad(), "BsdfPrincipled", Base_Color=(*SHADE, 1), Specular_IOR_Level=0.0)
    assert scene.specular is None and np.allclose(scene.albedo, SHADE)


def test_a_hint_of_metal_counts_as_diffuse():
    scene, _ = worn(quad(), "BsdfPrincipled", Base_Color=(*SHADE, 1), Metallic=0.01, Specular_IOR_Level=0.0)
    assert scene.specular is None and np.allclose(scene.albedo, SHADE)


# What Cycles 4.5 reflects of a white sky off a white metal whose distribution is GGX, a mean by the cosine over angles.
@pytest.mark.parametrize("roughness, kept", [(0.0, 1.0), (0.3, 0.977), (0.5, 0.883), (0.7, 0.708), (1.0, 0.409)])
@pytest.mark.parametrize("kind, colour, metal", [
    ("BsdfPrincipled", "Base_Color", {"Metallic": 1.0}), ("BsdfAnisotropic", "Color", {}),
])  # fmt: skip
def test_metals_lose_what_facets_block_unless_light_goes_on_between_them(kind, colour, metal, roughness, kept):
    shade = {colour: (*SHADE, 1), "Roughness": roughness, **metal}
    for distribution, share in (("GGX", kept), ("MULTI_GGX", 1.0)):
        fresh()
        scene, result = worn(quad(), kind, {"distribution": distribution}, **shade)
        assert np.allclose(scene.specular.mirror, share * np.array(SHADE), rtol=0.005)
        assert not any("microfacets" in sentence for sentence in result.left_out)


# What Cycles 4.5 lets through and reflects together, of a white sky at both sides of a clear pane.
@pytest.mark.parametrize("roughness, kept", [(0.2, 0.985), (0.3, 0.949), (0.5, 0.788)])
def test_each_side_of_a_rough_pane_loses_what_facets_block(roughness, kept):
    pane = cube()
    for vertex in pane.data.vertices:
        vertex.co.z *= 0.01
    scene, _ = worn(pane, "BsdfGlass", {"distribution": "GGX"}, Color=(1, 1, 1, 1), Roughness=roughness)
    assert np.allclose((scene.transmittance + scene.specular.mirror) ** 2, kept, rtol=0.013)


def test_other_microfacets_are_named_where_they_are_rough():
    for roughness in (0.0, 0.5):
        fresh()
        _, result = worn(quad(), "BsdfAnisotropic", {"distribution": "BECKMANN"}, Roughness=roughness)
        assert any("microfacets" in sentence for sentence in result.left_out) == (roughness > 0)


@pytest.mark.parametrize("kind, inputs, gloss, clear", [
    ("BsdfGlass", {"Color": (*SHADE, 1), "IOR": 1.4, "Roughness": 0.1}, SHADE, SHADE),
    ("BsdfRefraction", {"Color": (*SHADE, 1), "IOR": 1.4, "Roughness": 0.1}, SHADE, SHADE),
    ("BsdfPrincipled", {"Base_Color": (*SHADE, 1), "Transmission_Weight": 1.0, "IOR": 1.4, "Roughness": 0.1}, (1, 1, 1),
     np.sqrt(SHADE)),
])  # fmt: skip
def test_a_body_of_glass_refracts(kind, inputs, gloss, clear):
    scene, result = worn(cube(), kind, **inputs)
    table = scene.specular
    assert len(table.triangles) == 12 and not scene.albedo.any() and not scene.transmittance.any()
    # Even smooth microfacets block a thousandth of light that grazes.
    assert np.allclose(table.gloss, gloss, rtol=2e-3) and np.allclose(table.clear, clear, rtol=2e-3)
    assert not table.mirror.any()
    assert np.allclose(table.ior, 1.4) and np.allclose(table.roughness, 0.01)
    assert any(sentence.startswith("refraction of 1 material") for sentence in result.modelled)


def test_half_transparent_glass_shares_the_light():
    scene, _ = worn(cube(), "BsdfPrincipled", Base_Color=(1, 1, 1, 1), Transmission_Weight=0.5, Alpha=0.75, IOR=1.3)
    assert np.allclose(scene.transmittance, 0.25) and np.allclose(scene.albedo, 0.375)
    assert np.allclose(scene.specular.clear, 0.375) and np.allclose(scene.specular.ior, 1.3)


def test_glass_without_a_body_passes_light_straight_on():
    shade, two = np.array(SHADE), mean_reflectance(np.array([[1.5]]), True)[0, 0]
    scene, _ = worn(quad(), "BsdfGlass", Color=(*SHADE, 1), IOR=1.5)
    assert np.allclose(scene.transmittance, (1 - two) * shade) and np.allclose(scene.specular.mirror, two * shade)
    assert not scene.specular.clear.any()
    # The mean over all angles of what a boundary of glass reflects is 9 %.
    assert mean_reflectance(np.array([[1.5]]), False)[0, 0] == pytest.approx(0.0918, abs=1e-3)


def test_a_pane_passes_light_straight_on_at_each_side():
    one = mean_reflectance(np.array([[1.5]]), False)[0, 0]
    scene, _ = worn(cube(scale=(1, 1, 0.01)), "BsdfGlass", Color=(1, 1, 1, 1), IOR=1.5)
    # Its shape before scaling is a cube's: what counts is the mesh, as it was modelled.
    assert scene.specular.clear.any()
    fresh()
    flat = cube()
    for vertex in flat.data.vertices:
        vertex.co.z *= 0.01
    scene, _ = worn(flat, "BsdfGlass", Color=(1, 1, 1, 1), IOR=1.5)
    assert np.allclose(scene.transmittance, 1 - one) and np.allclose(scene.specular.mirror, one)


def test_an_index_of_one_bends_nothing():
    scene, _ = worn(cube(), "BsdfGlass", Color=(*SHADE, 1), IOR=1.0)
    assert scene.specular is None or not scene.specular.mirror.any()
    assert np.allclose(scene.transmittance, SHADE)


def test_thin_walls_let_light_pass_once():
    probe = node(material(lambda tree: node(tree, "ShaderNodeBsdfPrincipled")).node_tree, "ShaderNodeBsdfPrincipled")
    if not any(socket.identifier == "Thin Wall" for socket in probe.inputs):
        pytest.skip("this Blender has no thin walls")
    scene, _ = worn(cube(), "BsdfPrincipled", Base_Color=(*SHADE, 1), Transmission_Weight=1.0, Thin_Wall=True)
    lost = mean_reflectance(np.array([[1.5]]), True)[0, 0]
    assert np.allclose(scene.transmittance, (1 - lost) * np.array(SHADE))
    assert np.allclose(scene.specular.mirror, lost) and not scene.specular.clear.any()


def test_bodies_are_closed_part_by_part_whatever_vertices_they_share():
    """A cube with split vertices is closed; one without its lid is not; both in one mesh."""
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    quads = [[(x, y, 0) for x, y in square][::-1], [(x, y, 1) for x, y in square]]
    quads += [[(*a, 0), (*b, 0), (*b, 1), (*a, 1)] for a, b in zip(square, square[1:] + square[:1], strict=True)]
    split = np.array(quads, float).reshape(-1, 3)
    faces = [tuple(range(4 * k, 4 * k + 4)) for k in range(6)]
    beside = [tuple(np.array(face) + 24) for face in faces if face != faces[1]]
    obj = linked("both", mesh([*split.tolist(), *(split + (3, 0, 0)).tolist()], faces + beside))
    scene, _ = worn(obj, "BsdfGlass", Color=(1, 1, 1, 1))
    first = scene.corners[:, 0, 0] < 2
    assert not scene.transmittance[first].any() and (scene.transmittance[~first] > 0.8).all()


def test_spheres_keep_their_normals_when_scaled_and_mirrored():
    obj = sphere(location=(1, 2, 3))
    obj.scale = (-1, 2, 0.5)
    scene, _ = worn(obj, "BsdfGlass", Color=(1, 1, 1, 1))
    corners = scene.corners[scene.specular.triangles]
    # The gradient of the ellipsoid's equation.
    expected = (corners - (1, 2, 3)) / np.array((1, 4, 0.25))
    expected /= np.linalg.norm(expected, axis=2, keepdims=True)
    assert np.allclose(scene.specular.normals, expected, atol=0.02)
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ti,tci->tc", flat, expected) > 0).all()


def test_textures_say_where_a_surface_is_metal():
    picture = image(np.concatenate([np.zeros((64, 32, 4)), np.ones((64, 32, 4))], axis=1), colour_space="Non-Color")
    obj = quad()
    map_to_unit_square(obj)

    def build(tree):
        texture = node(tree, "ShaderNodeTexImage", {"image": picture})
        inputs = {"Base_Color": (0.5, 0.5, 0.5, 1), "Roughness": 0.2, "Specular_IOR_Level": 0.0}
        rough = node(tree, "ShaderNodeBsdfPrincipled", **inputs)
        tree.links.new(texture.outputs[0], rough.inputs["Metallic"])
        return rough

    obj.data.materials.append(material(build))
    scene = read().scene
    assert np.allclose(scene.albedo.mean(axis=0) + scene.specular.mirror.mean(axis=0), 0.5, atol=1e-3)
    assert np.allclose(scene.specular.mirror.mean(axis=0), 0.25, atol=0.01)
    assert np.allclose(scene.specular.roughness, 0.04)


def test_a_mixed_glass_keeps_the_index_of_its_glass():
    def build(tree):
        glass = node(tree, "ShaderNodeBsdfGlass", Color=(1, 1, 1, 1), IOR=1.7, Roughness=0.0)
        dull = node(tree, "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1))
        return node(tree, "ShaderNodeMixShader", Fac=0.25, Shader=glass.outputs[0], Shader_001=dull.outputs[0])

    obj = cube()
    obj.data.materials.append(material(build))
    scene = read().scene
    assert np.allclose(scene.specular.ior, 1.7) and np.allclose(scene.specular.clear, 0.75)
    assert np.allclose(scene.albedo, 0.125)


def test_a_baked_glass_ball_throws_its_bright_spot_and_a_black_one_a_shadow():
    floor = quad("floor", size=0.2, location=(-0.1, -0.1, -1.5))
    lamp("SUN", location=(0, 0, 5), energy=1.0)
    bpy.context.scene.world = None
    light = {}
    for name, kind, colour in (("glass", "BsdfGlass", (1, 1, 1, 1)), ("black", "BsdfDiffuse", (0, 0, 0, 1))):
        ball = sphere()
        ball.data.materials.append(material(lambda tree, k=kind, c=colour: node(tree, f"ShaderNode{k}", Color=c)))
        found = read([floor])
        steps = bake(
            found.scene, Points(found.centres + found.inward, found.normals), BakeSettings(photons=60_000, radius=0.05)
        )
        light[name] = finished(steps).irradiance.mean()
        bpy.data.objects.remove(ball)
    # At the focus of a ball of index 1.5 the sun's light is gathered from a disc many times as large.
    assert light["black"] == 0.0 and light["glass"] > 10.0


@pytest.mark.parametrize("height, says", [
    (0.0, "how 1 material (material) of glass on open faces bend light"),
    (0.01, "how panes of 1 material (material) bend and spread light"),
    (1.0, None),
])  # fmt: skip
def test_glass_that_does_not_bend_light_is_named(height, says):
    """A lamp behind a single face of it lit a floor 0.6 to 1.5 times as much as in Cycles, without a word."""
    if height == 0.0:
        obj = quad()
    else:
        obj = cube()
        for vertex in obj.data.vertices:
            vertex.co.z *= height
    _, result = worn(obj, "BsdfGlass", Color=(1, 1, 1, 1), IOR=1.5)
    said = [sentence for sentence in result.left_out if "bend" in sentence]
    assert len(said) == (says is not None) and all(sentence.startswith(says) for sentence in said)


def test_glass_of_index_one_is_not_named():
    _, result = worn(quad(), "BsdfGlass", Color=(1, 1, 1, 1), IOR=1.0)
    assert not any("bend" in sentence for sentence in result.left_out)
