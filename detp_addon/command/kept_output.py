"""What the command keeps beside its outputs, so that its next run of a file finds anew only what changed."""

from __future__ import annotations

import hashlib
import json

import bpy

from ...core.errors import NotUpdatableError
from ..request import BakeRequest
from ..updates.kept_bake import KeptBake
from ..updates.kept_file import file_beside, note_kept, write_kept
from .jobs import SceneJob, light_options


class KeptOutput:
    """The kept bake beside the output of a ``job``, as far as ``options`` ask for one.

    It belongs to a scene file of that name and to these options.
    """

    def __init__(self, job: SceneJob, options: dict):
        self._path, self._wanted = file_beside(str(job.output)), options["keep"]
        told = json.dumps([job.scene.name, light_options(options)], sort_keys=True)
        self._identity = hashlib.sha256(told.encode()).hexdigest()[:32]
        self._kept: KeptBake | None = None

    def of(self, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, request: BakeRequest) -> KeptBake | None:
        """What is kept of ``scene``, or is to be kept of it; None where nothing shall be."""
        if not self._wanted:
            return None
        refused = ""
        try:
            if self._path.exists():
                self._kept = KeptBake.in_file(self._path, self._identity, scene, view_layer)
                return self._kept
        except NotUpdatableError as error:
            refused = error.reason
        self._kept = KeptBake(scene, view_layer, request, True, refused)
        return self._kept

    def mark(self, scene: bpy.types.Scene) -> None:
        """Note in ``scene``, before it is saved, whether it has a kept bake, for Update in Blender."""
        note_kept(scene, self._identity if self._kept else None)

    def write(self) -> str | None:
        """Write what is kept, unless it is there already; a line that says so. Raises as :func:`.write_kept`."""
        if not self._kept or self._kept.identity == self._identity:
            return None
        size = write_kept(self._path, self._kept.parts, self._identity)
        return f"Kept {self._path}, {size / 1e6:.0f} MB"
