"""Shows a bake's colours in the viewport while it goes on, and takes them back without a trace."""

from __future__ import annotations

import time
from contextlib import ExitStack, suppress

import bpy

from ..reading.edit_mode import leave_edit_mode
from .write_attributes import MeshColours, write_layers

#: Showing takes at most this share of the time.
SHARE = 0.1


class LiveColours:
    """Preliminary colours on the meshes of a bake; leaving the context puts back what was there before.

    domain  of the colours
    shown   the name of the attribute that viewport and render show meanwhile; None to leave their choice as it is
    """

    def __init__(self, domain: str, shown: str | None):
        self._domain, self._shown = domain, shown
        self._undo = ExitStack()
        self._objects: set[bpy.types.Object] = set()
        self._rest_until = 0.0

    def __enter__(self) -> LiveColours:
        return self

    @property
    def due(self) -> bool:
        """Whether enough time has passed since the last picture."""
        return time.perf_counter() >= self._rest_until

    def show(self, colours: list[MeshColours], begin: float) -> None:
        """Write ``colours``, whose making began at ``begin`` (of time.perf_counter).

        Meshes with several users are left out: each user has light of its own.
        """
        for entry in colours:
            if entry.object.data.users > 1:
                continue
            if entry.object not in self._objects:
                self._objects.add(entry.object)
                write_layers(entry, self._domain, self._shown, self._undo)
            else:
                with ExitStack() as unused:
                    write_layers(entry, self._domain, self._shown, unused)
                    unused.pop_all()
            entry.object.data.update()
        now = time.perf_counter()
        self._rest_until = now + (now - begin) * (1.0 / SHARE - 1.0)

    def __exit__(self, *_) -> None:
        """Put back all that was there before the first picture, on what still exists."""
        with suppress(ReferenceError):
            leave_edit_mode(self._objects)
        with suppress(ReferenceError, KeyError):
            self._undo.close()
        self._objects = set()
