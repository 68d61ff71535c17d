"""What it takes to look for light all around some points, and what is seen."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .direction_guide import DirectionChoice, Sightings
from .spots import Spots
from .triangle_choice import TriangleChoice


@dataclass(frozen=True)
class Look:
    """One or more rounds of ``count`` rays from each of some ``spots``.

    spot    (S,) the spot of each round
    guide   moves rays by chance to where light is; None: they follow the cosine
    found   (S * count, 3) W/m^2, counted up: what each ray brings
    seen    a list to which Sightings are added; None when nothing is learnt any more
    aims    how points choose what to aim at, of lights that they know how to aim at better, by the lights' identities
    """

    spots: Spots
    spot: np.ndarray
    count: int
    guide: DirectionChoice | None
    found: np.ndarray
    seen: list[Sightings] | None
    aims: dict[int, TriangleChoice] = field(default_factory=dict)

    @cached_property
    def row(self) -> np.ndarray:
        """The spot (S * count,) of each ray."""
        return np.repeat(self.spot, self.count)

    @cached_property
    def rays(self) -> Spots:
        """A spot for each ray."""
        return self.spots.taken(self.row)
