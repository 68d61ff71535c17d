"""First hits of rays on the scene's triangles: the one place that knows Embree."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from .parallel import ordered_map, slices
from .short_pieces import TRIANGLES_AT_ONCE, short_pieces
from .triangles import normals_and_areas

#: Rays in one call to Embree: long enough to hide the call, short enough to share among threads.
RAYS_PER_SLICE = 1 << 15

#: Share of a place's distance from the caster's centre by which origins are lifted off a surface there. Embree has
#: coordinates from that centre in float32, exact to 2^-25 of their size, of origins as of what they meet.
ROUNDING = 2.0**-22

#: The centre itself counts as so far away from it, a share of what is usual of the places that matter.
NEAREST = 1 / 16

#: Triangles that are drawn back are so by no more and no less than so many tolerances.
MOST_BACK, LEAST_BACK = 32, 4

#: Nearly all places lie within so many times the usual distance, if they are one scene and no stray parts of another.
MOST_OF_ALL = 4.0

#: What is so many tolerances farther than asked for belongs to it.
REACH_BEYOND = 16

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

    It is most exact in the middle of the places ``around`` (K, 3) m, of the corners themselves by default: what lies
    far from most of them makes nothing else coarse. With ``back`` (T,) metres triangles are drawn back behind
    themselves, see :meth:`drawn_back`, so that two that lie exactly on each other have an order.

    Attributes ``centre`` (3,), that middle, and in metres ``radius`` of a ball around it that holds all triangles, and
    ``size`` of one that holds most of the places.
    """

    def __init__(self, corners: np.ndarray, around: np.ndarray | None = None, back: np.ndarray | None = None):
        places = corners.reshape(-1, 3)
        around = places if around is None or len(around) == 0 else around
        self.corners, self._back = corners, back
        self.centre = np.median(around, axis=0)
        all_of_them = _distances(places, self.centre)
        self.radius = float(all_of_them.max())
        usual = (float(np.median(_distances(around, self.centre))), float(np.median(all_of_them)), self.radius, 1.0)
        self._usual = next(length for length in usual if length > 0)
        self.size = MOST_OF_ALL * self._usual
        # Products of the largest and of the smallest coordinates stay within what float32 can tell.
        self._scale = 1.0 / np.sqrt(self._usual * max(self.radius, self._usual))
        self._parts: dict[bytes, RayCaster] = {}
        self._commit()

    def _commit(self) -> None:
        pieces, owner = short_pieces(self.corners, self.centre, NEAREST * self._usual)
        # The last one stands for no piece.
        self._owner = np.append(owner, -1)
        if self._back is not None:
            far = self.drawn_back(np.repeat(owner, 3), pieces.reshape(-1, 3)).reshape(-1, 3, 1)
            pieces = pieces - far * self.normals[owner, None]
        # Hit points are made from them; mostly they are the triangles themselves, and take no memory.
        self._pieces = pieces.reshape(-1, 9)
        local = np.empty(pieces.shape, np.float32)
        for rows in slices(len(pieces), TRIANGLES_AT_ONCE):
            local[rows] = (pieces[rows] - self.centre) * self._scale
        self._embree = EmbreeScene()
        self._mesh = TriangleMesh(self._embree, local)
        # The first call commits the scene, which must not happen in several threads at once.
        self._embree.run(np.zeros((1, 3), np.float32), np.array([[0, 0, 1]], np.float32))

    def part(self, triangles: np.ndarray) -> RayCaster:
        """The same, as exact, of some ``triangles`` (at least one row) alone; made once."""
        key = triangles.tobytes()
        if key not in self._parts:
            part = self._parts[key] = copy(self)
            part.__dict__.pop("normals", None)
            part.corners, part._parts = self.corners[triangles], {}
            part._back = None if self._back is None else self._back[triangles]
            part._commit()
        return self._parts[key]

    def tolerance(self, places: np.ndarray) -> np.ndarray:
        """Metres (K,) that origins must at least be off a surface at ``places`` (K, 3) m not to hit it again.

        Hits there are exact to about that distance.
        """
        return ROUNDING * (_sums(np.abs(places - self.centre)) + NEAREST * self._usual)

    def drawn_back(self, triangle: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Metres (K,) by which each ``triangle`` (K,) is drawn back at one of the ``places`` (K, 3) m."""
        tolerance = self.tolerance(places)
        return np.clip(self._back[triangle], LEAST_BACK * tolerance, MOST_BACK * tolerance)

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
        return Hits(*_in_slices(self._cast, origins, directions, self._reach(origins, distances)))

    def occluded(self, origins: np.ndarray, directions: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """Whether (R,) anything lies within ``distances`` (R,) metres, inf allowed, along each ray as above."""
        (found,) = _in_slices(self._blocked, origins, directions, distances)
        return found

    def _blocked(self, origins, directions, distances):
        reach = np.minimum(distances * self._scale, FAR).astype(np.float32)
        hit = self._embree.run(self._local(origins), directions.astype(np.float32), reach, query="OCCLUDED")
        return (hit == 0,)

    def _reach(self, origins: np.ndarray, distances: np.ndarray | None) -> np.ndarray:
        """A little more than ``distances`` in Embree's scale: what rounding might leave out belongs to it."""
        if distances is None:
            return np.full(len(origins), FAR, np.float32)
        reach = 1.0001 * distances + REACH_BEYOND * self.tolerance(origins)
        return np.minimum(reach * self._scale, FAR).astype(np.float32)

    def _cast(self, origins, directions, reach):
        # Embree overwrites the distances that it is given.
        result = self._embree.run(self._local(origins), directions.astype(np.float32), reach, output=1)
        # Of rays that meet nothing the last piece: any is as good.
        piece = result["primID"].astype(np.int64)
        corners = self._pieces.take(piece, axis=0, mode="wrap")
        points = np.empty((len(piece), 3))
        for axis in range(3):
            first, second, third = corners[:, axis], corners[:, 3 + axis], corners[:, 6 + axis]
            points[:, axis] = first + result["u"] * (second - first) + result["v"] * (third - first)
        return self._owner.take(piece, mode="wrap"), points

    def _local(self, origins):
        local = origins - self.centre
        local *= self._scale
        return np.clip(local, -FAR, FAR, out=local).astype(np.float32)


def _in_slices(cast: Callable[..., tuple], *rays: np.ndarray) -> tuple:
    """The arrays that ``cast`` makes of ``rays``, arrays (R, ...), a slice at a time side by side."""
    parts = slices(len(rays[0]), RAYS_PER_SLICE)
    if len(parts) <= 1:
        return cast(*rays)
    found = ordered_map(lambda rows: cast(*(each[rows] for each in rays)), parts)
    return tuple(map(np.concatenate, zip(*found, strict=True)))


def _distances(places: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """How far (K,) ``places`` (K, 3) are from the ``centre`` (3,)."""
    found = np.empty(len(places))
    for rows in slices(len(places), TRIANGLES_AT_ONCE):
        away = places[rows] - centre
        found[rows] = np.sqrt(np.einsum("ij,ij->i", away, away))
    return found


def _sums(rows: np.ndarray) -> np.ndarray:
    """Sums (K,) of three columns (K, 3); NumPy is slow along so short an axis."""
    return rows[:, 0] + rows[:, 1] + rows[:, 2]
