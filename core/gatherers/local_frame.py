"""Small coordinates around the discs, in which the conservative searches may work in float32."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..discs import TangentDiscs

EXTENT = 1000.0  # most units along an axis
# Rounding moves a float32 position or plane distance below EXTENT by less than 1.3e-3 units, whatever the
# direction (a dozen operations of 2^-24 * sqrt(3) * EXTENT at worst); the searches allow three times as much.
MARGIN = 4e-3


@dataclass(frozen=True)
class Pieces:
    """The parts of segments inside a frame's box, one per segment that meets it.

    segment  (P,)   int64, row in the segments that were cut
    start    (3, P) float32, its first point in the frame's units
    step     (3, P) float32, from its first to its last point
    reach    (P,)   float32, the length of ``step``
    """

    segment: np.ndarray
    start: np.ndarray
    step: np.ndarray
    reach: np.ndarray


@dataclass(frozen=True)
class LocalFrame:
    """A box with its own unit of length: x becomes (x - origin) / unit, which lies in 0..size inside.

    origin  (3,) metres, the box's lower corner
    unit    metres
    size    (3,) units, at most EXTENT
    """

    origin: np.ndarray
    unit: float
    size: np.ndarray

    @classmethod
    def around(cls, discs: TangentDiscs) -> LocalFrame:
        """The one that holds all ``discs``, N >= 1, in the finest unit."""
        extent = discs.extents
        lower, upper = (discs.centres - extent).min(axis=0), (discs.centres + extent).max(axis=0)
        unit = float((upper - lower).max()) / (EXTENT - 2.0)
        return cls(lower - unit, unit, (upper - lower) / unit + 2.0)

    def local(self, points: np.ndarray) -> np.ndarray:
        """``points`` (N, 3) in metres in this frame's units, float64."""
        return (points - self.origin) / self.unit

    def pieces(self, origins: np.ndarray, ends: np.ndarray) -> Pieces:
        """Cut the segments from ``origins`` to ``ends`` (3, S), in metres, to the box. Points are no segments."""
        start = origins - self.origin[:, None]
        step = ends - origins
        limit = (self.size * self.unit)[:, None]
        segment = np.arange(start.shape[1])
        enter, leave = np.zeros(len(segment)), np.ones(len(segment))
        if not self._holds(start, limit) or not self._holds(start + step, limit) or not step.any(axis=0).all():
            with np.errstate(all="ignore"):
                inverse = 1.0 / step
                near, far = -start * inverse, (limit - start) * inverse
            # A segment parallel to a face gives infinities, or NaN when it lies in the face; fmin ignores NaN.
            enter = np.fmin(near, far).max(axis=0, initial=0.0)
            leave = np.fmax(near, far).min(axis=0, initial=1.0)
            segment = np.flatnonzero((enter <= leave) & step.any(axis=0))
            enter, leave = enter[segment], leave[segment]
            start, step = start.take(segment, axis=1), step.take(segment, axis=1)
        length = leave - enter
        start = ((start + enter * step) / self.unit).astype(np.float32)
        step = (step * (length / self.unit)).astype(np.float32)
        reach = np.sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2])
        return Pieces(segment, start, step, reach)

    @staticmethod
    def _holds(points: np.ndarray, limit: np.ndarray) -> bool:
        return points.size == 0 or bool((points.min(axis=1) >= 0.0).all() and (points.max(axis=1) <= limit[:, 0]).all())
