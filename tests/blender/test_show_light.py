"""Show Baked Light: there whenever the light is, and gone with it."""

import types

import bpy
import numpy as np
import pytest
from detp.detp_addon.materials.light_in_materials import remove_from_materials, use_in_materials
from detp.detp_addon.panel import show_light
from detp.detp_addon.writing.write_attributes import MeshColours, write_colours
from small_scenes import cube, grid, painted

pytestmark = pytest.mark.usefixtures("addon")


class Area:
    """A viewport with the shading that Blender starts with."""

    def __init__(self):
        self.type, self.width, self.height = "VIEW_3D", 100, 100
        self.shading = types.SimpleNamespace(type="RENDERED", color_type="MATERIAL", light="STUDIO")
        self.spaces = types.SimpleNamespace(active=types.SimpleNamespace(shading=self.shading))

    def as_pointer(self):
        return id(self)

    @property
    def state(self):
        return self.shading.type, self.shading.color_type, self.shading.light


LIT, BEFORE = ("SOLID", "VERTEX", "FLAT"), ("RENDERED", "MATERIAL", "STUDIO")


@pytest.fixture
def context():
    grid("Floor")
    cube("Box")
    area = Area()
    window = types.SimpleNamespace(screen=types.SimpleNamespace(areas=[area]))
    return types.SimpleNamespace(
        area=area, window=window, space_data=types.SimpleNamespace(type="VIEW_3D"), scene=bpy.context.scene
    )


def light_up(name="Floor", attribute="irradiance", look=False, shown=None):
    obj = bpy.data.objects[name]
    rgb = np.ones((len(obj.data.loops), 3))
    write_colours([MeshColours(obj, {attribute: rgb}, look=rgb / 2 if look else None)], "CORNER", shown)


def test_there_is_a_button_whenever_a_mesh_has_the_attribute(context, tmp_path):
    show = show_light.DETP_OT_show
    assert not show.poll(context)
    light_up()
    assert show.poll(context)
    path = str(tmp_path / "baked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    context.scene = bpy.context.scene
    assert show.poll(context)
    context.scene.detp.attribute = "night"
    assert not show.poll(context)


def test_it_shows_the_light_and_goes_back(context):
    light_up()
    mesh = bpy.data.objects["Floor"].data
    mesh.color_attributes.new("paint", "BYTE_COLOR", "CORNER")
    mesh.attributes.active_color_name = "paint"
    show_light.DETP_OT_show.execute(None, context)
    assert context.area.state == LIT and mesh.attributes.active_color_name == "irradiance"
    show_light.DETP_OT_show.execute(None, context)
    assert context.area.state == BEFORE


def test_viewports_show_the_look_and_renders_the_light():
    grid("Floor")
    light_up(look=True, shown="irradiance")
    layers = bpy.data.objects["Floor"].data.attributes
    assert (layers.active_color_name, layers.default_color_name) == ("irradiance_look", "irradiance")
    # A layer of the user's own with that name stays.
    cube("Box")
    mine = bpy.data.objects["Box"].data.color_attributes.new("irradiance_look", "BYTE_COLOR", "CORNER")
    mine.data[0].color = (1, 0, 0, 1)
    light_up("Box", look=True, shown="irradiance")
    layers = bpy.data.objects["Box"].data.attributes
    assert layers.active_color_name == "irradiance" and tuple(layers["irradiance_look"].data[0].color) == (1, 0, 0, 1)


def test_materials_that_use_the_light_show_it_themselves(context, monkeypatch):
    manager = types.SimpleNamespace(windows=[context.window])
    fake = types.SimpleNamespace(context=types.SimpleNamespace(scene=context.scene, window_manager=manager))
    monkeypatch.setattr(show_light, "bpy", fake)
    floor = bpy.data.objects["Floor"]
    painted(floor, (0.8, 0.4, 0.2))
    light_up(look=True, shown="irradiance")
    show_light.DETP_OT_show.execute(None, context)
    assert context.area.state == LIT
    use_in_materials([floor], "irradiance")
    # The layer for the viewport has done its work.
    assert [layer.name for layer in floor.data.color_attributes] == ["irradiance"]
    assert floor.data.attributes.active_color_name == "irradiance"
    show_light.follow_light()
    assert context.area.state[0] == "MATERIAL"
    remove_from_materials([floor])
    show_light.follow_light()
    assert context.area.state == LIT
    show_light.DETP_OT_show.execute(None, context)
    assert context.area.state == BEFORE


def test_undo_takes_the_shading_back_and_redo_brings_it(context, monkeypatch):
    manager = types.SimpleNamespace(windows=[context.window])
    fake = types.SimpleNamespace(context=types.SimpleNamespace(scene=context.scene, window_manager=manager))
    monkeypatch.setattr(show_light, "bpy", fake)
    view, context.area = context.area, None  # the button in the render properties shows the light all the same
    show_light.show_while(context)
    context.area = view
    assert context.area.state == LIT
    light_up()
    show_light.follow_light()
    assert context.area.state == LIT
    mesh = bpy.data.objects["Floor"].data
    mesh.attributes.remove(mesh.attributes["irradiance"])
    show_light.follow_light()
    assert context.area.state == BEFORE
    light_up()
    show_light.follow_light()
    assert context.area.state == LIT
