"""What the panel's buttons do: bake, cancel, stop, copy the report."""

import time
from dataclasses import replace

import bpy

from ...core.errors import DetpError
from ..chosen_objects import chosen_objects
from ..command.terminal import escaped
from ..job import bake_scene
from ..request import BakeRequest
from ..units import metres_per_unit
from ..updates import latest_kept
from ..updates.kept_bake import KeptBake
from ..wording import counted, percent
from ..writing.baked_layers import error_there
from ..writing.face_division import divide_faces, most_vertices, select_faces
from ..writing.live_colours import LiveColours
from . import session
from .forecasts import forecast_of, remember
from .idle import Idle, redraw_panels
from .mixer import follow_mixture
from .properties import BakeOptions, bake_request, scene_options
from .show_light import show_while

#: seconds of work at a time; where Blender is slow to draw, as long as it was away, so that half the time is work
SHORTEST_SLICE, LONGEST_SLICE = 0.07, 0.5
#: seconds between the timer's ticks, and between two redraws of the progress
TICK, REDRAW = 0.02, 0.2


class BakeRunner(Idle):
    """What runs a bake, at once or in slices; what it bakes, its subclasses say."""

    _kept: KeptBake | None = None  # what it keeps for updates

    def execute(self, context):
        """Bake at once, from a script or in background mode; arguments that are not given come from the scene."""
        self._live = False
        bake = self._begun(context)
        if bake is None:
            return {"CANCELLED"}
        bake.run()
        return self._ended(context, bake)

    def invoke(self, context, _event):
        """Bake in slices, so that the window stays alive and Esc cancels."""
        if context.window is None:
            return self.execute(context)
        self._live = self._wants_live(context)
        self._bake = self._begun(context)
        if self._bake is None:
            return {"CANCELLED"}
        self._workspace = context.workspace.name
        self._unshow = show_while(context) if self._live else None
        self._timer = context.window_manager.event_timer_add(TICK, window=context.window)
        context.window_manager.modal_handler_add(self)
        self._worked = time.perf_counter()
        self._show_progress(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """One slice on each tick; everything but Esc and Undo goes on to the rest of Blender."""
        swallowed = False
        if self._bake.outcome is None:
            if event.type == "ESC" and event.value == "PRESS":
                self._bake.cancel()
                swallowed = True
            elif event.type == "TAB" and self._live:
                swallowed = True  # what is shown could not be replaced in Edit Mode
            elif event.type == "Z" and (event.ctrl or event.oskey):
                swallowed = True  # an undo would take the scene back behind what the bake has read
            elif event.type == "TIMER":
                try:
                    self._work()
                except BaseException:
                    self._close(context)
                    if self._live:
                        self._unshow()
                    raise
        if self._bake.outcome is not None:
            self._close(context)
            return self._ended(context, self._bake)
        if time.perf_counter() > self._drawn + REDRAW or self._bake.progress.phase != self._phase:
            self._show_progress(context)
        return {"RUNNING_MODAL"} if swallowed else {"PASS_THROUGH"}

    def cancel(self, context):
        """Blender itself ends the operator: the window is closed, or another file is opened."""
        self._bake.cancel("The bake was cancelled because its window was closed.")
        self._close(context)

    def draw(self, _context):
        """Adjust Last Operation says what was done; a slider there would bake again at every touch."""
        bake = session.latest()
        if bake is not None and bake.outcome is not None:
            self.layout.label(text=bake.outcome.message)

    def _wants_live(self, context) -> bool:
        return self.live if self.properties.is_property_set("live") else context.scene.detp.live

    def _begun(self, context) -> session.RunningBake | None:
        options = self._options(context)
        for name, value in options.items():
            setattr(self, name, value)  # so that a repetition bakes the same
        try:
            self._request = request = self._asked(context, options)
            live = LiveColours(request.domain, request.attribute if request.activate else None) if self._live else None
            steps = self._steps(context, request, options, live)
            expected, timed = self._expected(context, request, options), request.settings.seconds is not None
            chosen = chosen_objects(context.scene, context.view_layer, request.targets) or context.scene.objects
            standing = error_there([obj.data for obj in chosen if obj.type == "MESH"], request.attribute)
            latest_kept.begin(self._kept)
            return session.begin(steps, expected=expected, timed=timed, standing=standing)
        except DetpError as error:
            self.refused(error)
            return None

    def _asked(self, context, options: dict) -> BakeRequest:
        """What is to be baked."""
        return replace(bake_request(options, metres_per_unit(context.scene)), look=self._live)

    def _options(self, context) -> dict:
        """The arguments by name; those that are not given come from the scene."""
        return self._given(scene_options(context.scene.detp))

    def _given(self, options: dict) -> dict:
        """The ``options``, with those that are given in their places."""
        given = filter(self.properties.is_property_set, options)
        return options | {name: getattr(self, name) for name in given}

    def _steps(self, context, request, options, live):
        if options["keep"]:
            given = context.scene, context.view_layer, request, options["keep_on_disk"]
            self._kept = KeptBake(*given, looks=True)
        return bake_scene(context.scene, context.view_layer, request, live, kept=self._kept)

    def _expected(self, context, request, _options) -> float | None:
        """Seconds that it is likely to take."""
        expected = forecast_of(context.scene, context.view_layer, request)
        return expected.seconds if expected is not None else None

    def _remember(self, context, seconds: float) -> None:
        remember(context.scene, context.view_layer, self._request, seconds)

    def _work(self):
        away = time.perf_counter() - self._worked
        self._bake.step(min(max(away, SHORTEST_SLICE), LONGEST_SLICE))
        self._worked = time.perf_counter()

    def _ended(self, context, bake: session.RunningBake) -> set[str]:
        outcome = bake.outcome
        if outcome.status == session.DONE:
            latest_kept.keep(self._kept, context.scene)
            follow_mixture(context.scene)
            if not bake.stopped:
                self._remember(context, outcome.report.seconds["total"])
        elif self._live:
            self._unshow()
        if outcome.status != session.DONE:
            self.report({"ERROR" if outcome.status == session.FAILED else "INFO"}, escaped(outcome.message))
            return {"CANCELLED"}
        for warning in outcome.report.warnings:
            self.report({"WARNING"}, escaped(warning))
        self.report({"INFO"}, escaped(outcome.message))
        return {"FINISHED"}

    def _show_progress(self, context):
        progress = self._bake.progress
        self._drawn, self._phase = time.perf_counter(), progress.phase
        _set_status(self._workspace, f"DETP bake: {progress.phase}, {self._bake.fraction:.0%}   |   Esc: Cancel")
        redraw_panels(context)

    def _close(self, context):
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        _set_status(self._workspace, None)
        redraw_panels(context)


class DETP_OT_bake(BakeOptions, BakeRunner, bpy.types.Operator):
    """Bake the light of the whole scene into the meshes' colour attributes"""

    bl_idname = "detp.bake"
    bl_label = "Bake Vertex Light"


class DETP_OT_cancel(bpy.types.Operator):
    """Stop the bake and leave everything as it was"""

    bl_idname = "detp.cancel"
    bl_label = "Cancel Bake"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context):
        """Only while a bake runs."""
        return session.running() is not None

    def execute(self, _context):
        """The bake operator sees it on its next tick."""
        session.running().cancel()
        return {"FINISHED"}


