"""First hits of rays on the scene's triangles: the one place that knows Embree."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from .bounds import Bounds
from .parallel import ordered_map, slices
from .triangles import normals_and_areas

#: Rays in one call to Embree: long enough to hide the call, short enough to share among threads.
RAYS_PER_SLICE = 1 << 15

#: Share of the scene's radius by which origins are lifted off a surface. Embree sees the scene in float32, centred
#: and scaled to radius 1, where coordinates are exact to 2^-24; a ray that starts 32 of these steps away does not
#: hit its own triangle again, even at grazing angles.
RELATIVE_TOLERANCE = 2.0**-19

#: Farther than anything in the scaled scene, and finite in float32.
FAR = 1e30


@dataclass(frozen=True)
class Hits:
    """Where each of R rays meets the scene first.

    triangle  (R,) int64, -1 for a ray that meets nothing
    points    (R, 3) metres, on the triangle's plane in float64; meaningless where triangle is -1
    """

    triangle: np.ndarray
    points: np.ndarray


class RayCaster:
    """Casts rays at triangles (T, 3 corners, 3), metres, which stay in the attribute ``corners``.

    Attribute ``tolerance``, metres: origins must be at least so far off a surface not to hit it again, and a hit is
    exact to about that distance. Embree sees the scene less ``centre`` (3,), times ``scale``. ``edged`` (T, 9) are a
    corner of each triangle and the two edges from it.
    """

    def __init__(self, corners: np.ndarray):
        bounds = Bounds.of(corners.reshape(-1, 3))
        self.corners = corners
        self.centre = bounds.centre
        self.scale = 1.0 / bounds.radius if bounds.radius > 0 else 1.0
        self.tolerance = RELATIVE_TOLERANCE / self.scale
        first = corners[:, :1]
        self.edged = np.concatenate([first, corners[:, 1:] - first], axis=1).reshape(-1, 9)
        self._parts: dict[bytes, RayCaster] = {}
        self._commit()

    def _commit(self) -> None:
        local = ((self.corners - self.centre) * self.scale).astype(np.float32)
        self._embree = EmbreeScene()
        self._mesh = TriangleMesh(self._embree, np.ascontiguousarray(local))
        # The first call commits the scene, which must not happen in several threads at once.
        self._embree.run(np.zeros((1, 3), np.float32), np.array([[0, 0, 1]], np.float32))

    def part(self, triangles: np.ndarray) -> RayCaster:
        """The same, ``centre`` and ``scale`` too, of some ``triangles`` (at least one row) alone; made once."""
        key = triangles.tobytes()
        if key not in self._parts:
            part = self._parts[key] = copy(self)
            part.__dict__.pop("normals", None)
            part.corners, part.edged, part._parts = self.corners[triangles], self.edged[triangles], {}
            part._commit()
        return self._parts[key]

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals (T, 3) of the triangles by their winding, any direction where there is no area."""
        return normals_and_areas(self.corners)[0]

    def first_hits(self, origins: np.ndarray, directions: np.ndarray, distances: np.ndarray | None = None) -> Hits:
        """The nearest triangle along each ray: ``origins`` (R, 3) metres, ``directions`` (R, 3) unit vectors.

        What is farther away than ``distances`` (R,) metres need not be found.

        Hit points come from the triangle's float64 corners and Embree's barycentric coordinates, which stays exact
        for needles and at grazing angles, where origin + distance * direction does not (Waechter and Binder 2019).
        """
        reach = np.full(len(origins), FAR, np.float32) if distances is None else self._reach(distances)
        parts = slices(len(origins), RAYS_PER_SLICE)
        if len(parts) <= 1:
            return Hits(*self._cast(origins, directions, reach))
        found = ordered_map(lambda rows: self._cast(origins[rows], directions[rows], reach[rows]), parts)
        return Hits(*map(np.concatenate, zip(*found, strict=True)))

    def occluded(self, origins: np.ndarray, directions: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """Whether (R,) anything lies within ``distances`` (R,) metres, inf allowed, along each ray as above."""
        parts = slices(len(origins), RAYS_PER_SLICE)
        if len(parts) <= 1:
            return self._blocked(origins, directions, distances)
        found = ordered_map(lambda rows: self._blocked(origins[rows], directions[rows], distances[rows]), parts)
        return np.concatenate(list(found))

    def _blocked(self, origins, directions, distances):
        reach = np.minimum(distances * self.scale, FAR).astype(np.float32)
        return self._embree.run(self._local(origins), directions.astype(np.float32), reach, query="OCCLUDED") == 0

    def _reach(self, distances: np.ndarray) -> np.ndarray:
        """A little more than ``distances`` in the scaled scene: what rounding might leave out belongs to it."""
        return np.minimum(distances * (1.0001 * self.scale) + 16 * RELATIVE_TOLERANCE, FAR).astype(np.float32)

    def _cast(self, origins, directions, reach):
        # Embree overwrites the distances that it is given.
        result = self._embree.run(self._local(origins), directions.astype(np.float32), reach.copy(), output=1)
        triangle = result["primID"].astype(np.int64)
        # Of rays that meet nothing the last triangle's: any is as good.
        edged = self.edged.take(triangle, axis=0, mode="wrap")
        points = np.empty((len(triangle), 3))
        for axis in range(3):
            points[:, axis] = edged[:, axis] + result["u"] * edged[:, 3 + axis] + result["v"] * edged[:, 6 + axis]
        return triangle, points

    def _local(self, origins):
        local = origins - self.centre
        local *= self.scale
        return np.clip(local, -FAR, FAR, out=local).astype(np.float32)
