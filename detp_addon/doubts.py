"""What in the result itself a user should know."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.direct.lit_behind import lit_behind
from ..core.estimator.enclosure import unlit
from ..core.result import BakeResult
from ..core.scene import Scene
from ..core.settings import BakeSettings
from .causes import turned_away, why_dark
from .reading.read_scene import BakeTarget
from .values import BakedPoints
from .wording import counted, percent

#: objects with dark faces, and points of each, whose backs are looked at; what counts as lit, of what is usual
MOST_DARK, DARK_POINTS, LIT_BEHIND = 64, 16, 0.1

#: shares of an object's points that count as some of its faces, and as all
LEAST_DARK, ALL_OVER = 0.05, 0.95

#: share of the emitted flux that the bounce limit may cut without a warning
HARMLESS_CUT = 0.01


def doubts_of(
    result: BakeResult, settings: BakeSettings, stopped: bool, scene: bpy.types.Scene, surfaces: Scene
) -> list[str]:
    """What in the result itself the user should know."""
    doubts = []
    aim = settings.aimed_noise
    # Points that are known exactly hide no others.
    short = aim is not None and result.ending_error > aim * (1 + 1e-9)
    if stopped:
        doubts.append("The bake was stopped before its end, and what it had found was kept.")
    elif short:
        if settings.seconds is not None:
            remedy = "allow more time"
        elif settings.photons is not None:
            remedy = "allow more photons"
        else:
            remedy = "ask for it by its number, to bake on" if settings.error is None else "allow a larger radius"
        doubts.append(
            f"The error of {percent(settings.target_error)} that was aimed at was not reached with "
            f"{counted(result.photons, 'photon')}: {remedy}, or choose a larger error."
        )
    if result.coarse.any():
        doubts.append(
            f"{counted(int(result.coarse.sum()), 'point')} of {len(result.coarse)} lie on faces so small, and so far "
            f"from most of what is baked, that rounding tells in their light: bake them alone, or move them nearer."
        )
    if not result.irradiance.any():
        doubts.append(why_dark(scene, surfaces.corners, result.photons))
    emitted = np.abs(result.emitted_flux).sum()
    cut = np.abs(result.cut_flux).sum()
    if cut > HARMLESS_CUT * emitted:
        doubts.append(
            f"The limit on bounces cut off light worth {percent(cut / emitted)} of what the lights emit: "
            f"allow more bounces, or use darker materials where the albedo is close to 1."
        )
    return doubts


def dark_in_front(targets: list[BakeTarget], scene: Scene, points: BakedPoints, result: BakeResult) -> list[str]:
    """A sentence on the objects whose faces are dark, all or some, but lit on their backs; none without any."""
    dark = unlit(result.irradiance)
    if dark.all():
        return []
    owners = np.full(max((target.point_rows.max(initial=-1) for target in targets), default=-1) + 2, -1)
    for number, target in enumerate(targets):
        owners[target.point_rows] = number
    owners = owners[:-1][points.shown]
    # A face that lies against another has its light on that one's side.
    rows = np.flatnonzero(dark & ~points.covered & (owners >= 0))
    counts = np.bincount(owners[rows], minlength=len(targets))
    shares = counts / np.maximum(np.bincount(owners[owners >= 0], minlength=len(targets)), 1)
    darkest = np.argsort(-shares, kind="stable")[:MOST_DARK]
    darkest = darkest[shares[darkest] >= LEAST_DARK]
    if not len(darkest):
        return []
    groups = np.split(rows[np.argsort(owners[rows], kind="stable")], np.cumsum(counts)[:-1])
    asked = [groups[number][:: -(-counts[number] // DARK_POINTS)] for number in darkest]
    every, usual = np.concatenate(asked), np.median(np.abs(result.irradiance[~dark]).sum(axis=1))
    places = (part[every] for part in (points.centres, points.normals, points.facing, points.inward))
    lit = np.split(lit_behind(scene, *places) > LIT_BEHIND * usual, np.cumsum([len(own) for own in asked])[:-1])
    share_lit = np.array([part.mean() for part in lit])
    turned = darkest[shares[darkest] * share_lit >= LEAST_DARK]
    all_over, names = shares[turned] >= ALL_OVER, np.array([targets[number].object_name for number in turned], object)
    return [turned_away(list(names[all_over]), list(names[~all_over]))] if len(turned) else []
