"""The bake job: nothing is touched before its end, and what changes under it costs only that object."""

from dataclasses import replace

import bpy
import numpy as np
import pytest
from detp.core.errors import (
    DetpError,
    InvalidSettingError,
    NothingSelectedError,
    ObjectNotFoundError,
    OutOfMemoryError,
    UnwritableFileError,
)
from detp.core.settings import BakeSettings
from detp.detp_addon import found_light
from detp.detp_addon.job import bake_scene
from detp.detp_addon.request import BakeRequest
from detp.detp_addon.writing import write_attributes
from fuzz.fingerprint import users
from small_scenes import box_on_floor, colours, cube, grid

SETTINGS = BakeSettings(photons=5000, radius=0.3)


@pytest.fixture(autouse=True)
def _scene():
    box_on_floor()


def steps(**request):
    return bake_scene(bpy.context.scene, bpy.context.view_layer, BakeRequest(**{"settings": SETTINGS, **request}))


def finished(generator):
    progress = []
    while True:
        try:
            progress.append(next(generator))
        except StopIteration as stop:
            return stop.value, progress


def contents():
    """Names and users of all of Blender's data, and the layers and raw colours of the meshes."""
    found = {}
    for name in dir(bpy.data):
        blocks = getattr(bpy.data, name)
        if type(blocks).__name__ == "bpy_prop_collection":
            found[name] = sorted((block.name_full, users(block)) for block in blocks)
    for mesh in bpy.data.meshes:
        shown = (mesh.attributes.active_color_name, mesh.attributes.default_color_name)
        found[mesh.name] = [(layer.name, layer.data_type, layer.domain) for layer in mesh.attributes], shown
    return found


def test_progress_goes_from_reading_to_writing():
    report, progress = finished(steps())
    assert [progress[0].phase, progress[-1].phase] == ["Reading the scene", "Writing the colours"]
    assert all(0 <= step.fraction <= 1 for step in progress)
    assert all(step.remaining is None or step.remaining >= 0 for step in progress)
    assert (report.scene, report.output, report.objects) == ("Scene", None, 2)
    stages = ("export", "shadow", "trace", "gather", "write")
    assert report.seconds["total"] >= sum(report.seconds[stage] for stage in stages)


def test_closing_it_at_any_step_leaves_everything_as_it_was():
    before = contents()
    count = len(finished(steps())[1])
    for name in ("Floor", "Box"):
        mesh = bpy.data.objects[name].data
        mesh.attributes.remove(mesh.attributes["irradiance"])
        mesh.attributes.active_color_name = mesh.attributes.default_color_name = ""
    assert contents() == before
    for taken in range(1, count + 1):
        generator = steps()
        for _ in range(taken):
            next(generator)
        generator.close()
        assert contents() == before, f"after {taken} steps"


def test_a_failure_while_writing_takes_everything_back(monkeypatch):
    before = contents()
    real = write_attributes._fill

    def fails_on_the_box(mesh, name, rgba):
        real(mesh, name, rgba)
        if mesh.name == "Box":
            raise MemoryError

    monkeypatch.setattr(write_attributes, "_fill", fails_on_the_box)
    with pytest.raises(OutOfMemoryError):
        finished(steps())
    assert contents() == before


def test_objects_that_change_during_the_bake_are_left_alone():
    cube("Gone")
    generator = steps()
    next(generator)
    next(generator)
    bpy.data.objects.remove(bpy.data.objects["Gone"])
    mesh = bpy.data.objects["Box"].data
    mesh.clear_geometry()
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    report, _ = finished(generator)
    assert report.objects == 1
    assert [f"'{name}' was changed during the bake" in " ".join(report.warnings) for name in ("Box", "Gone")] == [
        True
    ] * 2
    assert "irradiance" not in mesh.attributes
    assert colours("Floor").max() > 0


def test_when_every_object_is_gone_it_says_so():
    generator = steps()
    next(generator)
    next(generator)
    for name in ("Floor", "Box"):
        bpy.data.objects.remove(bpy.data.objects[name])
    with pytest.raises(UnwritableFileError, match="changed during the bake"):
        finished(generator)


def test_the_selection_is_baked_alone():
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj.name in ("Box", "Lamp"))
    report, _ = finished(steps(targets="selected"))
    assert (report.objects, report.points, report.triangles) == (1, 24, 30)
    assert "irradiance" not in bpy.data.objects["Floor"].data.attributes
    bpy.data.objects["Box"].select_set(False)
    with pytest.raises(NothingSelectedError):
        finished(steps(targets="selected"))


def test_names_must_be_those_of_meshes():
    for names, words in (
        (("Bax",), "did you mean 'Box'"),
        (("Lamp",), "not a mesh but a light"),
        (("?",), "No object"),
    ):
        with pytest.raises(ObjectNotFoundError, match=words):
            finished(steps(targets=names))
    assert finished(steps(targets=("Box", "Box")))[0].objects == 1


def test_points_of_objects_that_cannot_be_written_are_not_computed(monkeypatch):
    bpy.data.objects["Floor"].data.attributes.new("irradiance", "FLOAT", "POINT")
    # With discs at the points each is baked as it would be alone.
    settings, wanted = replace(SETTINGS, indirect="photons"), []
    real = found_light.bake

    def watched(scene, centres, *others):
        wanted.append(len(centres))
        return real(scene, centres, *others)

    monkeypatch.setattr(found_light, "bake", watched)
    report, _ = finished(steps(settings=settings, fit="vertices"))
    assert wanted == [24] and report.points == 24
    alone = colours("Box")
    bpy.data.objects["Floor"].data.attributes.remove(bpy.data.objects["Floor"].data.attributes["irradiance"])
    finished(steps(settings=settings, fit="vertices"))
    # Rays start off surfaces by what rounding asks for, and that depends on where the points are.
    np.testing.assert_allclose(colours("Box"), alone, rtol=1e-3)


def test_many_refusals_are_said_once():
    for number in range(9):
        obj = grid(f"Taken{number}")
        obj.data.attributes.new("irradiance", "FLOAT", "POINT")
    report, _ = finished(steps())
    refusals = [words for words in report.warnings if "on top of others" not in words]
    assert len(refusals) == 4 and "6 more objects" in refusals[3]
    with pytest.raises(DetpError, match="6 more objects"):
        finished(steps(targets=tuple(f"Taken{number}" for number in range(9))))


@pytest.mark.parametrize(
    "wrong", [{"targets": "all"}, {"domain": "FACE"}, {"quantity": "glow"}, {"attribute": ""}, {"attribute": ".hidden"}]
)
def test_requests_are_checked(wrong):
    with pytest.raises(InvalidSettingError):
        BakeRequest(**wrong)
