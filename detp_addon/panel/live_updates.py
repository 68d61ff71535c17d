"""Updates while the user works: once nothing has changed for a moment, the light follows.

A timer does the work in slices. It makes no step of undo: Ctrl-Z takes back what the user did, and the light follows.
"""

from __future__ import annotations

import time

import bpy
from bpy.app.handlers import persistent

from ..job import bake_scene
from ..updates.latest_kept import kept_of
from ..wording import duration
from . import session
from .idle import redraw_panels
from .mixer import follow_mixture

#: seconds without a change after which the light follows, between two looks at the clock, of work at a time, and
#: between two such slices
QUIET, TICK, SLICE, PAUSE = 0.5, 0.1, 0.05, 0.01

#: Seconds that the window may stand still, for a step that cannot be parted; beyond them nothing follows any more.
LONGEST = 2.0


class _Follower:
    """Whether the light follows, and what it is doing.

    on       the user's wish, and why_not: a sentence where it had to end
    changed  when the scene was last changed by someone else (of time.perf_counter), None when the light knows of it
    bake     the update that is running
    """

    def __init__(self):
        self.on, self.why_not = False, ""
        self.changed: float | None = None
        self.bake: session.RunningBake | None = None
        self._working, self._stood = False, 0.0

    def switch(self, on: bool) -> None:
        """Begin to follow, or end."""
        if on == self.on:
            return
        self.on, self.why_not, self.changed = on, "", time.perf_counter()
        if on:
            bpy.app.timers.register(_tick, first_interval=TICK, persistent=True)
        else:
            self._cancel("The update was cancelled, since updates while moving were switched off.")

    def stop(self) -> None:
        """Follow no more: another file is opened, or the add-on ends."""
        self.switch(False)
        self.why_not = ""

    def see_change(self) -> None:
        """The scene is another: what was found of it so far is old."""
        if self.on and not self._working:
            self.changed = time.perf_counter()
            self._cancel("The update was cancelled, since the scene changed meanwhile; another follows.")

    def tick(self) -> float:
        """Begin what is due, or work on; returns the seconds until the next look."""
        if self.bake is None and self._due():
            self._begin()
        if self.bake is None:
            return TICK
        self._work()
        return PAUSE

    def _due(self) -> bool:
        if self.changed is None or time.perf_counter() < self.changed + QUIET or session.running() is not None:
            return False
        return bool(kept_of(bpy.context.scene, bpy.context.view_layer)) and not _user_is_busy()

    def _begin(self) -> None:
        scene, view_layer = bpy.context.scene, bpy.context.view_layer
        kept = kept_of(scene, view_layer)
        request = kept.request(scene, whole=False)
        self.changed, self._stood = None, 0.0
        self.bake = session.begin(bake_scene(scene, view_layer, request, kept=kept))

    def _work(self) -> None:
        begin, self._working = time.perf_counter(), True
        try:
            if self.bake.outcome is None:
                self.bake.step(SLICE)
            if self.bake.outcome is not None and self.bake.outcome.status == session.DONE:
                follow_mixture(bpy.context.scene)
            # What was read and written is evaluated now, so that it is not taken for a change by the user.
            bpy.context.view_layer.update()
        finally:
            self._working = False
            if self.bake.outcome is not None:
                self.bake = None
            redraw_panels(bpy.context)
        self._stood = max(self._stood, time.perf_counter() - begin)
        if self.bake is None and self._stood > LONGEST:
            self.switch(False)
            self.why_not = (
                f"Updates while moving are off again, since the window stood still for {duration(self._stood)}: "
                f"press Update when you like."
            )

    def _cancel(self, message: str) -> None:
        if self.bake is not None:
            self.bake.cancel(message)
            self.bake = None


follower = _Follower()


def _tick() -> float | None:
    if not follower.on:
        return None
    try:
        return follower.tick()
    except BaseException:
        follower.switch(False)
        raise


def _user_is_busy() -> bool:
    """Whether the user moves something, edits a mesh or renders."""
    modal = (each.bl_idname for window in bpy.context.window_manager.windows for each in window.modal_operators)
    moves = any(name.startswith("TRANSFORM_OT") for name in modal)
    return moves or bpy.context.mode != "OBJECT" or bpy.app.is_job_running("RENDER")


@persistent
def _after_evaluation(_scene, depsgraph):
    if any(u.is_updated_transform or u.is_updated_geometry or u.is_updated_shading for u in depsgraph.updates):
        follower.see_change()


def register_live_updates() -> None:
    """Give the window manager its switch, which no file keeps, and follow evaluations of the scene."""
    bpy.types.WindowManager.detp_live_updates = bpy.props.BoolProperty(
        name="Update While Moving",
        description="Update the light by itself once nothing has been changed for a moment. "
        "It ends by itself where the window would stand still for long",
        get=lambda _manager: follower.on,
        set=lambda _manager, on: follower.switch(on),
    )
    bpy.types.WindowManager.detp_live_note = bpy.props.StringProperty(get=lambda _manager: follower.why_not)
    bpy.app.handlers.depsgraph_update_post.append(_after_evaluation)


def unregister_live_updates() -> None:
    """Take both away."""
    follower.stop()
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    bpy.app.handlers.depsgraph_update_post.remove(_after_evaluation)
    del bpy.types.WindowManager.detp_live_note
    del bpy.types.WindowManager.detp_live_updates
