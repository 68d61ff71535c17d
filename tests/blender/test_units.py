"""Lengths are metres as the scene's units say: in what is asked for, in the bake and in what is reported."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.settings import BakeSettings  # noqa: E402
from detp.core.stages import finished  # noqa: E402
from detp.detp_addon.job import bake_scene  # noqa: E402
from detp.detp_addon.panel.labels import length  # noqa: E402
from detp.detp_addon.panel.properties import DETP_PG_settings, bake_request, scene_options  # noqa: E402
from detp.detp_addon.request import BakeRequest  # noqa: E402
from detp.detp_addon.units import metres_per_unit  # noqa: E402
from made_scenes import fresh, lamp, linked, material, mesh, node, quad, read, world  # noqa: E402
from small_scenes import colours  # noqa: E402

pytestmark = pytest.mark.usefixtures("dark_scene")


def units(scale, system="METRIC"):
    settings = bpy.context.scene.unit_settings
    settings.system, settings.scale_length = system, scale


def bake(settings, quantity="lighting"):
    request = BakeRequest(settings, quantity=quantity, fit="vertices")
    return finished(bake_scene(bpy.context.scene, bpy.context.view_layer, request))


def room(size):
    """A floor, a glowing square above it and each kind of lamp, ``size`` units large, as bright in each size."""
    quad("floor", size=4 * size, location=(-2 * size, -2 * size, 0))
    glow = linked("glow", mesh([(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)], [(0, 1, 2, 3)]), (0, 0, size), (size,) * 3)
    glow.data.materials.append(material(lambda tree: node(tree, "ShaderNodeEmission", Strength=2.0)))
    power, near = 30.0 * size**2, (size, 0, 2 * size)
    lamp("POINT", "hard", near, energy=power, shadow_soft_size=0.0)
    lamp("POINT", "soft", near, energy=power, shadow_soft_size=0.2 * size)
    lamp("SPOT", "spot", near, energy=power, shadow_soft_size=0.1 * size)
    lamp("AREA", "area", near, energy=power, size=0.5 * size)
    lamp("SUN", "sun", near, energy=0.5)
    if "normalize" in bpy.types.Light.bl_rna.properties:
        lamp("POINT", "ball", near, energy=3.0, shadow_soft_size=0.2 * size, normalize=False)
        lamp("POINT", "dot", near, energy=3.0 * size**2, shadow_soft_size=0.0, normalize=False)
        lamp("AREA", "pane", near, energy=3.0, size=0.5 * size, normalize=False)


@pytest.mark.parametrize("size, scale, system", [(100, 0.01, "METRIC"), (0.001, 1000, "IMPERIAL"), (1, 0.01, "NONE")])
def test_the_same_room_in_other_units_bakes_the_same(size, scale, system):
    baked = []
    for units_long, metres, kind in ((1, 1.0, "METRIC"), (size, scale, system)):
        fresh()
        world((0, 0, 0))
        units(metres, kind)
        room(units_long)
        report = bake(BakeSettings(photons=20000, radius=0.3))
        assert report.radius == pytest.approx(0.3) and "radius 0.3 m" in report.headline()
        baked.append(colours("floor")[:, :3])
    assert baked[0].max() > 0
    np.testing.assert_allclose(baked[1], baked[0], rtol=1e-3)


def test_light_does_not_depend_on_the_unit_scale():
    """Cycles takes lengths as they are: the same scene has the same light, whatever its units are called."""
    room(1)
    lights = [read().scene.lights]
    units(0.01)
    lights.append(read().scene.lights)
    assert len(lights[0]) == len(lights[1]) > 4
    for first, second in zip(*lights, strict=True):
        if hasattr(first, "power"):
            assert np.allclose(second.power, 1e-4 * first.power)
        else:
            assert np.allclose(second.irradiance, first.irradiance)


@pytest.mark.parametrize("scale, units_per_metre", [(0.01, 100), (1.0, 1), (1000.0, 0.001)])
def test_occlusion_within_a_metre_of_a_wall(scale, units_per_metre):
    """Rays of at most R meet a high wall at the distance cR where they lean by c or more: their cosines make up the
    segment of the unit circle beyond c, an area of acos c - c sqrt(1 - c^2) of pi."""
    units(scale)
    u = units_per_metre
    shares = (0.1, 0.6)
    rows = np.linspace(-0.5, 0.5, 401)
    vertices = [(x * u, y * u, 0) for x in shares for y in rows]
    strips = [(k, k + len(rows), k + len(rows) + 1, k + 1) for k in range(len(rows) - 1)]
    floor = linked("floor", mesh(vertices, strips))
    linked("wall", mesh([(0, -3 * u, 0), (0, -3 * u, 2 * u), (0, 3 * u, 2 * u), (0, 3 * u, 0)], [(0, 3, 2, 1)]))
    bake(BakeSettings(shadow_distance=1.0), "ambient-occlusion")
    at = np.array([floor.data.vertices[loop.vertex_index].co.x for loop in floor.data.loops]) / u
    open_share = colours("floor")[:, 0]
    for c in shares:
        found = open_share[np.isclose(at, c)]
        expected = 1 - (np.arccos(c) - c * np.sqrt(1 - c * c)) / np.pi
        # Corners of one vertex may share their rays.
        assert abs(found.mean() - expected) < 3 * found.std() / np.sqrt(len(found) / 2)


def test_the_panels_lengths_are_what_blender_shows(scene):
    bpy.utils.register_class(DETP_PG_settings)
    bpy.types.Scene.detp = bpy.props.PointerProperty(type=DETP_PG_settings)
    try:
        settings = scene.detp
        settings.auto_radius, settings.radius, settings.occlusion_distance = False, 30.0, 200.0
        for system, metres in (("METRIC", 0.01), ("NONE", 1.0)):
            units(0.01, system)
            assert metres_per_unit(scene) == pytest.approx(metres)
            request = bake_request(scene_options(settings), metres_per_unit(scene))
            assert request.settings.radius == pytest.approx(30.0 * metres)
            assert request.settings.shadow_distance == pytest.approx(200.0 * metres)
            shown = bpy.utils.units.to_value(system, "LENGTH", length(request.settings.radius, scene.unit_settings))
            assert shown == pytest.approx(30.0 * metres)
    finally:
        del bpy.types.Scene.detp
        bpy.utils.unregister_class(DETP_PG_settings)
