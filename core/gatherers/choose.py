"""The gatherer that was asked for, and in a sentence why it is this one."""

from __future__ import annotations

import numpy as np

from ..discs import TangentDiscs
from ..errors import InvalidSettingError
from ..settings import GATHERERS
from .brute_force import BruteForce
from .disc_index import DiscIndex
from .gatherer import Gatherer
from .hybrid import Hybrid, Search, checked_moving
from .sphere_cache import SphereCache

_SEARCHES: dict[str, Search] = {kind.name: kind for kind in (DiscIndex, SphereCache, BruteForce)}


def make_gatherer(name: str, discs: TangentDiscs, moving: np.ndarray | None = None) -> tuple[Gatherer, str]:
    """The gatherer called ``name`` over ``discs``, and in one sentence why it is this one.

    name    one of GATHERERS; "auto" takes what was the fastest wherever it was measured: Disc Indexing, and where some
            discs move and others stay the hybrid, with Disc Indexing inside of the outer spheres too
    moving  (N,) bool, which discs move from frame to frame; None: none

    All find the same crossings. Raises InvalidSettingError for any other name, InvalidArrayError when ``moving`` is not
    a bool per disc.
    """
    if name not in GATHERERS:
        raise InvalidSettingError(f"Unknown gatherer '{name}': choose {', '.join(GATHERERS)}.")
    moving = checked_moving(moving, len(discs))
    if name in _SEARCHES:
        return _SEARCHES[name](discs), f"{GATHERERS[name]}, as asked for."
    stay, move = np.count_nonzero(~moving), np.count_nonzero(moving)
    if name == "auto" and (stay == 0 or move == 0):
        return DiscIndex(discs), "Disc Indexing: the fastest in all scenes that were measured."
    if move == 0:
        why = "in a bake of one frame nothing moves, so that it is Disc Indexing"
        return Hybrid(discs), f"Hybrid, as asked for: {why}."
    kind = "disc-index" if name == "auto" else "sphere-cache"
    asked = ", as asked for" if name == "hybrid" else ""
    why = f"Hybrid{asked}: Disc Indexing for {stay} discs that stay, {GATHERERS[kind]} for {move} that move."
    return Hybrid(discs, moving, mobile=_SEARCHES[kind]), why
