import bpy
import pytest
from detp import detp_addon
from detp.detp_addon.panel import animation, mixer, operators, panel, properties, result_panel, show_light, use_light

PARTS = (operators, show_light, use_light, panel, animation, mixer, result_panel)
GROUPS = (properties.DETP_PG_settings, animation.DETP_PG_animation, mixer.DETP_PG_mixture, mixer.DETP_PG_light)
CLASSES = (*(cls for part in PARTS for cls in part.CLASSES), *GROUPS)
OPERATORS = [cls for cls in CLASSES if issubclass(cls, bpy.types.Operator)]


def registered() -> list[type]:
    return [cls for cls in CLASSES if cls.is_registered]


def handlers() -> list:
    kinds = ("load_pre", "load_post", "undo_pre", "redo_pre", "undo_post", "redo_post")
    return [handler for kind in kinds for handler in getattr(bpy.app.handlers, kind) if "detp" in handler.__module__]


def test_register_unregister_register():
    detp_addon.register()
    assert len(registered()) == len(CLASSES) and len(handlers()) == 6
    detp_addon.unregister()
    assert registered() == [] and handlers() == [] and not hasattr(bpy.types.Scene, "detp")
    detp_addon.register()
    try:
        assert len(registered()) == len(CLASSES) and len(handlers()) == 6
        assert bpy.context.scene.detp.quality == "PREVIEW"
    finally:
        detp_addon.unregister()


def test_settings_are_saved_with_the_scene(addon, tmp_path):
    settings = bpy.context.scene.detp
    settings.quality, settings.auto_radius, settings.radius, settings.attribute = "FINAL", False, 0.25, "Light"
    path = str(tmp_path / "settings.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert bpy.context.scene.detp.quality == "PREVIEW"
    bpy.ops.wm.open_mainfile(filepath=path)
    settings = bpy.context.scene.detp
    assert (settings.quality, settings.auto_radius, settings.attribute) == ("FINAL", False, "Light")
    assert settings.radius == pytest.approx(0.25)


def test_everything_a_user_sees_has_a_tooltip(addon):
    kinds = [getattr(bpy.ops.detp, cls.bl_idname.split(".")[1]).get_rna_type() for cls in OPERATORS]
    for kind in (*kinds, *(group.bl_rna for group in GROUPS)):
        assert kind.description or kind.identifier in {group.__name__ for group in GROUPS}
        for prop in kind.properties:
            if prop.identifier in ("rna_type", "name") or not prop.is_runtime:
                continue
            assert prop.description and not prop.description.endswith("."), prop.identifier
            for item in prop.enum_items if prop.type == "ENUM" else ():
                assert item.description and not item.description.endswith("."), item.identifier
