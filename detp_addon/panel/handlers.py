"""What Blender does around a running bake: another file, an undo, the end of the add-on."""

import bpy
from bpy.app.handlers import persistent

from ..updates import latest_kept
from . import session
from .forecasts import forget_unsaved
from .live_updates import follower
from .mixer import follow_mixture
from .show_light import follow_light


@persistent
def _before_load(*_args):
    follower.stop()
    session.cancel_running("The bake was cancelled because another file was opened.")


@persistent
def _after_load(*_args):
    session.forget()
    latest_kept.forget()
    latest_kept.look_for_file()
    forget_unsaved()
    for scene in bpy.data.scenes:
        if scene.library is None:
            follow_mixture(scene)


@persistent
def _after_save(path, *_args):
    # A copy is another file, and this one on disk may be older than what is kept.
    if path == bpy.data.filepath:
        latest_kept.write_beside(path)


@persistent
def _before_undo(*_args):
    session.cancel_running("The bake was cancelled by an undo, which may change what it has read.")


@persistent
def _after_undo(*_args):
    follow_light()
    follower.see_change()


#: by the name of Blender's list
_FOLLOWED = {
    "load_pre": _before_load, "load_post": _after_load, "save_post": _after_save, "undo_pre": _before_undo,
    "redo_pre": _before_undo, "undo_post": _after_undo, "redo_post": _after_undo,
}  # fmt: skip


def register_handlers() -> None:
    """Follow file loads, saves and undo."""
    for name, handler in _FOLLOWED.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister_handlers() -> None:
    """Stop following, and cancel a running bake."""
    session.cancel_running("The bake was cancelled because the add-on was switched off.")
    session.forget()
    latest_kept.forget()
    forget_unsaved()
    for name, handler in _FOLLOWED.items():
        getattr(bpy.app.handlers, name).remove(handler)
