"""Sphere Cache: nested spheres with lists of the segments that meet them, around discs walked in sorted order."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..discs import TangentDiscs
from ..errors import InvalidSettingError
from ..ranges import expanded
from ..space_filling import curve_order
from .gatherer import Counts
from .local_frame import MARGIN, Pieces
from .patch_search import PatchSearch
from .patches import Stretches
from .sphere_cache_plan import SLACK, Q, SpherePlan

SEGMENTS = 1 << 17  # most whose lists are kept at the same time
TESTS = 1 << 16  # segments and spheres compared together
HELD = 1 << 14  # entries of innermost lists that are collected before their discs are tested
SHORT = 1 << 13


class SphereCache(PatchSearch):
    """The study's first gatherer.

    discs        the TangentDiscs to search
    q            ratio of one sphere's radius to that around it, 0 < q < 1; the study found 0.6 to 0.7 best
    last_radius  the innermost sphere's least radius in metres; None: SLACK median radii of the discs. A sphere
                 hardly larger than a disc serves that one alone, a much larger one has a long list.
    sort         walk the discs along a space-filling curve and not in their given order
    short        lists serve all their discs at once when they are this short, by entries times discs: further spheres
                 would cost more to make; 0 makes all spheres, as in the study

    Raises InvalidSettingError when q or last_radius is out of range.
    """

    name = "sphere-cache"

    def __init__(
        self,
        discs: TangentDiscs,
        q: float = Q,
        last_radius: float | None = None,
        sort: bool = True,
        short: float = SHORT,
    ):
        if not 0.0 < q < 1.0:
            raise InvalidSettingError(f"The ratio of the Sphere Cache's radii must be between 0 and 1, not {q:g}.")
        if last_radius is not None and not last_radius > 0.0:
            raise InvalidSettingError(f"The last sphere's radius must be greater than 0 m, not {last_radius:g}.")
        order = curve_order(discs.centres) if sort else np.arange(len(discs))
        discs = discs.taken(order)
        super().__init__(discs, order, SEGMENTS)
        if len(discs) == 0:
            return
        self._short = short
        last = last_radius if last_radius is not None else SLACK * float(np.median(discs.radii))
        plan = self._plan = SpherePlan.of(discs.centres, discs.radii, q, last)
        self._centre = self._frame.local(plan.centre).T.astype(np.float32)
        reach = plan.radius / self._frame.unit * (1.0 + 1e-5) + 2.0 * MARGIN
        self._reach = (reach * reach).astype(np.float32)
        count = self._served = plan.end - plan.begin
        self._patch(discs, expanded(plan.begin, count)[1], np.cumsum(count) - count)

    def _stretches(self, pieces: Pieces, counts: Counts | None) -> Iterator[Stretches]:
        """Walk the plan depth first and yield the entries of the lists that serve discs, many lists together."""
        length = np.maximum(pieces.reach**2, np.finfo(np.float32).tiny)
        rays = np.concatenate([pieces.start, pieces.step, 1.0 / length[None]])
        waiting = [(0, np.arange(len(pieces.segment)))]
        held: list[tuple[int, np.ndarray]] = []
        entries = 0
        while waiting:
            sphere, listed = waiting.pop()
            if self._plan.children[sphere] and len(listed) * self._served[sphere] > self._short:
                inner = list(self._inner_lists(rays.take(listed, axis=1), sphere, listed))
                if counts is not None:
                    counts.note("lists", self._plan.children[sphere])
                    counts.note("nodes", self._plan.children[sphere] * len(listed))
                waiting += reversed(inner)
                continue
            held.append((sphere, listed))
            entries += len(listed)
            if entries >= HELD or not waiting:
                yield _whole_pieces(held)
                held, entries = [], 0
        if held:
            yield _whole_pieces(held)

    def _inner_lists(self, rays: np.ndarray, sphere: int, listed: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        """The lists of the spheres inside ``sphere``, made from its own."""
        first, last = self._plan.child[sphere], self._plan.child[sphere] + self._plan.children[sphere]
        together = max(1, TESTS // max(1, len(listed)))
        for begin in range(first, last, together):
            spheres = slice(begin, min(begin + together, last))
            met = meets(rays, self._centre[:, spheres, None], self._reach[spheres, None])
            for child, row in enumerate(met, start=begin):
                inner = listed.take(row.nonzero()[0])
                if len(inner):
                    yield child, inner


def meets(rays: np.ndarray, centre: np.ndarray, square: np.ndarray) -> np.ndarray:
    """Whether rays (7, P), as columns of start, step and 1/|step|^2, come as near as sqrt(square) to centres (3, K, 1).

    The distance is measured from the closest point of the segment, and not by Pythagoras: as the difference of
    two large squares it would lose small spheres (Haines et al., Precision Improvements for Ray/Sphere
    Intersection, 2019).
    """
    x, y, z = (centre[axis] - rays[axis] for axis in range(3))
    along = x * rays[3]
    along += y * rays[4]
    along += z * rays[5]
    along *= rays[6]
    np.maximum(along, np.float32(0.0), out=along)
    np.minimum(along, np.float32(1.0), out=along)
    x -= along * rays[3]
    y -= along * rays[4]
    z -= along * rays[5]
    x *= x
    y *= y
    x += y
    z *= z
    x += z
    return x <= square


def _whole_pieces(held: list[tuple[int, np.ndarray]]) -> Stretches:
    spheres, lists = zip(*held, strict=True)
    piece = np.concatenate(lists)
    patch = np.repeat(np.array(spheres), [len(listed) for listed in lists])
    return Stretches(piece, patch, np.zeros(len(piece), np.float32), np.ones(len(piece), np.float32))
