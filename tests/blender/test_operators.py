import math
import types

import bpy
import numpy as np
import pytest
from detp import detp_addon
from detp.core.errors import InvalidSettingError, NoLightError
from detp.core.settings import QUALITIES, BakeSettings
from detp.detp_addon.panel import operators, session
from detp.detp_addon.panel.properties import BakeOptions, bake_request, scene_options
from detp.detp_addon.request import BakeRequest
from detp.detp_addon.steps import JobProgress
from detp.detp_addon.writing.baked_layers import error_there
from detp.detp_addon.writing.encoding import fit_stored
from small_scenes import colours

pytestmark = pytest.mark.usefixtures("addon")


@pytest.fixture
def scene():
    """A lit floor of 2 m, selected, under a small box that is not."""
    bpy.ops.mesh.primitive_cube_add(size=0.5, location=(0, 0, 1.5))
    bpy.context.object.name = "Box"
    bpy.context.object.select_set(False)
    bpy.ops.mesh.primitive_plane_add(size=2)
    bpy.context.object.name = "Floor"
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy = 100
    holder = bpy.data.objects.new("Lamp", lamp)
    holder.location = (1, 1, 2)
    bpy.context.scene.collection.objects.link(holder)
    return bpy.context.scene


def everything() -> dict:
    """All that a bake could leave behind."""
    attributes = {mesh.name: sorted(mesh.attributes.keys()) for mesh in bpy.data.meshes}
    kinds = ("scenes", "objects", "meshes", "cameras", "images", "materials", "lights", "worlds", "node_groups")
    return {"attributes": attributes, **{kind: sorted(getattr(bpy.data, kind).keys()) for kind in kinds}}


def steps(count: int, end=None, closed=None):
    """A stand-in for bake_scene: some steps, then an exception or a report."""
    try:
        for number in range(count):
            yield JobProgress("Reading" if number == 0 else "Working", number / count)
        if isinstance(end, BaseException):
            raise end
        return end
    finally:
        if closed is not None:
            closed.append(True)


REPORT = types.SimpleNamespace(headline=lambda: "Baked.", warnings=())


