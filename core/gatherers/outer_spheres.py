"""The outer spheres of the Sphere Cache, kept over frames while what moves stays in them."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np

from ..discs import TangentDiscs
from ..parallel import ordered_map, slices
from ..segments import Segments
from .gatherer import Counts
from .sphere_cache import meets
from .sphere_cache_plan import around

TOGETHER = 1 << 15  # segments compared with a sphere together
# Spheres are larger than they are said to be by this share of themselves, and of the farthest coordinate beside them:
# the test of a segment is right to a few times 1e-16 of that.
MARGIN, ROUNDING = 1e-6, 1e-12


@dataclass(frozen=True, eq=False)
class Sphere:
    """``centre`` (3,) and ``radius``, metres. Each is one of its own, so that its list can be found again."""

    centre: np.ndarray
    radius: float

    def holds(self, other: Sphere) -> bool:
        """Whether ``other`` lies in it."""
        return float(np.linalg.norm(other.centre - self.centre)) + other.radius <= self.radius


def sphere_around(discs: TangentDiscs) -> Sphere:
    """A sphere that holds N >= 1 ``discs``."""
    return Sphere(*around(discs.centres, discs.radii))


def walked_on(spheres: tuple[Sphere, ...], moving: Sphere, first: float, q: float) -> tuple[Sphere, ...]:
    """The ``spheres`` of the frame before, from the outermost inwards, as the next frame needs them.

    That is the study's walk from disc to disc, done from frame to frame: r_{i+1} = q r_i from the ``first`` radius
    inwards to the last that holds all that is ``moving``. Where that leaves a sphere, this one and those inside it are
    made anew around it; the outer ones stay the same objects.
    """
    kept = next((number for number, sphere in enumerate(spheres) if not sphere.holds(moving)), len(spheres))
    made = list(spheres[:kept])
    radius = (made[-1].radius if made else first) * q
    while radius >= moving.radius:
        made.append(Sphere(moving.centre, radius))
        radius *= q
    return tuple(made)


class SphereLists:
    """Lists of the segments that meet spheres, kept as long as the same arrays of segments are searched again."""

    def __init__(self):
        self._held: dict[int, tuple[weakref.ref, dict[Sphere, np.ndarray]]] = {}

    def near(self, segments: Segments, spheres: tuple[Sphere, ...], counts: Counts | None = None) -> np.ndarray:
        """Rows (K,) of ``segments`` that meet all ``spheres``, one or more; lists that are not kept are made anew.

        Segments are the same when their ``ends`` are the same array: flux may differ, as when some are to count no
        more.
        """
        kept, lists, rows = self._known(segments.ends), {}, None
        for sphere in spheres:
            found = kept.get(sphere)
            if found is None:
                found = meeting(segments, rows, sphere)
                if counts is not None:
                    counts.note("lists", 1)
                    counts.note("nodes", len(segments) if rows is None else len(rows))
            lists[sphere] = rows = found
        kept.clear()
        kept.update(lists)
        return rows

    def _known(self, ends: np.ndarray) -> dict[Sphere, np.ndarray]:
        """The lists of the segments that have these ``ends``, until the array is no more."""
        key, held = id(ends), self._held
        if key not in held:
            held[key] = weakref.ref(ends, lambda _: held.pop(key, None)), {}
        return held[key][1]


def meeting(segments: Segments, rows: np.ndarray | None, sphere: Sphere) -> np.ndarray:
    """Those of the ``rows`` of segments, None for all, that meet a ``sphere``."""

    def found(part: slice) -> np.ndarray:
        some = np.arange(part.start, part.stop) if rows is None else rows[part]
        start, end = (places.take(some, axis=0).T for places in (segments.origins, segments.ends))
        step = end - start
        farthest = max(np.abs(places).max() for places in (start, end, sphere.centre))
        length = np.maximum(np.einsum("ij,ij->j", step, step), np.finfo(np.float64).tiny)
        reach = sphere.radius * (1.0 + MARGIN) + ROUNDING * farthest
        rays = np.concatenate([start, step, 1.0 / length[None]])
        return some[meets(rays, sphere.centre[:, None, None], np.full((1, 1), reach * reach))[0]]

    count = len(segments) if rows is None else len(rows)
    return np.concatenate([np.zeros(0, np.int64), *ordered_map(found, slices(count, TOGETHER))])
