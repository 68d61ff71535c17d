"""Tries of updates: a bake is kept, something moves, and the light follows by a click or by itself."""

import bpy
import window_driver as user
from watching import baked, baking, finished_bake, left_behind, light_of, outcome, over, picture


def _a_kept_bake():
    """Bake with updates in mind; returns the name of an object to move, since undo makes objects new."""
    settings = bpy.context.scene.detp
    settings.keep, settings.auto_photons, settings.quality = True, True, "DRAFT"
    yield 0.3
    # Where bakes are kept, Update stands beside Bake.
    yield from user.press("detp.bake", across=0.35)
    yield from finished_bake()
    return [obj.name for obj in bpy.context.scene.objects if obj.type == "MESH"][-1]


def _light():
    """The colours of all meshes, to be compared."""
    return {obj.name: light_of(obj.name).tobytes() for obj in bpy.context.scene.objects if obj.type == "MESH"}


def _take_back(times):
    for _ in range(times):
        yield from user.key("Z", ctrl=True)
        yield 0.5


def try_an_update():
    """It finds other light after a move; Esc leaves all, and Ctrl-Z takes first the light back, then the move."""
    name = yield from _a_kept_bake()
    first = _light()
    bpy.data.objects[name].location.x += 0.05
    bpy.ops.ed.undo_push(message="A move")
    before = left_behind()
    yield from user.press("detp.update")
    yield from user.wait_for(baking, 5)
    yield from user.key("ESC")
    yield from user.wait_for(over, 10)
    yield 0.3
    assert outcome().status == "CANCELLED" and _light() == first and left_behind() == before, outcome()
    yield from user.press("detp.update")
    yield from user.wait_for(baking, 5)
    yield from finished_bake()
    assert outcome().report.updated and _light() != first, outcome()
    yield from picture("updated")
    yield from user.key("Z", ctrl=True)
    yield from user.wait_for(lambda: _light() == first, 5)
    yield from _take_back(2)
    yield from user.wait_for(lambda: baked() == 0, 5)


def try_updates_while_moving():
    """The light follows a move by itself, and follows when Ctrl-Z takes the move back."""
    name = yield from _a_kept_bake()
    first, manager = _light(), bpy.context.window_manager
    manager.detp_live_updates = True
    yield 2.0
    yield from user.wait_for(over)
    bpy.ops.ed.undo_push(message="Before the move")
    bpy.data.objects[name].location.x += 0.05
    bpy.ops.ed.undo_push(message="A move")
    yield from user.wait_for(lambda: over() and _light() != first)
    assert outcome().report.updated, outcome()
    yield from picture("followed")
    yield from user.key("Z", ctrl=True)
    yield 2.0
    yield from user.wait_for(lambda: over() and _light() == first)
    manager.detp_live_updates = False
    yield from _take_back(2)
    yield from user.wait_for(lambda: baked() == 0, 5)
