"""The light of an animation's frames, as they are baked one after the other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...core.errors import NoMeshError
from ..chosen_objects import name_of, objects_by_name
from ..found_light import FoundLight
from ..wording import counted, some
from ..writing.write_attributes import MeshColours

#: an object by its name and library, since references do not survive an undo
Key = tuple[str, str | None]


@dataclass
class BakedFrames:
    """What frames have brought: rgb (M, 3) of each by object, None where it was not there; and what is to be said.

    Those that are ``still`` have light of their own at the first frame alone. ``whole`` counts the frames that were no
    updates, by the reason.
    """

    attribute: str
    colours: dict[Key, list[np.ndarray | None]] = field(default_factory=dict)
    rendered: dict[Key, set] = field(default_factory=dict)
    warnings: dict[str, None] = field(default_factory=dict)
    error: float = 0.0
    count: int = 0
    scale: float | None = None
    dark: set[int] = field(default_factory=set)
    still: set[Key] = field(default_factory=set)
    whole: Counter[str] = field(default_factory=Counter)

    def take(self, found: FoundLight, colours: Sequence[MeshColours], warnings: Sequence[str]) -> None:
        """Add a frame."""
        for entry in colours:
            key = name_of(entry.object)
            before = self.colours.setdefault(key, [None] * self.count)
            before.append(first_layer(entry).astype(np.float32))
        for target in found.targets:
            self.rendered.setdefault((target.object_name, target.library), set()).add(target.rendered)
        self.count += 1
        for values in self.colours.values():
            values += [None] * (self.count - len(values))
        self.warnings |= dict.fromkeys((*found.export.warnings, *found.refusals, *warnings))
        self.scale = self.scale or found.scales[0]

    def skip(self, dark: bool = False) -> None:
        """Add a frame without any of the objects, or one in which all is ``dark``."""
        self.dark |= {self.count} if dark else set()
        self.count += 1
        for values in self.colours.values():
            values.append(None)

    def whole_frames(self) -> list[str]:
        """A sentence for each of the reasons."""
        all_frames = counted(self.count, "frame")
        return [
            f"Of {all_frames} {count} {'was' if count == 1 else 'were'} baked as a whole, since {reason}."
            for reason, count in self.whole.items()
        ]

    def refuse_changing(self) -> list[str]:
        """Drop the objects whose faces come and go, and return a sentence on them."""
        changing = [key for key, sizes in self.rendered.items() if len(sizes) > 1]
        for key in changing:
            self.colours.pop(key, None)
        if not changing:
            return []
        names = [name for name, _ in changing]
        return [f"The faces of {some(names)} change over the frames, so {'it' if len(names) == 1 else 'they'} cannot "
                f"play light: bake a frame of them alone, or let only their vertices move."]  # fmt: skip

    def entries(self) -> tuple[list[MeshColours], dict[bpy.types.Object, np.ndarray]]:
        """The colours of each object at the first frame, and of those that are not still the rgb (K, M, 3) of all.

        Where an object was not there, it has the light of the frame before, or of the first in which it was.
        They go from here, since all frames of all objects are much. Raises NoMeshError without any object.
        """
        entries, moved, objects = [], {}, objects_by_name()
        for key in list(self.colours):
            frames = self.colours.pop(key)
            obj, known = objects.get(key), [rgb for rgb in frames if rgb is not None]
            if obj is None or any(len(rgb) != len(known[0]) for rgb in known):
                self.warnings[f"'{key[0]}' was changed during the bake, so its colours were not written."] = None
                continue
            first = np.zeros_like(known[0]) if 0 in self.dark and key not in self.still else known[0]
            entries.append(MeshColours(obj, {self.attribute: first}))
            if key not in self.still:
                last, filled = known[0], []
                for number, rgb in enumerate(frames):
                    last = last if rgb is None else rgb
                    filled.append(np.zeros_like(last) if number in self.dark else last)
                moved[obj] = np.stack(filled)
        if not entries:
            raise NoMeshError("Every object was changed during the bake, so no colours were written: bake again.")
        return entries, moved


def first_layer(entry: MeshColours) -> np.ndarray:
    """The rgb (M, 3) of the first layer, the only one that an animation has."""
    return next(iter(entry.layers.values()))