class TestSession:
    def test_a_step_keeps_to_its_time(self):
        bake = session.begin(steps(1000, REPORT))
        bake.step(0.0)
        assert bake.outcome is None and bake.progress.fraction == 0.0
        bake.step(0.0)
        assert bake.progress.fraction == pytest.approx(0.001)
        assert session.running() is bake

    def test_a_new_phase_is_shown_before_it_takes_long(self, monkeypatch):
        monkeypatch.setattr(session, "HURRY", 0.0)
        bake = session.begin(steps(1000, REPORT))
        bake.step(math.inf)
        assert bake.progress.phase == "Reading"
        bake.step(math.inf)
        assert bake.progress.phase == "Working" and bake.outcome is None
        bake.step(math.inf)
        assert bake.outcome is not None

    def test_on_the_way_to_the_first_light_no_phase_is_shown_but_the_light_is(self):
        def soon_lit():
            yield JobProgress("Reading", 0.0)
            yield JobProgress("Placing", 0.0)
            yield JobProgress("Casting", 0.0, shown=True)
            yield JobProgress("Tracing", 0.0)
            return REPORT

        bake = session.begin(soon_lit())
        bake.step(math.inf)
        assert bake.progress.phase == "Reading"
        bake.step(math.inf)
        assert bake.progress.phase == "Casting"
        bake.run()
        assert bake.outcome.status == session.DONE

    def test_before_the_bake_knows_the_forecast_says_how_far_it_is(self, monkeypatch):
        now = [100.0]
        monkeypatch.setattr(session.time, "perf_counter", lambda: now[0])
        bake = session.begin(steps(4, REPORT), expected=10.0)
        bake.step(0.0)
        assert (bake.fraction, bake.remaining) == (0.0, 10.0)
        now[0] += 1.0
        assert (bake.fraction, bake.remaining) == (pytest.approx(0.1), 9.0)
        now[0] += 8.0
        assert (bake.fraction, bake.remaining) == (session.MOST_GUESSED, 1.0)
        now[0] += 2.0
        assert bake.remaining is None
        bake.step(0.0)
        bake.step(0.0)
        assert bake.progress.fraction == 0.5 and bake.fraction == 0.5 + session.MOST_GUESSED
        assert session.begin(steps(4, REPORT)).remaining is None

    def test_a_bake_of_a_given_time_is_as_far_as_the_time(self, monkeypatch):
        now = [100.0]
        monkeypatch.setattr(session.time, "perf_counter", lambda: now[0])
        bake = session.begin(steps(4, REPORT), expected=10.0, timed=True)
        now[0] += 7.0
        assert bake.fraction == pytest.approx(0.7)
        now[0] += 7.0
        assert bake.fraction == 0.99

    def test_runs_to_the_end(self):
        bake = session.begin(steps(10, REPORT))
        bake.run()
        assert bake.outcome == session.Ending(session.DONE, "Baked.", REPORT)
        assert session.running() is None and session.latest() is bake

    def test_cancel_closes_the_job_and_further_steps_do_nothing(self):
        closed = []
        bake = session.begin(steps(10, REPORT, closed))
        bake.step(0.0)
        bake.cancel()
        assert closed and bake.outcome.status == session.CANCELLED
        bake.run()
        bake.cancel("again")
        assert bake.outcome.status == session.CANCELLED and bake.outcome.message != "again"

    def test_the_users_error_is_the_outcome(self):
        bake = session.begin(steps(1, NoLightError("No light.")))
        bake.run()
        assert bake.outcome == session.Ending(session.FAILED, "No light.")

    def test_a_removed_scene_cancels(self):
        bake = session.begin(steps(1, ReferenceError("StructRNA of type Scene has been removed")))
        bake.run()
        assert bake.outcome.status == session.CANCELLED

    def test_an_error_of_the_program_is_raised_and_leaves_no_running_bake(self):
        closed = []
        bake = session.begin(steps(1, ZeroDivisionError("oops"), closed))
        with pytest.raises(ZeroDivisionError):
            bake.run()
        assert closed and bake.outcome.status == session.FAILED and session.running() is None


class TestHandlers:
    def test_another_file_cancels_and_forgets(self):
        bake = session.begin(steps(10, REPORT))
        bake.step(0.0)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        assert bake.outcome.status == session.CANCELLED and "file" in bake.outcome.message
        assert session.latest() is None

    def test_undo_cancels(self):
        closed = []
        bpy.ops.ed.undo_push(message="one")
        bpy.ops.mesh.primitive_cube_add()
        bpy.ops.ed.undo_push(message="two")
        bake = session.begin(steps(10, REPORT, closed))
        bake.step(0.0)
        bpy.ops.ed.undo()
        assert closed and "undo" in bake.outcome.message

    def test_unregister_cancels(self):
        bake = session.begin(steps(10, REPORT))
        bake.step(0.0)
        detp_addon.unregister()
        detp_addon.register()
        assert bake.outcome.status == session.CANCELLED and session.latest() is None


