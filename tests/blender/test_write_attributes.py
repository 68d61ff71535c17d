"""Colours reach the right elements, nothing else changes, and a failure leaves no trace."""

import bpy
import numpy as np
import pytest
from detp.core.errors import AttributeNameTakenError, EditModeError, InvalidSettingError
from detp.detp_addon.writing import write_attributes
from detp.detp_addon.writing.baked_layers import stored_colours
from detp.detp_addon.writing.write_attributes import (
    MeshColours,
    check_attribute_name,
    element_count,
    faces_of,
    obstacle,
    write_colours,
)


@pytest.fixture(autouse=True)
def _empty_file():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def cube(name, mesh=None):
    if mesh is None:
        bpy.ops.mesh.primitive_cube_add()
        obj = bpy.context.object
        obj.name = obj.data.name = name
        return obj
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    return obj


def ramp(obj, domain="CORNER", start=0.0):
    count = element_count(obj.data, domain)
    return MeshColours(obj, {"light": start + np.arange(3 * count).reshape(count, 3) / 8})


def colours(mesh, name="light"):
    return stored_colours(mesh.attributes[name])


def layers(mesh):
    return {layer.name: (layer.data_type, layer.domain) for layer in mesh.attributes}


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
def test_a_new_attribute_holds_the_values_as_floats_and_is_shown(domain):
    obj = cube("a")
    entry = ramp(obj, domain, start=100)
    assert write_colours([entry], domain, "light") == []
    layer = obj.data.attributes["light"]
    assert (layer.data_type, layer.domain) == ("FLOAT_COLOR", domain)
    values = colours(obj.data)
    np.testing.assert_array_equal(values[:, :3], entry.layers["light"].astype(np.float32))
    assert (values[:, 3] == 1).all()
    assert obj.data.attributes.active_color_name == obj.data.attributes.default_color_name == "light"
    assert obj.data.color_attributes[obj.data.color_attributes.render_color_index].name == "light"


@pytest.mark.parametrize("before", ["", "other"])
def test_without_activation_the_shown_layers_stay(before):
    obj = cube("a")
    if before:
        obj.data.color_attributes.new(before, "BYTE_COLOR", "POINT")
    shown = obj.data.attributes.active_color_name, obj.data.attributes.default_color_name
    assert shown == (before, before)
    write_colours([ramp(obj)], "CORNER")
    assert (obj.data.attributes.active_color_name, obj.data.attributes.default_color_name) == shown


def test_a_second_bake_overwrites_colour_but_keeps_alpha_and_other_layers():
    mesh = cube("a").data
    paint = mesh.color_attributes.new("paint", "BYTE_COLOR", "CORNER")
    paint.data.foreach_set("color", np.linspace(0, 1, 96, dtype=np.float32))
    light = mesh.attributes.new("light", "FLOAT_COLOR", "CORNER")
    light.data.foreach_set("color", np.linspace(0, 1, 96, dtype=np.float32))
    mesh.attributes.new("weights", "FLOAT", "POINT")
    uv_layers = [layer.name for layer in mesh.uv_layers]
    paint_before, alpha_before, names = colours(mesh, "paint"), colours(mesh)[:, 3], layers(mesh)
    write_colours([ramp(bpy.data.objects["a"])], "CORNER", "light")
    assert layers(mesh) == names
    np.testing.assert_array_equal(colours(mesh, "paint"), paint_before)
    np.testing.assert_array_equal(colours(mesh)[:, 3], alpha_before)
    assert [layer.name for layer in mesh.uv_layers] == uv_layers


@pytest.mark.parametrize(
    ("kind", "domain"),
    [("FLOAT", "CORNER"), ("BYTE_COLOR", "CORNER"), ("FLOAT_COLOR", "POINT"), ("FLOAT2", "CORNER"), ("group", "")],
)
def test_a_taken_name_is_refused_with_the_object_named(kind, domain):
    obj = cube("Chair")
    if kind == "group":
        obj.vertex_groups.new(name="light")
    else:
        obj.data.attributes.new("light", kind, domain)
    refusal = obstacle(obj, "light", "CORNER")
    assert isinstance(refusal, AttributeNameTakenError)
    assert "'Chair'" in str(refusal) and "'light'" in str(refusal)


