"""What many emitters are like as one, seen from some way off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Ranges:
    """What ranges of emitters, of any shape (...), are like as one.

    power    (...,) in any unit
    centre   (..., 3) m, by power; of distant emitters the direction towards them, of the length that they agree in
    spread   (...,) m^2, mean squared distance from there
    even     (...,) the part of the power that goes alike in all directions
    axis     (..., 3) the part that goes one way, by its cosine
    plane    (..., 3, 3) the part that goes to both sides of a plane, by its cosine
    distant  (...,) whether they have no place
    """

    power: np.ndarray
    centre: np.ndarray
    spread: np.ndarray
    even: np.ndarray
    axis: np.ndarray
    plane: np.ndarray
    distant: np.ndarray

    def __getitem__(self, rows) -> Ranges:
        return Ranges(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    def brightness(self, places: np.ndarray, normals: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """About the light (...,) that comes to ``places`` (..., 3) unshadowed, in the power's unit over m^2.

        On a surface with unit ``normals`` (..., 3), and on one that faces the emitters; without normals twice the
        latter. What may shine at a place, however little, is above zero there, except behind the surface.
        """
        way = np.where(self.distant[..., None], self.centre, self.centre - places)
        square = np.einsum("...i,...i->...", way, way)
        length = np.sqrt(np.maximum(square, np.finfo(float).tiny))
        way = way / length[..., None]
        across = np.einsum("...i,...ij,...j->...", way, self.plane, way)
        shining = self.even - np.minimum(np.einsum("...i,...i->...", self.axis, way), 0.0)
        shining += np.sqrt(np.maximum(self.power * across, 0.0))
        light = np.where(self.distant, self.power, shining / np.maximum(square + self.spread, np.finfo(float).tiny))
        if normals is None:
            return light, light
        # The cosine at that part of the emitters that rises highest above the horizon.
        wide = np.where(self.distant, 0.0, np.minimum(np.sqrt(2.0 * self.spread) / length, 1.0))
        rise = (np.einsum("...i,...i->...", normals, way) + wide) / (1.0 + wide)
        return light * np.clip(rise, 0.0, 1.0), light
