"""Photon path segments: the trajectories that density estimation on the tangent plane stores."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .rows import Rows


@dataclass(frozen=True)
class Segments(Rows):
    """Straight pieces of photon paths, from an emission or reflection to the next surface or out of the scene.

    origins  (S, 3) metres
    ends     (S, 3) metres; the first hit of the real scene (lengthened by the rounding tolerance of that
             hit), or a point outside everything for a segment that leaves the scene
    flux     (S, 3) W, RGB; a whole batch of segments is scaled to the scene's full power
    bounce   (S,)   uint16, reflections and refractions before this segment: 0 for light straight from a source
    particle (S,)   uint32, number of the particle whose path it is a part of; None where each is one of its own
    caustic  (S,)   whether the last reflection before it was by a mirror, or a refraction; None: nowhere
    """

    origins: np.ndarray
    ends: np.ndarray
    flux: np.ndarray
    bounce: np.ndarray
    particle: np.ndarray | None = None
    caustic: np.ndarray | None = None

    @classmethod
    def between(cls, origins: np.ndarray, ends: np.ndarray) -> Segments:
        """From ``origins`` to ``ends`` (S, 3) m, for a search of which only the crossings matter."""
        return cls(origins, ends, np.ones((len(origins), 3)), np.zeros(len(origins), np.uint16))

    def weighted(self, weight: float) -> Segments:
        """The same segments with their flux multiplied by ``weight``."""
        return replace(self, flux=self.flux * weight)

    def spread(self, count: int) -> Segments:
        """``count`` of them, at most all, evenly from the first to the last: those of one light follow each other."""
        return self.taken(np.linspace(0, len(self) - 1, min(count, len(self))).astype(np.int64)) if len(self) else self

    @property
    def direct(self) -> Segments:
        """Those straight from a light."""
        # A straight way crosses a disc once.
        return replace(self.taken(np.flatnonzero(self.bounce == 0)), particle=None)

    @property
    def indirect(self) -> Segments:
        """Those after at least one reflection or refraction."""
        return self.taken(np.flatnonzero(self.bounce)) if (self.bounce == 0).any() else self

    def of_kind(self, kind: str) -> Segments:
        """Those of direct light, of indirect light, or of what of it comes straight off mirrors or through glass."""
        if kind == "caustic":
            return self.taken(np.zeros(0, np.int64) if self.caustic is None else self.caustic)
        return self.direct if kind == "direct" else self.indirect