class DETP_OT_stop(bpy.types.Operator):
    """End the bake now and keep the light it has found so far"""

    bl_idname = "detp.stop"
    bl_label = "Stop and Keep"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context):
        """Once there is light to keep."""
        bake = session.running()
        return bake is not None and bake.progress.error is not None

    def invoke(self, context, event):
        """Ask first where better light would be lost."""
        bake = session.running()
        if not bake.worse:
            return self.execute(context)
        there, found = percent(bake.standing), percent(bake.progress.error)
        message = f"The light that is there is off by {there}, what was found so far by {found}."
        return context.window_manager.invoke_confirm(self, event, title="Keep Worse Light?", message=message)

    def execute(self, _context):
        """The bake operator sees it on its next tick."""
        if session.running() is not None:  # it may have ended while it was asked
            session.running().stop()
        return {"FINISHED"}


class DETP_OT_copy_report(bpy.types.Operator):
    """Copy the whole report of the last bake to the clipboard, with all warnings"""

    bl_idname = "detp.copy_report"
    bl_label = "Copy Report"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context):
        """Only after a finished bake."""
        return session.report() is not None

    def execute(self, context):
        """The same lines as the command line prints."""
        report = session.report()
        context.window_manager.clipboard = "\n".join([report.headline(), *report.details()]) + "\n"
        return {"FINISHED"}


class _OnWrongFaces:
    """What works on the faces that the last bake named."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, _context):
        """After a bake that named some, and while none runs."""
        report = session.report()
        return report is not None and bool(len(report.lossy_faces.faces))


class DETP_OT_select_faces(_OnWrongFaces, bpy.types.Operator):
    """Select the faces that the report names: those that show most of their light wrong between their vertices"""

    bl_idname = "detp.select_faces"
    bl_label = "Select Faces"

    def execute(self, context):
        """And their objects, of which the last becomes the active one."""
        count = select_faces(session.report().lossy_faces.wrong, context)
        self.report({"INFO"}, f"Selected {counted(count, 'face')}.")
        return {"FINISHED"}


class DETP_OT_divide_faces(_OnWrongFaces, bpy.types.Operator):
    """Divide the faces whose vertices cannot show their light; bake again to see what it brings"""

    bl_idname = "detp.divide_faces"
    bl_label = "Subdivide Where Light Changes"

    def execute(self, _context):
        """The faces get other numbers, so the bake is forgotten."""
        lossy = session.report().lossy_faces
        faces, objects, _ = divide_faces(lossy, most_vertices(lossy))
        session.forget()
        self.report({"INFO"}, f"Divided {counted(faces, 'face')} of {counted(objects, 'object')}: bake again.")
        return {"FINISHED"}


def _set_status(workspace: str, text: str | None) -> None:
    found = bpy.data.workspaces.get(workspace)
    if found is not None:
        found.status_text_set(text)


CLASSES = (
    DETP_OT_bake, DETP_OT_cancel, DETP_OT_stop, DETP_OT_copy_report, DETP_OT_select_faces, DETP_OT_divide_faces,
)  # fmt: skip
