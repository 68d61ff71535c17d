"""What the operators have in common that wait for the end of a bake."""

from ...core.errors import DetpError
from ..command.terminal import escaped
from . import session


class Idle:
    """Works while no bake runs, and says why it could not."""

    @classmethod
    def poll(cls, context):
        """Only one bake at a time."""
        if session.running():
            cls.poll_message_set("A bake is running: wait for it, or cancel it")
            return False
        return context.scene is not None

    def refused(self, error: DetpError) -> set[str]:
        """Report what a user can mend; the operator's answer."""
        self.report({"ERROR"}, escaped(str(error)))
        return {"CANCELLED"}