class TestSettings:
    def test_the_defaults_are_the_cores(self):
        request = bake_request(scene_options(bpy.context.scene.detp))
        assert request == BakeRequest(settings=BakeSettings())

    def test_every_setting_arrives(self):
        settings = bpy.context.scene.detp
        settings.quality, settings.targets, settings.gatherer = "FINAL", "SELECTED", "SPHERE_CACHE"
        settings.auto_radius, settings.radius = False, 0.5
        settings.auto_photons, settings.photons = False, 1234
        settings.bounces, settings.seed = 3, 9
        settings.attribute, settings.domain, settings.quantity, settings.activate = "Light", "POINT", "SHADED", False
        assert bake_request(scene_options(settings)) == BakeRequest(
            settings=BakeSettings("final", 1234, 0.5, 3, 9, "sphere-cache"),
            targets="selected",
            attribute="Light",
            domain="POINT",
            quantity="shaded",
            activate=False,
        )

    def test_every_choice_is_one_the_job_takes(self):
        options = scene_options(bpy.context.scene.detp)
        rna = bpy.ops.detp.bake.get_rna_type().properties
        for name in BakeOptions.__annotations__:
            for item in rna[name].enum_items if rna[name].type == "ENUM" else ():
                bake_request({**options, name: item.identifier})

    def test_a_bad_setting_has_a_sentence(self):
        with pytest.raises(InvalidSettingError, match="name"):
            bake_request({**scene_options(bpy.context.scene.detp), "attribute": " "})


class TestBake:
    def test_a_script_bakes_with_the_scenes_settings(self, scene):
        scene.detp.quality, scene.detp.attribute, scene.detp.fit = "DRAFT", "Light", "VERTICES"
        assert bpy.ops.detp.bake() == {"FINISHED"}
        # The fourth corner lies in the box's shadow.
        assert np.count_nonzero(colours("Floor", "Light")[:, 0] > 0.1) == 3
        assert colours("Box", "Light").shape == (24, 4)
        report = session.latest().outcome.report
        assert report.objects == 2 and report.relative_error <= QUALITIES["draft"]

    def test_light_that_is_worse_than_what_it_would_replace_is_known(self, scene):
        bpy.ops.detp.bake()
        meshes = [bpy.data.objects[name].data for name in ("Floor", "Box")]
        error = session.latest().outcome.report.relative_error
        assert error_there(meshes, "irradiance") == pytest.approx(error)
        assert error_there(meshes, "other") is None
        fit_stored(bpy.data.objects, "irradiance")
        assert error_there(meshes, "irradiance") == pytest.approx(error)

        def so_far(error):
            yield JobProgress("Refining", 0.5, error=error)

        for standing, found, worse in ((error, 2 * error, True), (error, error / 2, False), (None, 1.0, False)):
            bake = session.begin(so_far(found), standing=standing)
            assert not bake.worse
            bake.step(0.0)
            assert bake.worse == worse
            bake.cancel()

    def test_arguments_override_the_settings_once(self, scene):
        assert bpy.ops.detp.bake(targets="SELECTED", photons=2000, radius=0.2, domain="POINT") == {"FINISHED"}
        assert colours("Floor").shape == (4, 4)
        assert not bpy.data.objects["Box"].data.attributes.get("irradiance")
        report = session.latest().outcome.report
        assert report.photons == 2000 and report.radius == pytest.approx(0.2)
        assert scene.detp.targets == "VISIBLE" and scene.detp.auto_radius

    def test_the_temporary_things_are_gone(self, scene):
        before = everything()
        bpy.ops.detp.bake(photons=2000)
        after = everything()
        for mesh in ("Plane", "Cube"):
            assert after["attributes"][mesh] == sorted([*before["attributes"][mesh], "irradiance"])
        del before["attributes"], after["attributes"]
        assert after == before

    @pytest.mark.parametrize("worked", [0, 1, 2, 3])
    def test_a_cancelled_bake_leaves_everything_as_it_was(self, scene, worked):
        before = everything()
        request = bake_request({**scene_options(scene.detp), "photons": 1 << 17})
        bake = session.begin(operators.bake_scene(scene, bpy.context.view_layer, request))
        for _ in range(worked):
            bake.step(0.0)
        assert bake.outcome is None
        assert bpy.ops.detp.cancel() == {"FINISHED"}
        assert bake.outcome.status == session.CANCELLED
        assert everything() == before

    def test_undo_takes_a_bake_back(self, scene):
        bpy.ops.ed.undo_push(message="before")
        bpy.ops.detp.bake(photons=2000)
        bpy.ops.ed.undo_push(message="bake")
        assert "irradiance" in bpy.data.objects["Floor"].data.attributes
        bpy.ops.ed.undo()
        assert "irradiance" not in bpy.data.objects["Floor"].data.attributes

    def test_an_error_of_the_program_is_seen_and_the_next_bake_works(self, scene, monkeypatch):
        with monkeypatch.context() as broken:
            broken.setattr(operators, "bake_scene", lambda *_, **__: steps(2, ZeroDivisionError("oops")))
            with pytest.raises(RuntimeError, match="ZeroDivisionError"):
                bpy.ops.detp.bake()
        assert session.running() is None
        assert bpy.ops.detp.bake(photons=2000) == {"FINISHED"}


