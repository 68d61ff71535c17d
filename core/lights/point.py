"""Point light: the same radiant flux in every direction, from a point or a small sphere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bounds import Bounds
from ..checks import number_within, vector
from ..sampling import disc, frames, sphere
from .light import Particles


@dataclass(frozen=True)
class PointLight:
    """An isotropic light of intensity power / (4 pi), or a sphere of uniform radiance power / (4 pi^2 radius^2).

    position  (3,) metres
    power     (3,) radiant flux in W, RGB, all directions together; negative takes light away
    radius    of the sphere, metres, >= 0

    Raises InvalidArrayError or InvalidSettingError on anything else.
    """

    position: np.ndarray
    power: np.ndarray
    radius: float = 0.0

    def __post_init__(self):
        object.__setattr__(self, "position", vector(self.position, "The point light's position"))
        object.__setattr__(self, "power", vector(self.power, "The point light's power"))
        object.__setattr__(self, "radius", number_within(self.radius, "The point light's radius", 0.0))

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W."""
        return self.power

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Particles of equal flux; uniforms (P, 4): direction 2, origin 2."""
        directions = sphere(uniforms[:, :2])
        origins = self.position + self.radius * crosswise(directions, uniforms[:, 2:])
        return Particles(origins, directions, np.tile(self.power / len(uniforms), (len(uniforms), 1)))


def crosswise(directions: np.ndarray, uniforms: np.ndarray) -> np.ndarray:
    """Points (P, 3) uniform in the unit disc perpendicular to each of ``directions`` (P, 3); uniforms (P, 2).

    A uniformly radiant sphere sends the same flux along all lines of one direction that meet it, which are
    those through its disc perpendicular to them. Starting on that disc through the centre instead of on the sphere
    makes no difference outside.
    """
    first, second = frames(directions)
    flat = disc(uniforms)
    return flat[:, :1] * first + flat[:, 1:] * second
