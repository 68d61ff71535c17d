"""A bake shows its light before its end, takes it back when cancelled, keeps it when stopped; goals and forecasts."""

import time
import types

import bpy
import numpy as np
import pytest
from detp import detp_addon
from detp.core.forecast import forecast
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.detp_addon.job import bake_scene
from detp.detp_addon.likely import likely_bake, likely_values
from detp.detp_addon.panel import session
from detp.detp_addon.panel.forecasts import forecast_of
from detp.detp_addon.panel.operators import DETP_OT_bake
from detp.detp_addon.panel.properties import bake_request, scene_options
from detp.detp_addon.request import BakeRequest
from detp.detp_addon.writing.live_colours import LiveColours
from made_scenes import world
from small_scenes import box_on_floor, colours, lamp

SETTINGS = BakeSettings(error=0.1, radius=0.3)


@pytest.fixture(autouse=True)
def _scene():
    box_on_floor()
    bpy.context.view_layer.update()  # so that it knows all that was put there


class Eager(LiveColours):
    """Shows every picture, however long the last one took."""

    due = True


def steps(settings=SETTINGS, live=True, **request):
    request = BakeRequest(settings=settings, **request)
    shown = Eager(request.domain, request.attribute if request.activate else None) if live else None
    return bake_scene(bpy.context.scene, bpy.context.view_layer, request, shown)


def until_shown(generator, name="Floor", attribute="irradiance"):
    """Take steps until the mesh shows light, and return it."""
    for _ in range(10_000):
        next(generator)
        layer = bpy.data.objects[name].data.attributes.get(attribute)
        if layer is not None:
            found = colours(name, attribute)
            if found[:, :3].any():
                return found
    raise AssertionError("nothing was shown")


def state():
    """The layers of all meshes with their bytes, and which of them are shown."""
    found = {}
    for mesh in bpy.data.meshes:
        attributes = mesh.attributes
        found[mesh.name] = attributes.active_color_name, attributes.default_color_name
        for layer in attributes:
            if layer.data_type in ("FLOAT_COLOR", "BYTE_COLOR"):
                values = np.empty(4 * len(layer.data), np.float32)
                layer.data.foreach_get("color", values)
                found[mesh.name, layer.name] = layer.domain, values.tobytes()
    return found


def test_light_is_shown_early_and_grows_better():
    generator = steps()
    first = until_shown(generator)
    finished(generator)
    last = colours("Floor")
    assert first[:, :3].max() == pytest.approx(last[:, :3].max(), rel=0.2)
    assert not np.array_equal(first, last)
    attributes = bpy.data.objects["Floor"].data.attributes
    assert attributes.active_color_name == attributes.default_color_name == "irradiance"


@pytest.mark.parametrize("activate", [True, False])
def test_cancelling_takes_back_what_was_shown(activate):
    # One mesh has colours of its own under the same name, and others that are shown.
    mesh = bpy.data.objects["Box"].data
    for name in ("irradiance", "mine"):
        layer = mesh.attributes.new(name, "FLOAT_COLOR", "CORNER")
        layer.data.foreach_set("color", np.random.default_rng(1).random(4 * len(layer.data)).astype(np.float32))
    mesh.attributes.active_color_name = mesh.attributes.default_color_name = "mine"
    before = state()
    generator = steps(activate=activate, look=True)
    until_shown(generator)
    assert state() != before
    assert activate == ("irradiance_look" in bpy.data.objects["Floor"].data.attributes)
    generator.close()
    assert state() == before


def test_edit_mode_in_between_does_not_keep_what_was_shown():
    before = state()
    generator = steps()
    until_shown(generator)
    bpy.context.view_layer.objects.active = bpy.data.objects["Floor"]
    bpy.ops.object.mode_set(mode="EDIT")
    generator.close()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert state() == before


def test_what_was_deleted_in_between_is_no_trouble():
    generator = steps()
    until_shown(generator)
    bpy.data.objects.remove(bpy.data.objects["Floor"])
    report = finished(generator)
    assert report.objects == 1 and "Floor" in " ".join(report.warnings)


def test_a_shared_mesh_is_shown_only_in_the_end():
    twin = bpy.data.objects.new("Twin", bpy.data.objects["Box"].data)
    bpy.context.collection.objects.link(twin)
    generator = steps()
    until_shown(generator)
    assert "irradiance" not in bpy.data.objects["Box"].data.attributes
    finished(generator)
    assert "irradiance" in bpy.data.objects["Box"].data.attributes and twin.data is not bpy.data.objects["Box"].data


@pytest.mark.parametrize("live", [True, False])
def test_a_stopped_bake_keeps_its_light(live):
    generator = steps(BakeSettings(error=1e-4), live)
    next(generator)
    with pytest.raises(StopIteration) as end:
        while True:
            generator.send(True)
    report = end.value.value
    assert any("stopped" in warning for warning in report.warnings)
    assert colours("Floor")[:, :3].max() > 0.1


