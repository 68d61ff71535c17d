"""Exposure, limit and type of the stored light, and what reports say of it."""

from contextlib import ExitStack

import bpy
import numpy as np
import pytest
from detp.core.errors import AttributeNameTakenError, InvalidSettingError, NotBakedError
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.detp_addon.command.command import main
from detp.detp_addon.job import bake_scene
from detp.detp_addon.request import BakeRequest
from detp.detp_addon.writing.baked_layers import PLAIN_LIGHT, just_baked, light_of
from detp.detp_addon.writing.encoding import Encoding, encoded, fit_stored, fitted_scale
from detp.detp_addon.writing.write_attributes import MeshColours, write_colours, write_layers
from made_scenes import diffuse, fresh, quad, read, world
from small_scenes import colours, opened, saved


@pytest.fixture
def floors():
    """Two floors under a sky brighter than white."""
    fresh()
    world((4, 4, 4))
    return quad("near"), quad("far", location=(5, 0, 0))


def bake(targets="visible", **encoding):
    request = BakeRequest(BakeSettings(error=0.5, indirect="off"), targets, encoding=Encoding(**encoding))
    return finished(bake_scene(bpy.context.scene, bpy.context.view_layer, request))


def test_an_exposure_multiplies_by_powers_of_two(floors):
    bake()
    light = colours("near")[:, :3]
    report = bake(exposure=-3)
    np.testing.assert_allclose(colours("near")[:, :3], light / 8, rtol=1e-6)
    assert report.brightness.scale == 1 / 8 and report.brightness.above == 0
    light = light_of(floors[0].data, "irradiance")
    assert light == {"quantity": "lighting", "scale": 1 / 8, "error": report.relative_error}
    assert "-3.00 stops" in report.brightness.sentence()


def test_bright_colours_are_counted_kept_or_cut(floors):
    report = bake()
    assert (report.brightness.above, report.brightness.colours) == (8, 8)
    assert "8 colours (100.0 %) are above 1" in " ".join(report.details())
    assert colours("near")[:, :3].min() > 1
    assert bake(clamp=True).brightness.above == 8
    assert (colours("near") == 1).all()


def test_fitting_leaves_one_lit_colour_in_a_hundred_above_one():
    light = np.random.default_rng(1).exponential(3.0, (10_000, 3))
    light[:5000] = 0.0  # what is dark does not count
    entry = MeshColours(None, {"light": light})
    [stored], brightness = encoded([entry], Encoding(None), "lighting")
    assert 40 <= brightness.above <= 50
    assert brightness.scale == fitted_scale([light])
    np.testing.assert_allclose(stored.layers["light"], light * brightness.scale)
    assert fitted_scale([np.zeros((4, 3))]) == fitted_scale([]) == 1.0


def test_a_part_that_is_baked_again_takes_the_scale_of_the_rest(floors):
    bake(exposure=-5)
    assert bake(("near",), exposure=None).brightness.scale == 1 / 32
    assert bake(exposure=None).brightness.scale != 1 / 32


def test_bytes_hold_light_in_srgb_and_are_no_paint(floors):
    bake(exposure=-3)
    light = colours("near")[:, :3]
    for obj in floors:
        obj.data.attributes.remove(obj.data.attributes["irradiance"])
    bake(exposure=-3, storage="byte")
    layer = floors[0].data.attributes["irradiance"]
    assert layer.data_type == "BYTE_COLOR"
    np.testing.assert_allclose(colours("near")[:, :3], light, atol=0.005)
    encoding = np.array([corner.color_srgb[0] for corner in layer.data])
    np.testing.assert_allclose(encoding, 1.055 * light[:, 0] ** (1 / 2.4) - 0.055, atol=0.5 / 255 + 1e-3)
    before = colours("near")
    assert bake(exposure=-3, storage="byte").warnings == ()
    np.testing.assert_array_equal(colours("near"), before)