def test_an_open_mesh_is_refused():
    obj = cube("a")
    assert obstacle(obj, "light", "CORNER") is None
    bpy.ops.object.mode_set(mode="EDIT")
    assert isinstance(obstacle(obj, "light", "CORNER"), EditModeError)


@pytest.mark.parametrize("name", ["", "  ", ".hidden", "x" * 64, "é" * 32])
def test_names_that_blender_would_change_are_refused(name):
    with pytest.raises(InvalidSettingError):
        check_attribute_name(name)


def test_objects_that_share_a_mesh_each_hold_their_own_light():
    first = cube("first")
    mesh = first.data
    second = cube("second", mesh)
    third = cube("third", mesh)
    second.shape_key_add(name="Basis")
    entries = [ramp(obj, start=10 * number) for number, obj in enumerate((first, second, third))]
    notes = write_colours(entries, "CORNER", "light")
    assert len(notes) == 1 and notes[0].startswith("2 objects") and "'second', 'third'" in notes[0]
    assert first.data is mesh or first.data == mesh
    assert len({obj.data for obj in (first, second, third)}) == 3
    assert second.data.name == "first.second"
    assert second.data.shape_keys is not None
    for entry in entries:
        np.testing.assert_array_equal(colours(entry.object.data)[:, :3], entry.layers["light"].astype(np.float32))


def test_a_mesh_that_an_unbaked_object_uses_stays_as_it_is():
    baked = cube("baked")
    mesh = baked.data
    other = cube("other", mesh)
    before = layers(mesh)
    notes = write_colours([ramp(baked)], "CORNER", "light")
    assert "'baked' shared its mesh" in notes[0]
    assert other.data == mesh and baked.data != mesh
    assert layers(mesh) == before and "light" in layers(baked.data)


def test_a_failure_half_way_takes_everything_back(monkeypatch):
    first, plain = cube("first"), cube("plain")
    second = cube("second", first.data)
    again = cube("again")
    write_colours([ramp(again)], "CORNER", "light")
    shown = again.data.attributes.new("paint", "FLOAT_COLOR", "CORNER").name
    again.data.attributes.active_color_name = shown
    objects = (first, second, plain, again)
    before = [(obj.data.name, layers(obj.data), obj.data.attributes.active_color_name) for obj in objects]
    light, meshes = colours(again.data), set(bpy.data.meshes)

    real = write_attributes._fill

    def fail_on_the_last(mesh, name, rgba):
        real(mesh, name, rgba)
        if mesh == again.data and rgba[0, 0] == 40:
            raise MemoryError

    monkeypatch.setattr(write_attributes, "_fill", fail_on_the_last)
    with pytest.raises(MemoryError):
        write_colours([ramp(obj, start=40) for obj in objects], "CORNER", "light")
    assert [(obj.data.name, layers(obj.data), obj.data.attributes.active_color_name) for obj in objects] == before
    assert set(bpy.data.meshes) == meshes
    np.testing.assert_array_equal(colours(again.data), light)


def test_faces_name_face_and_vertex_of_each_corner():
    mesh = bpy.data.meshes.new("two")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0)], [], [(0, 1, 2, 3), (1, 4, 2)])
    corner, point = faces_of(mesh, "CORNER"), faces_of(mesh, "POINT")
    np.testing.assert_array_equal(corner.corner_face, [0, 0, 0, 0, 1, 1, 1])
    np.testing.assert_array_equal(corner.corner_vertex, [0, 1, 2, 3, 1, 4, 2])
    np.testing.assert_array_equal(corner.positions[4], (2, 0, 0))
    assert (corner.by_vertex, point.by_vertex) == (False, True)
