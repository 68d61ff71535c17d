"""Tries the add-on in Blender's real window, as a user would: clicks, Esc, Ctrl-Z, another file, and takes pictures.

With the extension installed and enabled, and a scene with at least one mesh and one light:

    blender --enable-event-simulate SCENE.blend --python tools/window/try_panel.py -- FOLDER [PHOTONS [NAME...]]

The pictures go to FOLDER; look at them. PHOTONS (default 2 million) must make a bake that lasts until its buttons are
found; bakes that are waited for take an eighth of them. NAMEs choose among the TRIES below. Blender ends with status 0
when all went well, else with 1 and a traceback. The scene file is not changed.

Without a graphics card Blender's pictures of itself are black: name another program in the environment variable
DETP_SCREENSHOT, such as "scrot -o", which is called with the picture's path.
"""

import os
import sys
import tempfile

import bpy

sys.path.insert(0, os.path.dirname(__file__))
import window_driver as user

FOLDER, *REST = sys.argv[sys.argv.index("--") + 1 :]
PHOTONS = int(REST[0]) if REST else 2_000_000
TRIES = (
    "escape",
    "cancel_button",
    "undo_during_a_bake",
    "a_closed_window",
    "an_error_of_the_program",
    "a_whole_bake",
    "use_in_material",
    "a_removed_object",
    "render_result_is_kept",
    "another_file",
    "switching_off",
)

#: the shading of a viewport that shows the light
LIT = ("SOLID", "VERTEX", "FLAT")


def session():
    """The add-on's own module, under whatever name Blender has loaded it."""
    return next(module for name, module in sys.modules.items() if name.endswith(".detp_addon.panel.session"))


def baking():
    return session().running() is not None


def over():
    return not baking()


def outcome():
    return session().latest().outcome


def left_behind():
    """All that a cancelled bake must not leave."""
    kinds = ("scenes", "objects", "meshes", "cameras", "materials", "collections", "worlds", "node_groups")
    found = {kind: sorted(getattr(bpy.data, kind).keys()) for kind in kinds}
    found["attributes"] = {mesh.name: sorted(mesh.attributes.keys()) for mesh in bpy.data.meshes}
    found["shown"] = {mesh.name: mesh.attributes.active_color_name for mesh in bpy.data.meshes}
    found["scene"] = bpy.context.scene.name
    found["engine"] = bpy.context.scene.render.engine
    return found


def baked():
    attribute = bpy.context.scene.detp.attribute
    return sum(attribute in mesh.attributes for mesh in bpy.data.meshes)


def using():
    return sum("detp_light" in material for material in bpy.data.materials)


def shading():
    found = user.view_area().spaces[0].shading
    return found.type, found.color_type, found.light


def picture(name):
    return user.picture(os.path.join(FOLDER, name + ".png"))


def start_a_bake(whole=False):
    """Press Bake and wait until photons fly; a bake that is waited for is the shorter."""
    bpy.context.scene.detp.photons = PHOTONS // 8 if whole else PHOTONS
    height = yield from user.press("detp.bake")
    yield from user.wait_for(baking, 5)
    yield from user.wait_for(lambda: over() or session().latest().progress.fraction > 0.2)
    assert baking(), f"the bake was over too soon, give it more photons: {outcome()}"
    return height


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
    meshes = [obj for obj in bpy.context.scene.objects if obj.type == "MESH"]
    if len(meshes) < 2:
        return
    yield from start_a_bake(whole=True)
    name = meshes[0].name
    bpy.data.objects.remove(meshes[0])
    yield from user.wait_for(over)
    yield 0.3
    assert outcome().status == "DONE", outcome()
    assert any(name in warning for warning in outcome().report.warnings), outcome().report.warnings
    yield from user.key("Z", ctrl=True)
    yield 0.5


def try_a_whole_bake():
    """The finished bake, shown, taken back by one Ctrl-Z, and baked again."""
    assert baked() == 0
    yield from start_a_bake(whole=True)
    yield from user.wait_for(over)
    yield 0.3
    assert outcome().status == "DONE", outcome()
    count = baked()
    assert count > 0
    user.move(10, 10)
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
    yield from user.key("Z", ctrl=True)
    yield from user.wait_for(lambda: baked() == 0, 5)


def try_use_in_material():
    """The light goes into the materials by one click, and one Ctrl-Z takes it out."""
    yield from start_a_bake(whole=True)
    yield from user.wait_for(over)
    yield 0.3
    yield from user.press("detp.use_in_material")
    yield 0.5
    assert using(), "no material uses the light"
    yield from picture("used")
    yield from user.key("Z", ctrl=True)
    yield from user.wait_for(lambda: not using() and baked() > 0, 5)
    yield from user.key("Z", ctrl=True)
    yield from user.wait_for(lambda: baked() == 0, 5)


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
    yield from start_a_bake(whole=True)
    yield from user.wait_for(over)
    assert rendered() == first, "the bake must not touch the user's Render Result"
    render.engine, render.resolution_x, render.resolution_y, render.resolution_percentage = before


def try_another_file():
    """Opening a file ends the bake without a trace, and the next bake works."""
    yield from start_a_bake()
    running = session().latest()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    yield 0.5
    assert running.outcome.status == "CANCELLED" and "file" in running.outcome.message, running.outcome
    assert session().latest() is None
    yield from user.show_sidebar("Light Bake")
    set_up()
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

    def broken(*arguments):
        for number, progress in enumerate(bake_scene(*arguments)):
            if number == 5:
                raise ZeroDivisionError("made by try_panel.py")
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


def set_up():
    """The settings of all these bakes, and a view that is good for pictures."""
    settings = bpy.context.scene.detp
    settings.auto_photons = False
    for obj in bpy.context.view_layer.objects:
        obj.select_set(False)
    if bpy.context.scene.camera:
        user.view_area().spaces[0].region_3d.view_perspective = "CAMERA"


def main():
    os.makedirs(FOLDER, exist_ok=True)
    set_up()
    bpy.ops.ed.undo_push(message="Set-up")
    yield from user.show_sidebar("Light Bake")
    yield from picture("panel")
    for name in REST[1:] or TRIES:
        print(f"Trying {name}", flush=True)
        yield from globals()["try_" + name]()


user.play(main())