class TestUse:
    def test_light_goes_into_materials_and_out_and_undo_takes_it_back(self, scene):
        material = bpy.data.materials.new("paint")
        if bpy.app.version < (5, 0):
            material.use_nodes = True
        bpy.data.objects["Floor"].data.materials.append(material)
        count = len(material.node_tree.nodes)
        bpy.ops.detp.bake(photons=2000)
        bpy.ops.ed.undo_push(message="before")
        assert bpy.ops.detp.use_in_material() == {"FINISHED"}
        bpy.ops.ed.undo_push(message="use")
        assert len(material.node_tree.nodes) > count
        bpy.ops.ed.undo()
        assert len(bpy.data.materials["paint"].node_tree.nodes) == count
        bpy.ops.ed.redo()
        assert bpy.ops.detp.remove_from_material() == {"FINISHED"}
        assert len(bpy.data.materials["paint"].node_tree.nodes) == count

    def test_the_exposure_is_fitted_and_stays_fitted(self, scene):
        bpy.data.lights["Lamp"].energy = 10_000
        bpy.ops.detp.bake(photons=2000)
        assert session.latest().outcome.report.brightness.above > 0
        assert bpy.ops.detp.fit_exposure() == {"FINISHED"}
        assert session.latest().outcome.report.brightness.above == 0
        assert colours("Floor")[:, :3].max() <= 1
        bpy.ops.detp.bake(photons=2000)
        assert session.latest().outcome.report.brightness.above == 0

    def test_what_is_not_baked_has_a_sentence(self, scene):
        for operator in (bpy.ops.detp.use_in_material, bpy.ops.detp.fit_exposure):
            with pytest.raises(RuntimeError, match="bake"):
                operator()


class TestSentences:
    def test_nothing_selected(self, scene):
        bpy.data.objects["Floor"].select_set(False)
        with pytest.raises(RuntimeError, match="No mesh object is selected"):
            bpy.ops.detp.bake(targets="SELECTED", photons=2000)

    def test_edit_mode(self, scene):
        bpy.context.view_layer.objects.active = bpy.data.objects["Floor"]
        bpy.ops.object.mode_set(mode="EDIT")
        with pytest.raises(RuntimeError, match="Edit Mode"):
            bpy.ops.detp.bake(targets="SELECTED", photons=2000)
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_no_mesh(self):
        with pytest.raises(RuntimeError, match="Error: "):
            bpy.ops.detp.bake(photons=2000)
        assert session.latest().outcome.status == session.FAILED

    def test_no_light(self, scene):
        bpy.data.objects.remove(bpy.data.objects["Lamp"])
        with pytest.raises(RuntimeError, match="light"):
            bpy.ops.detp.bake(photons=2000)

    def test_an_empty_attribute_name(self, scene):
        with pytest.raises(RuntimeError, match="needs a name"):
            bpy.ops.detp.bake(attribute="")

    def test_a_second_bake_at_a_time(self, scene):
        session.begin(steps(10, REPORT)).step(0.0)
        with pytest.raises(RuntimeError, match="A bake is running"):
            bpy.ops.detp.bake()
