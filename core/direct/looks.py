"""What it takes to look for light all around some points, and what is seen."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from .direction_guide import DirectionChoice, Sightings
from .spots import Spots
from .triangle_choice import TriangleChoice

if TYPE_CHECKING:
    from .nearby_lamps import NearbyLamps


@dataclass(frozen=True)
class Look:
    """One or more rounds of ``count`` rays from each of some ``spots``.

    spot       (S,) the spot of each round
    chances    rays by chance over those that are aimed at one light
    guide      moves rays by chance to where light is; None: they follow the cosine
    generator  of random numbers for rays that are followed on
    seen       a list to which Sightings are added; None when nothing is learnt any more
    total      (S, 3) W/m^2, counted up: what aimed rays bring in each round
    aims       how points choose what to aim at, of lights that they know how to aim at better, by their identities
    nearby     aims at lamps from places near the points, of groups from number ``first`` on; None without any
    followed   over how many landings rays have been followed before
    """

    spots: Spots
    spot: np.ndarray
    count: int
    chances: float
    guide: DirectionChoice | None
    generator: np.random.Generator
    seen: list[Sightings] | None
    total: np.ndarray
    aims: dict[int, TriangleChoice] = field(default_factory=dict)
    nearby: NearbyLamps | None = None
    first: int = 0
    followed: int = 0

    @cached_property
    def row(self) -> np.ndarray:
        """The spot (S * count,) of each ray."""
        return np.repeat(self.spot, self.count)

    @cached_property
    def rays(self) -> Spots:
        """A spot for each ray."""
        return self.spots.taken(self.row)


class Reflections(Protocol):
    """What surfaces reflect towards rays that meet them by chance."""

    def sent(self, look: Look, rows: np.ndarray, directions, triangle, places) -> np.ndarray:
        """Radiosity (K, 6) W/m^2 of each ``triangle`` (K,), -1 for none, met at ``places`` (K, 3), in two halves.

        The ``rows`` (K,) of the look's rays met them, which go along unit ``directions`` (R, 3), all of them.
        """
        ...
