"""What a bake did: as JSON for programs and as a few lines for people."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass, field, fields

from .wording import counted, percent
from .writing.lossy_faces import LossyFaces

#: words for the phases' seconds, in the order of the report
STAGES = ("export", "shadow", "trace", "gather", "write")


@dataclass(frozen=True)
class Brightness:
    """The ``scale`` by which the light was multiplied, and how many of all ``colours`` are ``above`` 1 after that."""

    scale: float = 1.0
    above: int = 0
    colours: int = 0

    @property
    def stops(self) -> float:
        """The exposure that ``scale`` is."""
        return math.log2(self.scale)

    def sentence(self) -> str:
        """One line for people: the exposure, and how much of the light is above 1; "" when there is nothing to say."""
        exposed = f"Exposed by {self.stops:+.2f} stops" if self.scale != 1.0 else ""
        if not self.above:
            return f"{exposed}: no colour is above 1." if exposed else ""
        share = percent(self.above / self.colours)
        above = f"{counted(self.above, 'colour')} ({share}) are above 1, where many formats and engines cut"
        return f"{exposed}: {above}." if exposed else f"{above}: choose an exposure, or let it fit."


@dataclass(frozen=True)
class BakeReport:
    """What one bake did.

    scene           the scene's file, or its name in Blender
    objects         written; ``points`` estimated for them, from ``triangles`` and ``lights``
    filled          elements that no estimation point could serve, filled from their neighbours
    photons, segments   traced, and ``shadow_rays`` cast
    radius          of the tangent discs, metres as the scene's units have them
    gatherer        that found the crossings, and ``gatherer_reason`` for its choice
    seconds         of each of STAGES, and their total
    relative_error  estimated: the share by which half of the lit points are off at most; NaN when all are dark
    high_error      the same for nine tenths of the points, beside the light that is usual where they are next to dark
    brightness      by what the light was multiplied, and how many colours are above 1
    lossy_faces     those that show light wrong between their vertices
    frames          that were baked, none when the light was baked for one moment
    light_groups    that were baked apart, none when all light was baked together
    modelled        features of the scene that were found and needed; ``left_out`` those that were not honoured
    updated         whether it is an update of an earlier bake, whose photons, rays and radius these are
    warnings        one sentence each
    output          the file written, or None inside Blender
    blender_scene, view_layer   the names of what was baked
    """

    scene: str
    objects: int
    points: int
    filled: int
    triangles: int
    lights: int
    photons: int
    shadow_rays: int
    segments: int
    radius: float
    gatherer: str
    gatherer_reason: str
    seconds: dict[str, float]
    relative_error: float
    high_error: float = math.nan
    brightness: Brightness = field(default_factory=Brightness)
    lossy_faces: LossyFaces = field(default_factory=LossyFaces)
    frames: tuple[int, ...] = ()
    light_groups: tuple[str, ...] = ()
    modelled: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    updated: bool = False
    warnings: tuple[str, ...] = ()
    output: str | None = field(default=None)
    blender_scene: str = ""
    view_layer: str = ""

    def as_json(self) -> dict:
        """The report as values that JSON knows; an error that does not exist becomes null."""
        entry = {each.name: getattr(self, each.name) for each in fields(self)}
        lossy, brightness = entry.pop("lossy_faces"), entry.pop("brightness")
        entry |= {"scale": brightness.scale, "colours": brightness.colours, "above_one": brightness.above}
        entry["faces_lost"] = lossy.whole
        entry["wrong_faces"] = {name: len(faces) for (name, _), faces in lossy.wrong.items()}
        order = ("scene", "output", *(name for name in entry if name not in ("scene", "output")))
        for name in ("relative_error", "high_error", "faces_lost"):
            if not math.isfinite(entry[name]):
                entry[name] = None
        return {name: entry[name] for name in order}

    def headline(self) -> str:
        """One line for people: what was baked, in what time, how well."""
        error = percent(self.relative_error) if math.isfinite(self.relative_error) else "unknown"
        if math.isfinite(self.high_error):
            error += f", nine tenths of the points within {percent(self.high_error)}"
        done, frames = "Updated" if self.updated else "Baked", ","
        if self.frames:
            each = self.seconds["total"] / len(self.frames)
            frames = f" at {len(self.frames)} frames from {self.frames[0]} to {self.frames[-1]}, {each:.2g} s each,"
        search = f" (radius {self.radius:.3g} m, {self.gatherer})" if self.photons else ""
        return (
            f"{done} {counted(self.objects, 'object')}{frames} {counted(self.points, 'point')} with "
            f"{counted(self.photons, 'photon')} in {self.seconds['total']:.1f} s; median error {error}{search}."
        )

    def faces(self) -> str:
        """One line for people: what faces show wrong between their vertices."""
        line = f"Faces show {percent(self.lossy_faces.whole)} of their light wrong between their vertices"
        wrong = self.lossy_faces.wrong
        if not wrong:
            return line + "."
        many = counted(sum(map(len, wrong.values())), "face")
        return f"{line}; {many} of {counted(len(wrong), 'object')} by more than {100 * self.lossy_faces.limit:.0f} %."

    def details(self) -> list[str]:
        """Lines for people after the headline: what was modelled, what was left out, what to look at."""
        listed = ("Light groups", self.light_groups), ("Modelled", self.modelled), ("Left out", self.left_out)
        lines = [f"{what}: {', '.join(names)}." for what, names in listed if names]
        if math.isfinite(self.lossy_faces.whole):
            lines.append(self.faces())
        if self.brightness.sentence():
            lines.append(self.brightness.sentence())
        if self.filled:
            lines.append(f"Filled from neighbours: {counted(self.filled, 'element')}.")
        return lines + [f"Warning: {warning}" for warning in self.warnings]


def to_json(entries: list[dict]) -> str:
    """The report file's text: a list with one entry per scene; a scene that failed has an ``error``."""
    text = json.dumps(entries, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    # What would steer a terminal that shows the file, and halves of characters from names that are not UTF-8.
    return re.sub("[\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]", lambda found: f"\\u{ord(found[0]):04x}", text)
