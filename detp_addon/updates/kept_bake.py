"""A bake of a scene with all that it takes to update it, light group by light group."""

from __future__ import annotations

import gc
from collections.abc import Generator
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

import bpy

from ...core.bake import bake, during
from ...core.cluster.crew import Crew
from ...core.errors import InvalidSettingError, NotUpdatableError, OutOfMemoryError
from ...core.fit.vertex_fit import VertexFit
from ...core.memory import check_baking, free_bytes
from ...core.points import Points
from ...core.result import BakeResult, Progress
from ...core.scene import Scene
from ...core.settings import BakeSettings
from ...core.update.session import LIMIT, BakeSession
from ..chosen_objects import targets_in
from ..mixing.light_groups import MOST_GROUPS
from ..reading.kept_places import KeptPlaces
from ..reading.read_scene import ExportedScene
from ..reading.recalled import Recollection
from ..request import BakeRequest
from .kept_file import KeptParts, new_identity, read_kept

#: of the memory that is free before a bake, light paths that are kept may take this share
SHARE = 0.25

#: light that is not parted by groups
ALL = ""


class KeptBake:
    """What ``request`` asks for in ``scene`` as ``view_layer`` shows it, baked and kept, and then updated.

    It is to be written beside the .blend if ``on_disk``. If it ``looks`` around for updates at the end of a bake, the
    first of them need not. ``refused`` says why what was kept for it before is of no use; ``parts`` are what was kept
    for it before and is.

    Attributes: ``places`` on faces; ``recollection`` of what reading the scene has found; ``identity``, another one
    whenever other bakes are kept; ``updated``, whether the last run had no need to bake anything as a whole;
    ``reasons`` why it had, and why nothing could be kept, as clauses, and ``notes``, the same in sentences.
    """

    def __init__(
        self,
        scene: bpy.types.Scene,
        view_layer: bpy.types.ViewLayer,
        request: BakeRequest,
        on_disk: bool = False,
        refused: str = "",
        parts: KeptParts | None = None,
        looks: bool = False,
    ):
        self._scene, self._view_layer = scene.name, view_layer.name
        self._request, self._whole = request, True
        kept = {} if parts is None else dict(zip(parts.groups, parts.bakes, strict=True))
        self._sessions = {group: BakeSession.of(first) for group, first in kept.items()}
        self.places: KeptPlaces | None = None if parts is None else parts.places
        self._read_places = self.places
        self.recollection = Recollection()
        self.on_disk, self._refused, self._looks = on_disk, refused, looks
        self.identity = new_identity()
        self._begin()

    @classmethod
    def in_file(cls, path: Path, identity: str, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> KeptBake:
        """The one of that ``identity`` in the file ``path``, of ``scene`` as ``view_layer`` shows it.

        Raises NotUpdatableError, which says why it is of no use.
        """
        parts = read_kept(path, identity)
        if (parts.scene, parts.view_layer) != (scene.name, view_layer.name):
            raise NotUpdatableError(f"'{path.name}' was kept of another scene or view layer")
        kept = cls(scene, view_layer, parts.request, True, parts=parts)
        kept.identity = identity
        return kept

    @property
    def parts(self) -> KeptParts:
        """All of it, to be written."""
        bakes = tuple(session.kept for session in self._sessions.values())
        return KeptParts(self._scene, self._view_layer, self._request, self.places, tuple(self._sessions), bakes)

    def _begin(self) -> None:
        self._updating = self.updated = bool(self._sessions)
        self.notes, self.reasons = [], []

    def __bool__(self) -> bool:
        """Whether there is something to update."""
        return bool(self._sessions)

    def of(self, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> bool:
        """Whether it is of ``scene`` as ``view_layer`` shows it."""
        return (scene.name, view_layer.name) == (self._scene, self._view_layer)

    def request(self, scene: bpy.types.Scene, whole: bool = True) -> BakeRequest:
        """What is to be baked of ``scene`` as it is now: what was baked, as far as it is still there.

        Without ``whole``, light that cannot be updated is not baked as a whole: NotUpdatableError. An update is made
        then even where it takes as long.
        """
        self._whole = whole
        return replace(self._request, targets=targets_in(scene, self._request.targets))

    def read(self, export: ExportedScene, points: int) -> None:
        """Make ready for ``points`` of the scene as it was read now.

        Raises OutOfMemoryError when they cannot be baked even if nothing more is kept of earlier.
        """
        self._begin()
        if self._refused:
            self._anew(self._refused)
            self._refused = ""
        if self._request.targets == "selected":
            self._request = replace(self._request, targets=tuple(target.object_name for target in export.targets))
        if export.shown is not None:
            names = [(target.object_name, target.library) for target in export.targets]
            self._read_places = KeptPlaces.of(names, export.shown)
        held = [self.recollection.forget]
        if self._sessions and self._whole:
            held.append(self._drop)
        while True:
            try:
                return check_baking(len(export.scene.triangles), points)
            except OutOfMemoryError:
                if not held:
                    raise
            held.pop(0)()
            gc.collect()

    def _drop(self) -> None:
        self._sessions.clear()
        self._updating = False
        self._anew("memory ran short, and what was kept is gone")

    def bake(
        self,
        group: str,
        surfaces: Scene,
        points: Points,
        settings: BakeSettings,
        fit: VertexFit | None,
        hired: AbstractContextManager[Crew | None],
    ) -> Generator[Progress, None, BakeResult]:
        """The steps of an update of the light of that ``group``, or of a whole bake where there can be none.

        A crew is ``hired`` for a whole bake only.
        """
        session = self._sessions.get(group)
        if session is not None:
            try:
                return (yield from session.update(surfaces, points, fit, dear=not self._whole))
            except NotUpdatableError as error:
                if not self._whole:
                    raise
                self._anew(error.reason, group)
        elif self._updating:
            self._anew("it was not kept before", group)
        if not self._whole:
            raise NotUpdatableError("there is light that was not baked before")
        self.updated, free = False, free_bytes()
        settings = self._unlike_others(group, settings)
        limit = LIMIT if free is None else min(LIMIT, int(SHARE * free))
        with hired as crew:
            try:
                session = BakeSession(surfaces, points, settings, limit)
            except (InvalidSettingError, NotUpdatableError) as error:
                self._not_kept(error, group)
                return (yield from bake(surfaces, points, settings, fit, crew))
            result = yield from session.bake(fit, crew)
        try:
            first = session.kept
        except NotUpdatableError as error:
            self._not_kept(error, group)
        else:
            if self._looks:
                yield from during("Looking around for updates", 0.99, first.look())
            # Not before: who cancels a bake can still update the one before it.
            self._sessions[group] = session
            self.identity = new_identity()
            self.places = self._read_places
        return result

    def _unlike_others(self, group: str, settings: BakeSettings) -> BakeSettings:
        """The ``settings`` with a seed that no other group has: noise of groups is to be independent."""
        others = {session.settings.seed for name, session in self._sessions.items() if name != group}
        while settings.seed in others:
            settings = replace(settings, seed=settings.seed + (MOST_GROUPS << 32))
        return settings

    def _anew(self, reason: str, group: str = ALL) -> None:
        whose = f"The light of '{group}'" if group else "All light"
        self.notes.append(f"{whose} was baked anew, since {reason}.")
        self.reasons.append(reason)

    def _not_kept(self, error: Exception, group: str) -> None:
        self._sessions.pop(group, None)
        reason = error.reason if isinstance(error, NotUpdatableError) else str(error)[0].lower() + str(error)[1:-1]
        if not any(reason in note for note in self.notes):
            self.notes.append(f"This bake cannot be updated, since {reason}.")
            self.reasons.append(reason)
