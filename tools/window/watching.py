"""What the tries of the window have in common: what they look at, a bake that is begun, another file."""

import os
import sys

import bpy
import numpy as np
import window_driver as user

FOLDER, *NAMES = sys.argv[sys.argv.index("--") + 1 :]

#: the file that Blender was started with
SCENE = bpy.data.filepath

#: photons of bakes that are interrupted: minutes on any machine
MANY = 2_000_000

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
    found["shading"] = shading()
    return found


def baked():
    """How many meshes have light."""
    attribute = bpy.context.scene.detp.attribute
    return sum(attribute in mesh.attributes for mesh in bpy.data.meshes)


def light_of(name):
    """The light of an object's mesh (C, 3)."""
    layer = bpy.data.objects[name].data.color_attributes[bpy.context.scene.detp.attribute]
    values = np.empty(4 * len(layer.data), np.float32)
    layer.data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def using():
    """How many materials use the light."""
    return sum("detp_light" in material for material in bpy.data.materials)


def shading():
    found = user.area().spaces[0].shading
    return found.type, found.color_type, found.light


def picture(name):
    return user.picture(os.path.join(FOLDER, name + ".png"))


def open_file(path=None):
    """Open a file, or what Blender starts with, and let it be drawn."""
    if path is None:
        bpy.ops.wm.read_homefile(app_template="", use_factory_startup=True)
    else:
        bpy.ops.wm.open_mainfile(filepath=str(path))
    yield 0.5


def open_scene():
    """The file that Blender was started with, as most tries want it."""
    yield from open_file(SCENE)
    yield from user.show_sidebar("Light Bake")
    set_up()


def set_up():
    """A view that is good for pictures, and a state to come back to."""
    for obj in bpy.context.view_layer.objects:
        obj.select_set(False)
    if bpy.context.scene.camera:
        user.area().spaces[0].region_3d.view_perspective = "CAMERA"
    bpy.ops.ed.undo_push(message="Set-up")


def start_a_bake(photons=MANY):
    """Press Bake, for so many photons, and wait until there is light; returns the button's height."""
    settings = bpy.context.scene.detp
    settings.auto_photons, settings.photons = False, photons
    latest = session().latest()
    height = yield from user.press("detp.bake")
    yield from user.wait_for(lambda: session().latest() not in (None, latest), 5)
    yield from user.wait_for(lambda: over() or session().latest().progress.error is not None)
    assert baking(), outcome()
    return height


def whole_bake():
    """Press Bake, with the panel on Draft, and wait for the end."""
    settings = bpy.context.scene.detp
    settings.auto_photons, settings.quality = True, "DRAFT"
    yield from user.press("detp.bake")
    yield from finished_bake()


def finished_bake():
    """Wait for the end of a bake that was begun."""
    yield 0.1
    yield from user.wait_for(over, 180)
    yield 0.3
    assert outcome().status == "DONE", outcome()
    user.move(10, 10)
