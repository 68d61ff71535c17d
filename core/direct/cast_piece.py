"""A piece of the points whose rays are cast in another process: all that it takes, as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .point_groups import PointGroups
from .stands import Stands


@dataclass(frozen=True)
class CastPiece:
    """K points, in the order of their ``groups``, numbered among themselves.

    stands, normals  as of :class:`.DirectLight`
    first            the number of the first of them among all points
    begin, rounds    the first round to cast, and how many (K,)
    gathers, shines  whether rays bring what surfaces reflect, and whether they look for the lights
    changed, fixed   what is known of the points so far: what casting changes, and what it only looks at
    """

    stands: Stands
    normals: np.ndarray
    groups: PointGroups
    first: int
    begin: int
    rounds: np.ndarray
    gathers: bool
    shines: bool
    changed: tuple
    fixed: tuple
