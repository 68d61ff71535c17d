"""A quasi-static scene for the study: an object that goes through a scene, frame by frame, and light that meets it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..discs import TangentDiscs
from ..gatherers.outer_spheres import sphere_around
from ..sampling import cosine_hemisphere
from ..segments import Segments
from .fields import StudyScene, mean_spacing, uniform_points

#: How far the object goes from frame to frame, in radii of the scene.
STEP = 0.01
#: Radii of discs in spacings of the points, as records have them.
WIDE = 1.2


@dataclass(frozen=True)
class Frame:
    """One frame.

    discs     (N,) those of the scene, and at the end those on the object
    segments  all as they are in this frame
    gone      rows of the first scene's segments, without the object, that are no more
    come      what is in their place
    """

    discs: TangentDiscs
    segments: Segments
    gone: np.ndarray
    come: Segments


@dataclass(frozen=True)
class MovingObject:
    """A ball of ``radius`` metres with M discs on it, that goes straight through the middle of a scene.

    still     (N - M,) the scene's discs
    placed    (M,) those on it, as if it were at the origin
    segments  the scene's without it
    middle    (3,) metres, of its way
    around    R, metres: the sphere around the scene's points
    """

    radius: float
    still: TangentDiscs
    placed: TangentDiscs
    segments: Segments
    middle: np.ndarray
    around: float

    @classmethod
    def of(cls, scene: StudyScene, size: float, share: float, points: int, segments: int) -> MovingObject:
        """One of ``size`` in radii of the ``scene``, with that ``share`` of all discs.

        At most so many ``points`` and ``segments`` of the scene. Discs are as wide as a bake's records, those on the
        object no wider than half of it.
        """
        generator = np.random.default_rng(10)
        rows = np.linspace(0, len(scene.centres) - 1, min(points, len(scene.centres))).astype(np.int64)
        wide = WIDE * mean_spacing(scene.centres[rows])
        still = scene.discs(wide).taken(rows)
        sphere = sphere_around(still)
        radius = size * sphere.radius
        outward = uniform_points("surface", max(1, round(share / (1.0 - share) * len(still))), generator)
        placed = TangentDiscs.of_radius(radius * outward, outward, min(wide, 0.5 * radius))
        some = scene.segments.spread(segments)
        return cls(radius, still, placed, Segments.between(some.origins, some.ends), sphere.centre, sphere.radius)

    @property
    def step(self) -> float:
        """Metres that it goes in a frame."""
        return STEP * self.around

    @property
    def moving(self) -> np.ndarray:
        """Which discs (N,) move."""
        return np.arange(len(self.still) + len(self.placed)) >= len(self.still)

    def frames(self, count: int) -> Iterator[Frame]:
        """So many frames; a segment that meets the object ends on it and goes on elsewhere for what was left of it."""
        for number in range(count):
            centre = self.middle + [(number - 0.5 * count) * self.step, 0.0, 0.0]
            placed = TangentDiscs(self.placed.centres + centre, self.placed.normals, self.placed.radii)
            discs = TangentDiscs.joined([self.still, placed])
            gone, come = self._met(centre, np.random.default_rng((11, number)))
            kept = np.ones(len(self.segments), bool)
            kept[gone] = False
            yield Frame(discs, Segments.joined([self.segments.taken(kept), come]), gone, come)

    def _met(self, centre: np.ndarray, generator: np.random.Generator) -> tuple[np.ndarray, Segments]:
        """Rows of the segments that meet the ball at ``centre``, and what becomes of those that come from outside."""
        start, step = self.segments.origins - centre, self.segments.ends - self.segments.origins
        a, b = np.einsum("ij,ij->i", step, step), np.einsum("ij,ij->i", start, step)
        c = np.einsum("ij,ij->i", start, start) - self.radius**2
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(np.maximum(b * b - a * c, 0.0))
            enter, leave = (-b - root) / a, (-b + root) / a
        gone = np.flatnonzero((b * b > a * c) & (enter < 1.0) & (leave > 0.0))
        met = gone[enter[gone] > 0.0]
        origins, share = self.segments.origins[met], enter[met, None]
        places = origins + share * step[met]
        outward = (places - centre) / self.radius
        onward = cosine_hemisphere(outward, generator.random((len(met), 2)))
        onward *= (1.0 - share) * np.sqrt(a[met, None])
        return gone, Segments.between(np.concatenate([origins, places]), np.concatenate([places, places + onward]))
