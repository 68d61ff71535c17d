"""Point light: the same radiant flux in every direction, from a point or a small sphere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bounds import Bounds
from ..checks import fill, number_within, vector
from ..sampling import disc, frames, sphere
from .lamp_rays import SMALLEST_RADIUS, rays_to_ball, rays_to_point
from .light import Particles, ShadowRays


class Ball:
    """What lamps have in common whose light comes from a ball or a point, with the fields of :class:`PointLight`."""

    def check(self, lamp: str, **more) -> None:
        """Bring the fields of the ``lamp`` into form, and put ``more`` of them in."""
        fill(self, position=vector(self.position, f"{lamp}'s position"), power=vector(self.power, f"{lamp}'s power"))
        fill(self, radius=number_within(self.radius, f"{lamp}'s radius"), **more)

    @property
    def sharp(self) -> bool:
        """Whether the light has no extent."""
        return self.radius < SMALLEST_RADIUS

    def shadow_rays(self, points: np.ndarray, uniforms: np.ndarray) -> ShadowRays:
        """Of a ball that shines alike in all directions: uniform in the cone that it fills, or the disc of soft
        falloff; all around inside of it."""
        if self.sharp:
            return rays_to_point(points, self.position, self.power)
        return rays_to_ball(points, self.position, self.power, self.radius, self.soft, uniforms)

    def sent(self, directions: np.ndarray, flux: np.ndarray, uniforms: np.ndarray) -> Particles:
        """Particles along ``directions`` (P, 3) with that ``flux`` (P, 3) W, which start anywhere on the ball by
        ``uniforms`` (P, 2)."""
        aside = crosswise(directions, self.radius, uniforms)
        return Particles(self.position + aside, directions, flux, soft_start(aside, self.radius) if self.soft else None)


@dataclass(frozen=True, eq=False)
class PointLight(Ball):
    """An isotropic light of intensity power / (4 pi), or a sphere of uniform radiance power / (4 pi^2 radius^2).

    position  (3,) metres
    power     (3,) radiant flux in W, RGB, all directions together; negative takes light away
    radius    of the sphere, metres, >= 0
    soft      Blender's soft falloff: not a sphere, but a disc of that radius and radiance which faces every receiver,
              so that E = power / (4 pi (h^2 + radius^2)) at distance h; without a radius it changes nothing

    Raises InvalidArrayError or InvalidSettingError on anything else.
    """

    position: np.ndarray
    power: np.ndarray
    radius: float = 0.0
    soft: bool = False

    def __post_init__(self):
        self.check("The point light")

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W."""
        return self.power

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Particles of equal flux; uniforms (P, 4): direction 2, origin 2."""
        flux = np.tile(self.power / len(uniforms), (len(uniforms), 1))
        return self.sent(sphere(uniforms[:, :2]), flux, uniforms[:, 2:])


def crosswise(directions: np.ndarray, radius: float, uniforms: np.ndarray) -> np.ndarray:
    """Points (P, 3) uniform in discs of that ``radius`` perpendicular to ``directions`` (P, 3), by uniforms (P, 2).

    A uniformly radiant sphere sends the same flux along all lines of one direction that meet it, which are
    those through its disc perpendicular to them. Starting on that disc through the centre instead of on the sphere
    makes no difference outside.
    """
    first, second = frames(directions)
    flat = radius * disc(uniforms)
    return flat[:, :1] * first + flat[:, 1:] * second


def soft_start(aside: np.ndarray, radius: float) -> np.ndarray:
    """Distance (P,) in metres from where the facing disc of soft falloff shines along a line.

    ``aside`` (P, 3) is the line's point nearest to the light's centre, at distance b. Seen from t behind it, the
    facing disc is met b sqrt(b^2 + t^2) / t from the centre, which is within ``radius`` when
    t >= b^2 / sqrt(radius^2 - b^2). All such lines have the radiance of the sphere.
    """
    square = np.einsum("pi,pi->p", aside, aside)
    room = np.sqrt(np.maximum(radius**2 - square, np.finfo(float).tiny))
    return square / room