def test_an_error_is_reached_and_not_by_far():
    report = finished(steps(BakeSettings(error=0.01), live=False, fit="vertices"))
    # A part of the error is left to the blur of the discs; points that were lit later count in what is reported alone;
    # and steps double the photons.
    assert 0.003 < report.relative_error <= 0.01
    assert not report.warnings


def test_a_time_is_kept():
    finished(steps(BakeSettings(photons=1000), live=False))  # what is loaded only once
    start = time.perf_counter()
    report = finished(steps(BakeSettings(seconds=1.5), live=False, fit="vertices"))
    # A step begins only when there is time for it; on a busy machine one may take twice as long as those before.
    assert 0.75 < time.perf_counter() - start < 3.0
    assert report.photons > 1 << 13  # more than the first ones


def test_an_error_out_of_reach_is_said():
    for limit, remedy in (({"seconds": 1.0}, "allow more time"), ({"photons": 1000}, "allow more photons")):
        report = finished(steps(BakeSettings(error=0.001, **limit), live=False))
        assert any("not reached" in warning and remedy in warning for warning in report.warnings)


def test_forecasts_follow_what_is_asked_for():
    times = [forecast(10_000, BakeSettings(error=error)).seconds for error in (0.1, 0.05, 0.02)]
    assert times == sorted(times) and times[0] > 0
    assert forecast(10_000, BakeSettings(error=0.05)).error == 0.05
    more = [forecast(10_000, BakeSettings(seconds=seconds)) for seconds in (1.0, 10.0, 100.0)]
    assert [found.seconds for found in more] == [1.0, 10.0, 100.0]
    assert more[0].error > more[1].error > more[2].error
    assert forecast(20_000, BakeSettings()).seconds > forecast(10_000, BakeSettings()).seconds


def test_what_a_bake_will_show_is_counted_before():
    scene, layer, box = bpy.context.scene, bpy.context.view_layer, bpy.data.objects["Box"]
    for smooth, request in ((False, {}), (True, {"targets": ("Box",)}), (False, {"domain": "POINT"})):
        box.data.polygons.foreach_set("use_smooth", np.full(6, smooth))
        report = finished(steps(live=False, **request))
        assert likely_values(scene, layer, BakeRequest(SETTINGS, **request)) == report.points


def test_more_values_lamps_and_a_sky_make_a_bake_dearer():
    scene, layer, request = bpy.context.scene, bpy.context.view_layer, BakeRequest(SETTINGS)
    sky = world((0.5, 0.5, 0.5)).node_tree
    seconds = [likely_bake(scene, layer, request, values).seconds for values in (10_000, 20_000)]
    lamp((1, 1, 3))
    layer.update()
    seconds.append(likely_bake(scene, layer, request, 20_000).seconds)
    sky.nodes.new("ShaderNodeTexSky")
    seconds.append(likely_bake(scene, layer, request, 20_000).seconds)
    assert seconds == sorted(set(seconds))


@pytest.fixture
def addon():
    detp_addon.register()
    yield bpy.context.scene.detp
    detp_addon.unregister()


def panel_forecast(request=None):
    request = request or bake_request(scene_options(bpy.context.scene.detp))
    return forecast_of(bpy.context.scene, bpy.context.view_layer, request)


def test_the_panels_forecast_learns_from_a_bake(addon):
    addon.quality = "DRAFT"
    before = panel_forecast()
    assert bpy.ops.detp.bake() == {"FINISHED"}
    seconds = session.latest().outcome.report.seconds["total"]
    assert panel_forecast().seconds == pytest.approx(seconds)
    assert before.error == panel_forecast().error
    addon.targets = "SELECTED"
    bpy.ops.object.select_all(action="DESELECT")
    assert panel_forecast() is None


def test_forecasts_learn_from_the_settings_that_the_bake_had_and_from_no_other_file(addon):
    addon.quality = "FINAL"
    draft = bake_request({**scene_options(addon), "quality": "DRAFT"})
    untaught = panel_forecast().seconds, panel_forecast(draft).seconds
    # An empty field means the usual name.
    addon.attribute = ""
    assert bpy.ops.detp.bake(quality="DRAFT") == {"FINISHED"}
    taught = panel_forecast().seconds, panel_forecast(draft).seconds
    assert taught[1] == pytest.approx(session.latest().outcome.report.seconds["total"])
    assert taught[0] / taught[1] == pytest.approx(untaught[0] / untaught[1])
    box_on_floor()
    bpy.context.view_layer.update()
    bpy.context.scene.detp.quality = "FINAL"
    assert panel_forecast().seconds == pytest.approx(untaught[0])


def test_forecasts_do_not_learn_from_a_stopped_bake(addon):
    before = panel_forecast()
    operator = types.SimpleNamespace(_live=False, _kept=None, report=lambda *_: None)
    operator._request = bake_request(scene_options(addon))
    bake = session.begin(steps(BakeSettings(error=1e-4), live=False))
    bake.step(0.0)
    bake.stop()
    bake.run()
    assert DETP_OT_bake._ended(operator, bpy.context, bake) == {"FINISHED"}
    assert panel_forecast() == before
