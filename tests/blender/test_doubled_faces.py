"""Shining faces that lie where others do give their light once: of both a ray meets but one."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.bake import baked  # noqa: E402
from detp.core.points import Points  # noqa: E402
from detp.core.settings import BakeSettings  # noqa: E402
from detp.core.stages import finished  # noqa: E402
from detp.detp_addon.job import bake_scene  # noqa: E402
from detp.detp_addon.request import BakeRequest  # noqa: E402
from detp.detp_addon.tradeoff.cycles_bake import light_of  # noqa: E402
from made_scenes import diffuse, fresh, linked, material, mesh, node, read, world  # noqa: E402

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
FRONT, BACK = (0, 1, 2, 3), (3, 2, 1, 0)


pytestmark = pytest.mark.usefixtures("scene")


def glow(build=None):
    return material(build or (lambda tree: node(tree, "ShaderNodeEmission", Strength=2.0)))


def panel(name, faces, vertices=SQUARE, location=(0, 0, 0), shines=None):
    obj = linked(name, mesh(vertices, faces, name), location)
    obj.data.materials.append(shines or glow())


def shone():
    """Radiance times area of all triangles, and what is said of doubled ones."""
    exported = read()
    corners = exported.scene.corners
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    emission = exported.scene.emission
    front = emission if emission.ndim == 2 else emission.mean(axis=0)
    return areas @ front[:, 0], [warning for warning in exported.warnings if "counted once" in warning]


@pytest.mark.parametrize("faces", [[FRONT], [FRONT, BACK], [FRONT, FRONT, FRONT], [FRONT, (0, 1, 2)]])
def test_faces_on_faces_shine_once(faces):
    panel("panel", faces)
    power, words = shone()
    assert power == pytest.approx(2.0)
    assert len(words) == (len(faces) > 1)


@pytest.mark.parametrize("above", [FRONT, BACK])
def test_a_floor_close_below_a_double_has_its_light_once(above):
    """Most of its light is found by rays by chance, which meet one face or the other."""
    light = []
    for faces in ([FRONT], [FRONT, above]):
        fresh()
        panel("panel", faces, location=(0, 0, 0.1))
        floor = linked("floor", mesh(SQUARE, [FRONT], "floor"), (0, 0, 0))
        request = BakeRequest(BakeSettings(error=0.01), ("floor",), fit="vertices")
        finished(bake_scene(bpy.context.scene, bpy.context.view_layer, request))
        light.append(light_of(floor, "irradiance").sum(axis=1))
    assert np.allclose(light[1], light[0], rtol=0.06)


def test_an_object_on_its_double_shines_once_far_from_the_origin():
    for name in ("first", "second"):
        panel(name, [FRONT], location=(70.1, -20.3, 1.7))
    assert shone()[0] == pytest.approx(2.0)


@pytest.mark.parametrize("double", [False, True])
def test_small_things_shine_on_however_far_a_stray_face_is(double):
    at = np.linspace(0.0, 0.1, 11)
    corners = [(x, y, 0.0) for y in at for x in at]
    faces = [(i, i + 1, i + 12, i + 11) for i in range(109) if i % 11 < 10]
    panel("lamps", faces, corners)
    if double:
        panel("doubles", faces, corners)
    panel("stray", [(0, 1, 2)], [(3e6, 0, 0), (3e6 + 1, 0, 0), (3e6, 1, 0)], shines=diffuse((0.5, 0.5, 0.5)))
    power, words = shone()
    assert power == pytest.approx(2.0 * 0.01, rel=1e-3)
    assert len(words) == double


def test_neighbours_corners_and_panels_close_by_shine_on():
    """A strip, something folded at its edge, and a panel a millimetre above."""
    vertices = [*SQUARE, (2, 0, 0), (2, 1, 0), (0, 0, 1), (1, 0, 1)]
    panel("strip", [FRONT, (1, 4, 5, 2), (0, 1, 7, 6)], vertices)
    panel("above", [FRONT], location=(0, 0, 0.001))
    assert shone() == (pytest.approx(8.0), [])


@pytest.mark.parametrize(
    "above, faces, named", [(0.0, FRONT, 2), (-0.001, FRONT, 0), (0.001, FRONT, 0), (0.0, BACK, 0)]
)
def test_a_panel_in_a_ceiling_is_named(above, faces, named):
    """And none before it, behind it, or which is the bottom of something that stands on it."""
    wide = [(7 * x - 3, 7 * y - 2, z) for x, y, z in SQUARE]
    panel("ceiling", [BACK], wide, (0, 0, 3.1), material(lambda tree: node(tree, "ShaderNodeBsdfDiffuse")))
    panel("panel", [faces[::-1]], location=(0, 0, 3.1 + above))
    words = [warning for warning in read().warnings if "lie in other faces" in warning]
    assert [int(warning.split()[0]) for warning in words] == [named] * (named > 0)


def test_panes_that_let_light_through_shine_both():
    def pane(tree):
        shining, clear = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeBsdfTransparent")
        return node(tree, "ShaderNodeAddShader", Shader=shining.outputs[0], Shader_001=clear.outputs[0])

    panel("panes", [FRONT, FRONT], shines=glow(pane))
    assert shone() == (pytest.approx(2.0), [])


@pytest.mark.parametrize("faces, named", [([FRONT], 0), ([FRONT, BACK], 2), ([FRONT, (0, 1, 2)], 1)])
def test_faces_that_reflect_and_lie_on_others_are_named(faces, named):
    """Of doubled squares at the origin Cycles reflects a quarter of what one does."""
    panel("panel", faces, shines=diffuse((0.8, 0.8, 0.8)))
    words = [warning for warning in read().warnings if "on top of others" in warning]
    assert [int(warning.split()[0]) for warning in words] == [named] * (named > 0)


@pytest.mark.parametrize("face, named", [(FRONT, 2), (BACK, 0)])
def test_objects_that_lie_on_others_are_named_and_those_that_touch_are_not(face, named):
    for name, own in (("one", FRONT), ("other", face)):
        panel(name, [own], shines=diffuse((0.8, 0.8, 0.8)))
    words = [warning for warning in read().warnings if "on top of others" in warning]
    assert [int(warning.split()[0]) for warning in words] == [named] * (named > 0)


def from_above():
    """E / pi from below at 0.2 m above the square's middle, and its share of what is seen from there."""
    above = Points(np.array([(0.5, 0.5, 0.2)]), np.array([(0.0, 0.0, -1.0)]))
    light = baked(read().scene, above, BakeSettings(error=0.005)).irradiance / np.pi
    # The view factor (Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-3).
    across = 0.5 / np.hypot(0.5, 0.2)
    return light, 4.0 / np.pi * across * np.arctan(across)


@pytest.mark.parametrize("faces", [[FRONT], [FRONT, BACK], [FRONT, FRONT]])
def test_doubled_faces_reflect_as_one(faces):
    world((1, 1, 1))
    panel("panel", faces, shines=diffuse((0.8, 0.8, 0.8)))
    light, seen = from_above()
    assert np.allclose(light, 0.8 * seen + 1.0 - seen, rtol=0.01)


@pytest.mark.parametrize("faces", [[FRONT], [FRONT, BACK], [FRONT, FRONT]])
def test_doubled_faces_that_shine_and_reflect_make_no_light_between_them(faces):
    """Of doubled squares in the dark Cycles shows up to five times what one gives, which made a tree's crown bright."""

    def both(tree):
        dull = node(tree, "ShaderNodeBsdfDiffuse", Color=(0.8, 0.8, 0.8, 1))
        shining = node(tree, "ShaderNodeEmission", Color=(1, 1, 1, 1), Strength=1.0)
        return node(tree, "ShaderNodeAddShader", Shader=dull.outputs[0], Shader_001=shining.outputs[0])

    world((0, 0, 0))
    panel("panel", faces, shines=material(both))
    light, seen = from_above()
    assert np.allclose(light, seen, rtol=0.01)