def test_a_bake_of_another_type_is_replaced_and_paint_is_not(floors):
    bake()
    light = colours("near")
    assert bake(storage="byte").warnings == ()
    assert {obj.data.attributes["irradiance"].data_type for obj in floors} == {"BYTE_COLOR"}
    np.testing.assert_allclose(colours("near"), np.minimum(light, 1), atol=0.005)
    for obj in floors:
        obj.data.attributes["irradiance"].data[0].color = (0.5, 0.5, 0.5, 1)
    with pytest.raises(AttributeNameTakenError, match="BYTE_COLOR"):
        bake()


def test_what_replaced_a_bake_of_another_type_is_taken_back_exactly(floors):
    bake()
    light, mesh = colours("near"), bpy.data.objects["near"].data
    with ExitStack() as undo:
        entry = MeshColours(bpy.data.objects["near"], {"irradiance": light[:, :3]}, PLAIN_LIGHT, "BYTE_COLOR")
        write_layers(entry, "CORNER", "irradiance", undo)
        assert mesh.attributes["irradiance"].data_type == "BYTE_COLOR"
    assert mesh.attributes["irradiance"].data_type == "FLOAT_COLOR" and just_baked(mesh, "irradiance")
    np.testing.assert_array_equal(colours("near"), light)


def test_the_look_is_colour_times_light_fitted_and_no_paint():
    fresh()
    world((4, 4, 4))
    floor = quad("floor")
    floor.data.materials.append(diffuse((0.8, 0.4, 0.2)))
    request = BakeRequest(BakeSettings(error=0.5, indirect="off"), look=True)
    for _ in range(2):
        assert finished(bake_scene(bpy.context.scene, bpy.context.view_layer, request)).warnings == ()
        seen, light = colours("floor", "irradiance_look")[:, :3], colours("floor")[:, :3]
        np.testing.assert_allclose(seen / seen.max(), light / light.max() * (1, 0.5, 0.25), atol=0.01)
        assert seen.max() == 1 and light.min() > 1
        layers = floor.data.attributes
        assert (layers.active_color_name, layers.default_color_name) == ("irradiance_look", "irradiance")


def test_stored_light_can_be_fitted_later(floors):
    bake()
    light = colours("near")[:, :3]
    brightness = fit_stored(bpy.context.scene.objects, "irradiance")
    assert brightness.above == 0 and brightness.colours == 8
    np.testing.assert_allclose(colours("near")[:, :3], light * brightness.scale, rtol=1e-6)
    assert light_of(floors[0].data, "irradiance")["scale"] == brightness.scale
    assert fit_stored(bpy.context.scene.objects, "irradiance").scale == pytest.approx(brightness.scale)
    with pytest.raises(NotBakedError):
        fit_stored(bpy.context.scene.objects, "night")


def test_light_in_bytes_is_looked_through():
    fresh()
    floor = quad("floor")
    write_colours([MeshColours(floor, {"day": np.full((4, 3), 0.5)}, type="BYTE_COLOR")], "CORNER", "day")
    floor.data.attributes["day"].name = "noon"
    assert read().warnings == ()
    from detp.detp_addon.writing.baked_layers import colour_layers

    assert colour_layers(floor.data).baked == {"noon"}


def test_what_makes_no_sense_has_a_sentence():
    for options in ({"exposure": 100.0}, {"exposure": float("nan")}, {"storage": "double"}):
        with pytest.raises(InvalidSettingError):
            Encoding(**options)


def test_the_command_exposes_cuts_and_uses_the_light(floors, tmp_path, capsys):
    path, out, report = saved(tmp_path / "scene.blend"), tmp_path / "out.blend", tmp_path / "report.json"
    material = bpy.data.materials.new("floor")
    floors[0].data.materials.append(material)
    saved(path)
    options = ["--error", "50%", "--indirect", "off", "--exposure", "-1", "--clamp", "--storage", "byte"]
    assert (
        main(["bake", str(path), "-o", str(out), *options, "--use-in-material", "base-color", "--report", str(report)])
        == 0
    )
    printed = capsys.readouterr().out
    assert "Exposed by -1.00 stops" in printed and "in the base colour of 1 material" in printed
    opened(out)
    assert bpy.data.objects["near"].data.attributes["irradiance"].data_type == "BYTE_COLOR"
    assert '"above_one": 8' in report.read_text()
    assert main(["bake", str(path), "--exposure", "bright"]) == 2
