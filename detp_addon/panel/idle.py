"""What the operators and panels of bakes have in common: waiting for the end of one, and being drawn anew."""

from ...core.errors import DetpError
from ..command.terminal import escaped
from . import session


class Idle:
    """An operator that works while no bake runs, and says why it could not: what it does is its ``_act``."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Only one bake at a time."""
        if session.running():
            cls.poll_message_set("A bake is running: wait for it, or cancel it")
            return False
        return context.scene is not None

    def execute(self, context):
        """Act; what a user can mend is reported."""
        try:
            self._act(context)
        except DetpError as error:
            return self.refused(error)
        return {"FINISHED"}

    def refused(self, error: DetpError) -> set[str]:
        """Report what a user can mend; the operator's answer."""
        self.report({"ERROR"}, escaped(str(error)))
        return {"CANCELLED"}


def redraw_panels(context) -> None:
    """Draw the panels anew, since what a bake says has changed."""
    for area in (area for window in context.window_manager.windows for area in window.screen.areas):
        for region in area.regions:
            if (area.type, region.type) in (("VIEW_3D", "UI"), ("PROPERTIES", "WINDOW")):
                region.tag_redraw()
