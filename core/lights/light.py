"""What every light source offers to the photon tracer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..bounds import Bounds

#: How many uniform random numbers a particle's emission may use, for every light.
EMISSION_DIMENSIONS = 4


@dataclass(frozen=True)
class Particles:
    """Photon particles as they leave a light.

    origins     (P, 3) metres
    directions  (P, 3) unit vectors
    flux        (P, 3) radiant flux in W, RGB; negative for lights of negative power
    start       (P,) metres along the direction before which a particle is blocked by surfaces but does not shine, or
                None for particles that shine from their origins on
    """

    origins: np.ndarray
    directions: np.ndarray
    flux: np.ndarray
    start: np.ndarray | None = None

    @staticmethod
    def joined(parts: list[Particles]) -> Particles:
        """All particles of ``parts`` in their order; ``parts`` holds at least one."""
        start = None
        if any(part.start is not None for part in parts):
            start = np.concatenate([np.zeros(len(p.origins)) if p.start is None else p.start for p in parts])
        joined = (np.concatenate([getattr(part, name) for part in parts]) for name in ("origins", "directions", "flux"))
        return Particles(*joined, start)


class Light(Protocol):
    """A source of photon particles."""

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W that the light sends out; distant lights: that enters ``bounds``."""
        ...

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Turn ``uniforms`` (P, EMISSION_DIMENSIONS) in [0, 1) into P particles.

        The mapping is deterministic, so that random and low-discrepancy numbers serve alike. The
        particles' flux adds up to :meth:`flux` in expectation. Distant lights start their particles on the
        surface of ``bounds``.
        """
        ...
