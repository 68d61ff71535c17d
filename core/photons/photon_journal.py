"""What particles did, kept so that those whose way a change of the scene crosses can be traced anew from there on."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np

from ..errors import SessionTooLargeError
from ..lights.lamp_rays import towards
from ..parallel import slices
from ..segments import Segments

#: Bytes of a segment: origin, end, flux, and what belongs to it.
SEGMENT_BYTES = 80

#: Segments that are looked at in one step.
SEGMENTS_PER_STEP = 1 << 19


@dataclass(frozen=True)
class PhotonPaths:
    """Segments of all particles, each particle's in the order of its flight, and which of the ``lights`` (P,) each came
    from, as the tracer numbers them.

    Their flux is what each would carry if its particle were the only one.
    """

    segments: Segments
    lights: np.ndarray

    def touched(
        self, meets: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
    ) -> Generator[None, None, tuple[Segments, Segments]]:
        """The segments of all particles whose way ``meets`` something, up to the first that does so, and from it on;
        step by step.

        ``meets`` tells which (S,) ways from origins (S, 3) m along unit directions (S, 3) over distances (S,) m do.
        """
        whole = self.segments
        met = np.zeros(len(whole), bool)
        for some in slices(len(whole), SEGMENTS_PER_STEP):
            met[some] = meets(whole.origins[some], *towards(whole.ends[some] - whole.origins[some]))
            yield
        hit = np.flatnonzero(met)
        first = np.full(len(self.lights), len(whole))
        np.minimum.at(first, whole.particle.take(hit), hit)
        of_particle = first.take(whole.particle)
        rows = np.flatnonzero(of_particle < len(whole))
        since = rows >= of_particle.take(rows)
        return whole.taken(rows[~since]), whole.taken(rows[since])


class PhotonJournal:
    """Keeps the paths of all particles so far, or, once they are more than ``limit`` bytes hold, none at all."""

    def __init__(self, limit: int):
        self._most = limit // SEGMENT_BYTES
        self._parts: list[Segments] = []
        self._lights: list[np.ndarray] = []
        self._count = 0

    def keep(self, segments: Segments, lights: np.ndarray) -> None:
        """Keep the ``segments`` of some particles more, which came from ``lights`` (P,), as the tracer numbers them."""
        self._count += len(segments)
        if self.full:
            self._parts, self._lights = [], []
            return
        self._parts.append(segments)
        self._lights.append(lights.astype(np.uint16))

    @property
    def full(self) -> bool:
        """Whether there was more to keep than may be."""
        return self._count > self._most

    def check(self) -> None:
        """Raise SessionTooLargeError beyond the limit."""
        if self.full:
            raise SessionTooLargeError(
                f"more than {self._most * SEGMENT_BYTES / 1e9:.1f} GB of light paths would have to be kept for that"
            )

    def paths(self) -> PhotonPaths:
        """All of them; the journal is empty then."""
        found = PhotonPaths(Segments.joined(self._parts), np.concatenate(self._lights))
        self._parts, self._lights = [], []
        return found
