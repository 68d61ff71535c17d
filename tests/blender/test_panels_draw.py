"""Panels draw what there is: every property and operator that they name exists."""

import types

import bpy
import pytest
from detp.detp_addon.panel import animation, mixer
from small_scenes import cube, grid, lamp


class Layout:
    """Stands in for Blender's own, which there is only in a window; notes what is drawn."""

    def __init__(self):
        object.__setattr__(self, "drawn", [])

    def __setattr__(self, _name, _value):
        """Alignment, size and the like."""

    def row(self, **_):
        return self

    column = row

    def separator(self):
        """Nothing that could be wrong."""

    def prop(self, data, name, text=None, **_):
        assert name in data.bl_rna.properties
        self.drawn.append(text or name)

    def operator(self, name, **_):
        assert hasattr(bpy.types, name.replace("detp.", "DETP_OT_"))
        self.drawn.append(name)

    def operator_menu_enum(self, name, _property, **_):
        self.operator(name)

    def label(self, text="", **_):
        self.drawn.append(text)


def drawn(cls):
    layout = Layout()
    context = types.SimpleNamespace(
        scene=bpy.context.scene, view_layer=bpy.context.view_layer, object=bpy.context.object,
        preferences=bpy.context.preferences, region=types.SimpleNamespace(width=400),
        window_manager=bpy.context.window_manager,
    )  # fmt: skip
    assert not hasattr(cls, "poll") or cls.poll(context)
    cls.draw(types.SimpleNamespace(layout=layout), context)
    return layout.drawn


@pytest.fixture
def scene(addon):
    grid("Floor")
    cube("Box").keyframe_insert("location", frame=1)
    lamp()
    return bpy.context.scene


def test_updates_are_offered_where_bakes_are_kept(scene):
    before = drawn(bpy.types.DETP_PT_render_bake)
    assert "detp.bake" in before and "detp.update" not in before
    scene.detp.keep = True
    after = drawn(bpy.types.DETP_PT_render_bake)
    assert after.index("detp.update") == after.index("detp.bake") + 1 and "detp_live_updates" in after


def test_the_mixer_has_a_row_for_each_group(scene):
    with pytest.raises(AssertionError):
        drawn(mixer.DETP_PT_mixer)
    bpy.ops.detp.bake(photons=1000, fit="VERTICES", by_light=True)
    assert drawn(mixer.DETP_PT_mixer) == ["Lamp", "colour", "detp.reset_mix"]
    scene.detp_mix.lights.clear()
    assert drawn(mixer.DETP_PT_mixer) == ["detp.find_lights"]
    bpy.ops.detp.find_lights()
    assert [entry.name for entry in scene.detp_mix.lights] == ["Lamp"]


def test_the_animation_panel_says_what_it_will_take_and_removes_what_is_there(scene):
    settings = scene.detp_animation
    settings.moving_only, settings.own_range, settings.last = True, True, 2
    before = drawn(animation.DETP_PT_animation)
    assert "Box: Moving (automatic)" in before and any("for 2 frames" in text for text in before)
    assert "detp.bake_animation" in before and "detp.remove_animation" not in before
    bpy.ops.detp.bake_animation(photons=1000, fit="VERTICES")
    assert "detp.remove_animation" in drawn(animation.DETP_PT_animation)
    settings.last = 1
    assert any("at least two frames" in text for text in drawn(animation.DETP_PT_animation))
