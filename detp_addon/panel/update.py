"""The panel's Update: what changed since the bake is found anew, and the rest stays."""

import bpy

from ...core.errors import NotUpdatableError
from ..job import bake_scene
from ..request import BakeRequest
from ..updates.kept_bake import KeptBake
from ..updates.latest_kept import kept_of, read_again
from .operators import BakeRunner
from .properties import scene_options


class DETP_OT_update(BakeRunner, bpy.types.Operator):
    """Find the light anew where the scene has changed since its bake, into the same attributes. Where nothing is kept
    of the bake, or all light is another, this is a bake of the whole scene, and that is said"""

    bl_idname = "detp.update"
    bl_label = "Update Vertex Light"

    def _wants_live(self, context) -> bool:
        # An update shows its light at the end alone.
        return kept_of(context.scene, context.view_layer) is None and context.scene.detp.live

    def _options(self, context) -> dict:
        return {}

    def _asked(self, context, _options) -> BakeRequest:
        given, refused = (context.scene, context.view_layer), ""
        self._kept = kept_of(*given)
        if self._kept is None:
            try:
                self._kept = read_again(*given)
            except NotUpdatableError as error:
                refused = error.reason
        if self._kept is not None:
            return self._kept.request(context.scene)
        options = scene_options(context.scene.detp)
        request = super()._asked(context, options)
        self._kept = KeptBake(*given, request, options["keep_on_disk"], refused, looks=True)
        return request

    def _steps(self, context, request, _options, live):
        return bake_scene(context.scene, context.view_layer, request, live, kept=self._kept)

    def _expected(self, context, request, options) -> float | None:
        return None if self._kept else super()._expected(context, request, options)

    def _remember(self, _context, _seconds) -> None:
        """What an update took says little of a bake."""


CLASSES = (DETP_OT_update,)
