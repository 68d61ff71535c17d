"""Distant lights in parts: what passes through a small box in which light is wanted, and through shells around it.

A sun shines on all of a scene. Where the scene is wide and light is wanted in a small part of it, hardly any of its
particles would come there. What comes from around the box is the less the farther away it is, so that particles may
stand for more there: but little by little, since single ones that stand for much are blotches in the box.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..bounds import Bounds
from ..lights.light import Light, Particles

#: An inner and an outer box, None for nothing and for all of the scene.
Shell = tuple[Bounds | None, Bounds | None]

#: The box is made apart when the scene's has so many times its surface.
APART = 4.0

#: Share of the places on each side that may lie outside of the box, and by how much it is wider than they are.
OUTLYING, MARGIN = 0.02, 0.1


def wanted_box(places: np.ndarray, whole: Bounds) -> Bounds | None:
    """The box around most of ``places`` (N, 3), None where it is not much smaller than the ``whole``."""
    low, high = np.quantile(places, (OUTLYING, 1.0 - OUTLYING), axis=0)
    box = Bounds(low, high)
    box = _within(box.expanded(MARGIN * box.radius), whole)
    return box if 0.0 < APART * box.face_areas.sum() < whole.face_areas.sum() else None


def shells_of(box: Bounds, whole: Bounds) -> list[Shell]:
    """The ``box`` and shells around it, each twice as wide, up to the ``whole``."""
    boxes = [box]
    while APART * boxes[-1].face_areas.sum() < whole.face_areas.sum():
        boxes.append(_within(boxes[-1].expanded(0.5 * float(boxes[-1].size.max())), whole))
    return list(pairwise([None, *boxes, None]))


@dataclass(frozen=True)
class Between:
    """What of a distant ``light`` enters the ``outer`` box of a shell, if nothing is before it, but not the ``inner``
    one."""

    light: Light
    inner: Bounds | None
    outer: Bounds | None

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W of it."""
        whole = self.light.flux(self.outer or bounds)
        return whole if self.inner is None else whole - self.light.flux(self.inner)

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Particles from outside of ``bounds``, as of any light; those through the inner box are without flux."""
        sent = self.light.emit(uniforms, self.outer or bounds)
        if self.inner is not None:
            through = _meets(self.inner, sent.origins, sent.directions)
            sent = replace(sent, flux=np.where(through[:, None], 0.0, sent.flux))
        if self.outer is None:
            return sent
        back = np.linalg.norm(sent.origins - bounds.centre, axis=1) + bounds.radius
        return replace(sent, origins=sent.origins - back[:, None] * sent.directions)


def _within(box: Bounds, whole: Bounds) -> Bounds:
    """What of the ``box`` lies in the ``whole``."""
    return Bounds(np.maximum(box.lower, whole.lower), np.minimum(box.upper, whole.upper))


def _meets(box: Bounds, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Whether (K,) rays from ``origins`` (K, 3) along ``directions`` (K, 3) meet the ``box``."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(side - origins) / directions for side in (box.lower, box.upper)])
    enters, leaves = np.fmin(*ends).max(axis=1), np.fmax(*ends).min(axis=1)
    return (enters <= leaves) & (leaves >= 0.0)
