"""Which gatherer searches, and why."""

from __future__ import annotations

import numpy as np

from ..discs import TangentDiscs
from ..errors import InvalidSettingError
from ..settings import GATHERERS
from ..space_filling import mean_spacing
from .brute_force import BruteForce
from .disc_index import DiscIndex
from .gatherer import Gatherer
from .sphere_cache import SphereCache

_TITLES = {"disc-index": "Disc Indexing", "sphere-cache": "Sphere Cache", "brute-force": "Brute force"}


def make_gatherer(name: str, discs: TangentDiscs) -> tuple[Gatherer, str]:
    """The gatherer called ``name`` over ``discs``, and in one sentence why it is this one.

    name  one of GATHERERS; "auto" takes Disc Indexing, which tools/benchmark_gatherers.py measures faster than
          Sphere Cache from 0.3 to 8 point spacings of radius

    Raises InvalidSettingError for any other name.
    """
    if name not in GATHERERS:
        raise InvalidSettingError(f"Unknown gatherer '{name}': choose {', '.join(GATHERERS)}.")
    if name == "sphere-cache":
        return SphereCache(discs), f"{_TITLES[name]}, as asked for."
    if name == "brute-force":
        return BruteForce(discs), f"{_TITLES[name]}, as asked for."
    gatherer = DiscIndex(discs)
    why = "as asked for" if name != "auto" else _size_of(discs)
    uneven = ", with the points too unevenly spread for a grid" if gatherer.index == "tree" else ""
    return gatherer, f"{_TITLES[gatherer.name]} with a {gatherer.index}: {why}{uneven}."


def _size_of(discs: TangentDiscs) -> str:
    spacing = mean_spacing(discs.centres)
    if spacing == 0.0:
        return "all points are in one place"
    return f"the radius is {float(np.median(discs.radii)) / spacing:.2g} point spacings"
