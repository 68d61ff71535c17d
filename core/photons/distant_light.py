"""Distant lights in two parts: what passes through a small box in which light is wanted, and what passes beside it.

A sun shines on all of a scene. Where the scene is wide and light is wanted in a small part of it, hardly any of its
particles would come there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..bounds import Bounds
from ..lights.light import Light, Particles

#: The box is made apart when the scene's has so many times its surface.
APART = 4.0

#: Share of the places on each side that may lie outside of the box, and by how much it is wider than they are.
OUTLYING, MARGIN = 0.02, 0.1


def wanted_box(places: np.ndarray, whole: Bounds) -> Bounds | None:
    """The box around most of ``places`` (N, 3), None where it is not much smaller than the ``whole``."""
    low, high = np.quantile(places, (OUTLYING, 1.0 - OUTLYING), axis=0)
    box = Bounds(low, high)
    box = box.expanded(MARGIN * box.radius)
    box = Bounds(np.maximum(box.lower, whole.lower), np.minimum(box.upper, whole.upper))
    return box if 0.0 < APART * box.face_areas.sum() < whole.face_areas.sum() else None


@dataclass(frozen=True)
class Through:
    """What of a distant ``light`` passes through ``box``, if nothing is before it."""

    light: Light
    box: Bounds

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W that enters the box."""
        return self.light.flux(self.box)

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Particles from outside of ``bounds``, as of any light."""
        sent = self.light.emit(uniforms, self.box)
        back = np.linalg.norm(sent.origins - bounds.centre, axis=1) + bounds.radius
        return replace(sent, origins=sent.origins - back[:, None] * sent.directions)


@dataclass(frozen=True)
class Beside:
    """What of a distant ``light`` does not pass through ``box``."""

    light: Light
    box: Bounds

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W that enters ``bounds``, but not the box."""
        return self.light.flux(bounds) - self.light.flux(self.box)

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Particles as of any light, those through the box without flux."""
        sent = self.light.emit(uniforms, bounds)
        through = _meets(self.box, sent.origins, sent.directions)
        return replace(sent, flux=np.where(through[:, None], 0.0, sent.flux))


def _meets(box: Bounds, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Whether (K,) rays from ``origins`` (K, 3) along ``directions`` (K, 3) meet the ``box``."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(side - origins) / directions for side in (box.lower, box.upper)])
    enters, leaves = np.fmin(*ends).max(axis=1), np.fmax(*ends).min(axis=1)
    return (enters <= leaves) & (leaves >= 0.0)
