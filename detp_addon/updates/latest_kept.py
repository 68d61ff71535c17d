"""The one bake that is kept for updates: the latest, since each may take much memory."""

from __future__ import annotations

import bpy

from .kept_bake import KeptBake

_latest: KeptBake | None = None


def kept_of(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> KeptBake | None:
    """What is kept of ``scene`` as ``view_layer`` shows it."""
    return _latest if _latest is not None and _latest.of(scene, view_layer) else None


def begin(kept: KeptBake | None) -> None:
    """A bake begins: what was kept of an earlier one is dropped, unless it updates that."""
    if kept is not _latest:
        forget()


def keep(kept: KeptBake | None) -> None:
    """A bake is done: keep of it what can be updated."""
    global _latest
    _latest = kept or None


def forget() -> None:
    """Keep nothing."""
    global _latest
    _latest = None
