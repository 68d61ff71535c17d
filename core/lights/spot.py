"""Spot light: a point light seen through a cone with a soft rim."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..bounds import Bounds
from ..checks import float_rows, number_within, unit_vector
from ..errors import InvalidArrayError
from ..sampling import around, frames
from .light import Particles, ShadowRays
from .point import Ball

#: Newton steps for the soft rim: the error is below 1e-15 after eight, wherever it starts.
_NEWTON_STEPS = 8

#: Quadrature nodes from axis to rim and around, for the flux of a stretched cone: good to 0.3 % at 100 to 1.
_NODES = 64
_TURNS = 1024

_OWN_AXIS = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True, eq=False)
class SpotLight(Ball):
    """A light of intensity I = power / (4 pi) on its axis and I S((cos a - c) / ((1 - c) blend)) off it.

    a is the angle from the axis, c = cos(size / 2), and S(t) = t^2 (3 - 2 t), clamped to 0..1.

    position  (3,) metres
    axis      (3,) the way it shines; or a (3, 3) matrix that takes the lamp's own space to the world, where the lamp
              shines along -Z and a is measured in its own space: an unevenly scaled lamp has an elliptic cone
    power     (3,) radiant flux in W, RGB, of the point light that has the intensity of the axis all around
    size      full angle of the cone, radians, 0..pi
    blend     share of the cone that the soft rim takes, 0..1
    radius    of the sphere that shines, metres, >= 0
    soft      Blender's soft falloff, as for the point light

    Raises InvalidArrayError or InvalidSettingError on anything else. Source: Blender's and Cycles' spot light.
    """

    position: np.ndarray
    axis: np.ndarray
    power: np.ndarray
    size: float
    blend: float
    radius: float = 0.0
    soft: bool = False

    def __post_init__(self):
        size = number_within(self.size, "The spot light's size", np.pi)
        blend = number_within(self.blend, "The spot light's blend", 1.0)
        self.check("The spot light", axis=_own_space(self.axis), size=size, blend=blend)

    def shadow_rays(self, points: np.ndarray, uniforms: np.ndarray) -> ShadowRays:
        """The point light's, times what the cone lets through along each ray."""
        rays = super().shadow_rays(points, uniforms)
        return replace(rays, radiance=rays.radiance * self._share(-rays.directions)[:, None])

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W that leaves the cone: power (1 - c)(1 - blend / 2) / 2 when it is round."""
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        turns = (np.arange(_TURNS) + 0.5) / _TURNS
        grid = np.stack(np.meshgrid(0.5 + 0.5 * nodes, turns, indexing="ij"), axis=-1).reshape(-1, 2)
        stretch = self._directions(grid)[1].reshape(_NODES, _TURNS).mean(axis=1) @ (0.5 * weights)
        return self._round_flux * stretch

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Particles, of equal flux when the cone is round; uniforms (P, 4): direction 2, origin 2."""
        directions, stretch = self._directions(uniforms[:, :2])
        return self.sent(directions, stretch[:, None] * (self._round_flux / len(uniforms)), uniforms[:, 2:])

    @property
    def fall(self) -> float:
        """1 - c, without cancellation in a narrow cone."""
        return 2.0 * np.sin(0.25 * self.size) ** 2

    @cached_property
    def _to_own(self) -> np.ndarray:
        """(3, 3), by which rows of world directions become those of the own space; few rays ask for it very often."""
        return np.linalg.inv(self.axis).T

    @property
    def _round_flux(self) -> np.ndarray:
        return self.power * (0.5 * self.fall * (1.0 - 0.5 * self.blend))

    def _directions(self, uniforms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """World directions (P, 3), and world over own solid angle (P,), for own directions in proportion to intensity.

        A direction w of the own space becomes M w / |M w|, and the solid angle around it grows by |det M| / |M w|^3.
        """
        own = around(_OWN_AXIS, self.fall * _share_of_fall(uniforms[:, 0], self.blend), uniforms[:, 1])
        turned = own @ self.axis.T
        length = np.linalg.norm(turned, axis=1)
        return turned / length[:, None], abs(np.linalg.det(self.axis)) / length**3

    def _share(self, directions: np.ndarray) -> np.ndarray:
        """Intensity (K,) along unit world ``directions`` (K, 3), over that of the axis."""
        own = directions @ self._to_own
        squares = own**2
        squares /= squares.sum(axis=1, keepdims=True)
        ahead = own[:, 2] < 0.0
        # 1 - cos a = sin^2 a / (1 + cos a) keeps narrow cones exact; nothing shines backwards
        fall = np.where(ahead, (squares[:, 0] + squares[:, 1]) / (1.0 + np.sqrt(squares[:, 2])), 1.0)
        rim = self.fall * self.blend
        if rim <= np.finfo(float).tiny:
            return (fall < self.fall).astype(float)
        t = np.clip(self.fall - fall, 0.0, rim) / rim
        return t * t * (3.0 - 2.0 * t)


def _own_space(axis) -> np.ndarray:
    """The lamp's matrix (3, 3) from its axis (3,) or its matrix; the size of it is of no account and taken out."""
    name = "The spot light's axis"
    if np.ndim(axis) < 2:
        direction = unit_vector(axis, name)
        return np.stack([*frames(-direction), -direction], axis=1)
    matrix = float_rows(axis, name, 3, 3)
    matrix = matrix / max(np.abs(matrix).max(), np.finfo(float).tiny)
    if np.linalg.det(matrix) == 0.0:
        raise InvalidArrayError("The spot light is scaled to nothing along an axis: give it a size in all three.")
    return matrix


def _share_of_fall(uniforms: np.ndarray, blend: float) -> np.ndarray:
    """(1 - cos a) / (1 - c) in proportion to the spot's intensity, from ``uniforms`` (P,).

    With t = (cos a - c) / ((1 - c) blend), the flux from the rim up to t < 1 is blend (t^3 - t^4 / 2) out of 1 -
    blend / 2. That is convex on 0..1, so Newton's method from its right finds t without overshooting.
    """
    spent = uniforms * (1.0 - 0.5 * blend)
    if blend == 0.0:
        return spent
    left = np.clip((1.0 - 0.5 * blend - spent) / blend, 0.0, 0.5)
    t = np.cbrt(2.0 * left)
    for _ in range(_NEWTON_STEPS):
        slope = t * t * (3.0 - 2.0 * t)
        step = np.divide(t**3 * (1.0 - 0.5 * t) - left, slope, out=np.zeros_like(t), where=slope > 0.0)
        t = np.clip(t - step, 0.0, 1.0)
    return np.where(spent < 1.0 - blend, spent, 1.0 - blend * t)
