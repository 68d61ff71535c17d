"""Tries of bakes that something comes in between of, and of what they leave."""

import os
import sys
import tempfile

import bpy
import window_driver as user
from watching import (
    LIT,
    MANY,
    SCENE,
    baked,
    baking,
    finished_bake,
    left_behind,
    open_scene,
    outcome,
    over,
    picture,
    session,
    shading,
    start_a_bake,
    whole_bake,
)


def try_escape():
    before = left_behind()
    yield from start_a_bake()
    yield from picture("baking")
    yield from user.key("ESC")
    yield from user.wait_for(over, 2)
    yield 0.3
    assert outcome().status == "CANCELLED", outcome()
    assert left_behind() == before
    yield from picture("cancelled")


def try_cancel_button():
    before = left_behind()
    height = yield from start_a_bake()
    yield from user.press("detp.cancel", below=height + 30)
    yield from user.wait_for(over, 2)
    yield 0.3
    assert outcome().status == "CANCELLED" and left_behind() == before


def try_undo_during_a_bake():
    """The keys do nothing; an undo from elsewhere, such as the menu, ends the bake."""
    before = left_behind()
    yield from start_a_bake()
    yield from user.key("Z", ctrl=True)
    yield 0.2
    assert baking()
    bpy.ops.ed.undo_push(message="A change during the bake")
    bpy.ops.ed.undo()
    yield 0.3
    assert outcome().status == "CANCELLED" and "undo" in outcome().message, outcome()
    assert left_behind() == before


def try_a_removed_object():
    """Its light is not written, and the others' is; then it comes back by undo."""
    bpy.ops.ed.undo_push(message="Before the removal")
    obj = next(obj for obj in bpy.context.scene.objects if obj.type == "MESH")
    yield from start_a_bake(MANY // 32)
    name = obj.name
    bpy.data.objects.remove(obj)
    yield from finished_bake()
    assert any(name in warning for warning in outcome().report.warnings), outcome().report.warnings
    yield from user.key("Z", ctrl=True)
    yield 0.5


def try_a_whole_bake():
    """The finished bake, shown, taken back by one Ctrl-Z, and baked again."""
    assert baked() == 0
    yield from whole_bake()
    count = baked()
    assert count > 0
    yield from picture("baked")
    assert shading() == LIT
    yield from user.press("detp.show")
    yield from user.wait_for(lambda: shading() != LIT, 5)
    yield from user.press("detp.show")
    yield from user.wait_for(lambda: shading() == LIT, 5)
    yield from user.key("Z", ctrl=True)
    yield from user.wait_for(lambda: baked() == 0 and shading() != LIT, 5)
    yield from user.key("Z", ctrl=True, shift=True)
    yield from user.wait_for(lambda: baked() == count and shading() == LIT, 5)


def rendered():
    """The pixels of the user's Render Result, through a file: the image itself gives none."""
    path = os.path.join(tempfile.gettempdir(), "detp_render_result.png")
    bpy.data.images["Render Result"].save_render(path, scene=bpy.context.scene)
    image = bpy.data.images.load(path)
    pixels = image.pixels[:]
    bpy.data.images.remove(image)
    os.remove(path)
    return pixels


def try_render_result_is_kept():
    render = bpy.context.scene.render
    before = render.engine, render.resolution_x, render.resolution_y, render.resolution_percentage
    render.engine = "BLENDER_WORKBENCH"
    render.resolution_x, render.resolution_y, render.resolution_percentage = 64, 48, 100
    bpy.ops.render.render()
    first = rendered()
    yield from whole_bake()
    assert rendered() == first, "the bake must not touch the user's Render Result"
    render.engine, render.resolution_x, render.resolution_y, render.resolution_percentage = before


def try_another_file():
    """Opening a file ends the bake without a trace, and the next bake works."""
    yield from start_a_bake()
    running = session().latest()
    bpy.ops.wm.open_mainfile(filepath=SCENE)
    yield 0.5
    assert running.outcome.status == "CANCELLED" and "file" in running.outcome.message, running.outcome
    assert session().latest() is None
    yield from open_scene()
    yield from start_a_bake()
    yield from user.key("ESC")
    yield from user.wait_for(over, 2)


def try_a_closed_window():
    """The bake ends with the window it was started in."""
    before = left_behind()
    bpy.ops.wm.window_new()
    yield 0.5
    second = bpy.context.window_manager.windows[-1]
    with bpy.context.temp_override(window=second, screen=second.screen):
        bpy.ops.detp.bake("INVOKE_DEFAULT")
    yield 0.5
    running = session().latest()
    assert running.outcome is None
    with bpy.context.temp_override(window=second, screen=second.screen):
        bpy.ops.wm.window_close()
    yield 0.5
    assert running.outcome.status == "CANCELLED" and "window" in running.outcome.message, running.outcome
    assert left_behind() == before


def try_an_error_of_the_program():
    """It is told, leaves nothing, and the next bake works."""
    before = left_behind()
    operators = sys.modules[session().__name__.replace(".session", ".operators")]
    bake_scene = operators.bake_scene

    def broken(*arguments, **kept):
        for number, progress in enumerate(bake_scene(*arguments, **kept)):
            if number == 5:
                raise ZeroDivisionError("made by this try")
            yield progress

    operators.bake_scene = broken
    try:
        latest = session().latest()
        yield from user.press("detp.bake")
        yield from user.wait_for(lambda: session().latest() is not latest and over())
        yield 0.5
    finally:
        operators.bake_scene = bake_scene
    assert over() and outcome().status == "FAILED" and "ZeroDivisionError" in outcome().message, outcome()
    assert left_behind() == before
    yield from picture("broken")
    yield from user.key("ESC")


def try_switching_off():
    """Switching the add-on off ends the bake; it can be switched on again."""
    yield from start_a_bake()
    running, name = session().latest(), session().__name__.removesuffix(".detp_addon.panel.session")
    bpy.ops.preferences.addon_disable(module=name)
    yield 0.5
    assert running.outcome.status == "CANCELLED", running.outcome
    bpy.ops.preferences.addon_enable(module=name)
    yield 0.5
    assert bpy.ops.detp.bake.poll()


def try_uninstalling():
    """The light stays in the file, and nothing of the add-on in Blender."""
    yield from whole_bake()
    count, name = baked(), session().__name__.removesuffix(".detp_addon.panel.session")
    folder = os.path.dirname(sys.modules[name].__file__)
    attribute = bpy.context.scene.detp.attribute
    repositories = [each.module for each in bpy.context.preferences.extensions.repos]
    bpy.ops.extensions.package_uninstall(repo_index=repositories.index(name.split(".")[1]), pkg_id="detp")
    yield 0.5
    assert not hasattr(bpy.types.Scene, "detp") and not hasattr(bpy.types, "DETP_OT_bake")
    assert name not in bpy.context.preferences.addons and not os.path.exists(folder), folder
    assert sum(attribute in mesh.attributes for mesh in bpy.data.meshes) == count
    yield from picture("uninstalled")
