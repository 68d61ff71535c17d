"""The points whose light the targets need, and the values that their light becomes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.estimator.enclosure import unlit
from ..core.fit.vertex_fit import VertexFit
from ..core.result import BakeResult
from .chosen_objects import objects_by_name
from .reading.read_scene import BakeTarget, ExportedScene
from .writing.lossy_faces import LossyFaces
from .writing.write_attributes import corner_faces


@dataclass(frozen=True)
class BakedPoints:
    """The points whose light gives the colours of some targets.

    centres, normals, facing, inward   (N, 3) as the core's bake takes them
    covered                    (N,) whether another face lies against that of the point
    shown                      (N,) the value, or one of those, that shows the light of the point
    fit                        makes the colours' values of their light; None where each point is a value
    triangles                  (T,) of the faces as read, that it fits
    """

    centres: np.ndarray
    normals: np.ndarray
    facing: np.ndarray
    inward: np.ndarray
    covered: np.ndarray
    shown: np.ndarray
    fit: VertexFit | None
    triangles: np.ndarray


@dataclass(frozen=True)
class LightValues:
    """What colours are made of: irradiance (U, 3), direct (U, 3) and indirect (U, 3), and whether (U,) it is known.

    ``open`` (N,) says how much each point counts.
    """

    irradiance: np.ndarray
    direct: np.ndarray
    indirect: np.ndarray
    known: np.ndarray
    open: np.ndarray

    def __add__(self, other: LightValues) -> LightValues:
        """The light of two groups of sources, at the same points."""
        sums = (getattr(self, part) + getattr(other, part) for part in ("irradiance", "direct", "indirect"))
        return LightValues(*sums, self.known & other.known, self.open)


def points_of(targets: list[BakeTarget], export: ExportedScene) -> tuple[list[BakeTarget], BakedPoints]:
    """The points that ``targets`` need, and the targets with rows counted among their values."""
    shown = export.shown
    used = np.zeros((len(export.centres) if shown is None else shown.faces.count) + 1, bool)
    for target in targets:
        used[target.point_rows] = True
    used = used[:-1]
    renumbered = np.append(np.where(used, np.cumsum(used) - 1, -1), -1)
    moved = [replace(target, point_rows=renumbered[target.point_rows]) for target in targets]
    rows, fit, kept = np.flatnonzero(used), None, np.zeros(0, np.int64)
    numbers = np.arange(len(rows))
    if shown is not None:
        # A large scene is not to be there twice, only because none of it is left away.
        faces, places, kept = shown.faces, shown.places, np.arange(len(shown.faces.values))
        rows = np.arange(len(places.triangle))
        if not used.all():
            faces, kept = faces.of_values(used)
            places, rows = places.on(kept)
        fit, numbers = VertexFit(faces, places), faces.values[places.triangle, 0]
    given = export.centres, export.normals, export.facing, export.inward, export.covered
    if len(rows) < len(export.centres):
        given = (part[rows] for part in given)
    return moved, BakedPoints(*given, numbers, fit, kept)


def values_of(points: BakedPoints, result: BakeResult, whole: BakeResult | None = None) -> LightValues:
    """The values that ``result`` gives the colours; it may be a part of the ``whole`` light."""
    whole = whole or result
    # A covered face that is dark belongs to things that touch; one that has light stands back to back with another.
    hidden = whole.hidden | (points.covered & unlit(whole.irradiance))
    if points.fit is None:
        return LightValues(result.irradiance, result.direct.value, result.indirect.value, ~hidden, result.open)
    seen = np.where(hidden, 0.0, result.open)
    fitted = result.settled
    if fitted is None or not np.array_equal(hidden, result.hidden):
        fitted = points.fit.fitted(result.light, seen, result.direct)
    value, part = fitted.value, fitted.part
    return LightValues(value, part, value - part, fitted.known, seen)


def lossy_faces(export: ExportedScene, points: BakedPoints, values: LightValues, result: BakeResult) -> LossyFaces:
    """The faces that show light wrong with these ``values``."""
    if points.fit is None:
        return LossyFaces()
    owner, face = export.shown.owners[points.triangles], export.shown.corners[points.triangles]
    # Triangles stand in the order of their objects.
    objects, ends = objects_by_name(), np.searchsorted(owner, np.arange(len(export.targets) + 1))
    for number, target in enumerate(export.targets):
        mine, obj = slice(ends[number], ends[number + 1]), objects.get((target.object_name, target.library))
        if obj is not None and len(obj.data.loops) == len(target.point_rows):
            face[mine] = corner_faces(obj.data)[face[mine]]
    width = int(face.max(initial=-1)) + 1
    numbers, number = np.unique(owner * width + face, return_inverse=True)
    losses = points.fit.losses(values.irradiance, result.light, values.open, number)
    names = [(target.object_name, target.library) for target in export.targets]
    return LossyFaces.of(names, *np.divmod(numbers, max(width, 1)), losses)


def known_rows(target: BakeTarget, known: np.ndarray) -> np.ndarray:
    """The target's rows (C,) of values that are ``known`` (U,), -1 where none is, so that neighbours fill it."""
    rows = target.point_rows
    return np.where((rows >= 0) & np.append(known, False)[rows], rows, -1)
