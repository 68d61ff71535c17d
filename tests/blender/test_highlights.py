"""Highlights of Principled shaders: their share of light is Cycles', and a room's walls send it on."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from beside_cycles import beside_cycles  # noqa: E402
from detp.detp_addon.reading.highlights import reflected_above  # noqa: E402
from made_scenes import fresh, lamp, material, node, read, world  # noqa: E402


def above(ior=1.5, level=0.5, tint=(1.0, 1.0, 1.0), roughness=0.5):
    ior, level, roughness = (np.full((1, 1), value) for value in (ior, level, roughness))
    return reflected_above(ior, level, np.array([tint]), roughness)[0]


# What Cycles 4.5 reflects of a white sky where the base colour is black, a mean by the cosine over angles.
@pytest.mark.parametrize("ior, level, roughness, reflected", [
    (1.2, 0.5, 0.2, 0.0405), (1.45, 0.5, 0.05, 0.0843), (1.45, 0.5, 0.5, 0.0534), (1.45, 1.0, 0.35, 0.1032),
    (2.0, 0.25, 0.2, 0.1044), (2.0, 0.5, 0.05, 0.1605), (2.0, 1.0, 0.35, 0.2375),
])  # fmt: skip
def test_the_share_is_that_of_cycles(ior, level, roughness, reflected):
    assert above(ior, level, roughness=roughness) == pytest.approx(np.full(3, reflected), rel=0.02)


def test_smooth_ones_follow_fresnel_and_none_is_none():
    # The diffuse reflectance of a boundary of index 1.5 from outside (Duntley 1942, Orchard 1969).
    assert above(roughness=0.0) == pytest.approx(np.full(3, 0.0918), rel=0.01)
    assert not above(level=0.0).any() and not above(ior=1.0).any()
    red, green, blue = above(tint=(1.0, 0.5, 0.0))
    assert red == above()[0] and red > green > blue > 0.0


def wall(tree):
    return node(tree, "ShaderNodeBsdfPrincipled", Base_Color=(0.3, 0.1, 0.05, 1), Roughness=0.4).outputs[0]


def test_walls_of_a_room_send_their_highlights_on():
    fresh()
    world((0, 0, 0))
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    room = bpy.context.object
    room.modifiers.new("finer", "SUBSURF").subdivision_type = "SIMPLE"
    room.modifiers["finer"].levels = 2
    bpy.ops.object.modifier_apply(modifier="finer")
    room.data.flip_normals()
    room.data.materials.append(material(wall))
    lamp("POINT", location=(0.2, 0.1, 0.3), energy=10.0, shadow_soft_size=0.0)
    ours, theirs = (values.mean(axis=0) for values in beside_cycles(room, samples=128, photons=20_000)[:2])
    # Without highlights this is 0.96; with them a little above one, since a lamp in the middle shines steeply on walls.
    assert ours / theirs == pytest.approx(np.ones(3), abs=0.025)
    # The colours that are shown stay the surface's own, and without caustics of mirrors Cycles has no highlights.
    exported = read()
    assert np.allclose(exported.targets[0].albedo, (0.3, 0.1, 0.05), atol=1e-6)
    assert (exported.scene.albedo > (0.33, 0.14, 0.09)).all()
    bpy.context.scene.cycles.caustics_reflective = False
    assert np.allclose(read().scene.albedo, (0.3, 0.1, 0.05), atol=1e-6)
