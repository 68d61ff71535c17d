"""Sun light: parallel light from far away, or from a disc of the sky."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..bounds import Bounds
from ..checks import fill, number_within, unit_vector, vector
from ..sampling import box_entry, cone, projected_area
from .light import Particles, ShadowRays

#: A sun below this many radians is a point: a ray's direction in Embree is no finer.
_SHARP = 1e-6


@dataclass(frozen=True, eq=False)
class SunLight:
    """A far light, uniformly radiant over a cone of directions.

    direction   (3,) the way the light travels, along the middle of the cone
    irradiance  (3,) W/m^2, RGB, on a surface that faces it, whatever the angle
    angle       the sun's angular diameter in radians, 0..pi

    Raises InvalidArrayError or InvalidSettingError on anything else. With half = angle / 2 the radiance is
    irradiance / (pi sin^2 half).
    """

    direction: np.ndarray
    irradiance: np.ndarray
    angle: float = 0.0
    distant: ClassVar[bool] = True

    def __post_init__(self):
        fill(self, direction=unit_vector(self.direction, "The sun's direction"))
        fill(self, irradiance=vector(self.irradiance, "The sun's irradiance"))
        fill(self, angle=number_within(self.angle, "The sun's angle", np.pi))

    @property
    def sharp(self) -> bool:
        """Whether the sun has no extent."""
        return self.angle < _SHARP

    def shadow_rays(self, points: np.ndarray, uniforms: np.ndarray) -> ShadowRays:
        """Uniform in the cone of the sun."""
        count, half = len(points), 0.5 * self.angle
        far = np.full(count, np.inf)
        if self.sharp:
            return ShadowRays(
                np.tile(-self.direction, (count, 1)), far, np.tile(self.irradiance, (count, 1)), np.ones(count)
            )
        radiance = np.tile(self.irradiance / (np.pi * np.sin(half) ** 2), (count, 1))
        solid_angle = 4.0 * np.pi * np.sin(0.5 * half) ** 2
        return ShadowRays(cone(-self.direction, half, uniforms), far, radiance, np.full(count, 1.0 / solid_angle))

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W that enters the box: irradiance times its shadow, averaged over the cone."""
        faces = [_both_sides(abs(float(cosine)), 0.5 * self.angle) for cosine in self.direction]
        return self.irradiance * float(np.dot(faces, bounds.face_areas))

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Particles on the faces of the box; uniforms (P, 4): direction 2, origin 2.

        Each carries radiance x solid angle of the cone x the box's shadow along its own direction; the first two
        make 2 irradiance / (1 + cos half).
        """
        half = 0.5 * self.angle
        directions = cone(self.direction, half, uniforms[:, :2])
        origins = box_entry(bounds, directions, uniforms[:, 2:])
        share = projected_area(bounds, directions) * (2.0 / (1.0 + np.cos(half)) / len(uniforms))
        return Particles(origins, directions, share[:, None] * self.irradiance)


def _both_sides(cosine: float, half: float) -> float:
    """Irradiance on a plane from both its sides together, over that on a surface facing the sun.

    ``cosine`` >= 0 is between the plane's normal and the middle of a sun of half angle ``half``. While the sun is
    whole on one side this is the cosine. Otherwise it is the sum over the plane's two sides of the irradiance from a
    sphere cut by the horizon (Snyder, "Area Light Sources for Real-Time Graphics", Microsoft Research 1996; also
    Lagarde and de Rousiers, "Moving Frostbite to Physically Based Rendering", 2014, listing 10).
    """
    sine = np.sin(half)
    if cosine >= sine:
        return cosine
    across = np.sqrt(1.0 - cosine * cosine)
    cotangent = np.cos(half) / sine
    cut = min(cotangent * cosine / across, 1.0)
    chord = across * np.sqrt(1.0 - cut * cut)
    rest = np.arctan2(chord, cotangent) / sine**2
    both = (2.0 / np.pi) * (cosine * np.arcsin(cut) - cotangent * chord + rest)
    # A tiny sun on the horizon loses its digits in that difference; it cannot give less than its middle.
    return max(float(both), cosine)
