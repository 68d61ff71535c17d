"""Area light: a rectangle or ellipse that shines to one side."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..bounds import Bounds
from ..checks import fill, number_within, unit_vector, vector
from ..errors import InvalidArrayError, InvalidSettingError
from ..sampling import around, cosine_hemisphere, disc, spherical_rectangle
from .lamp_rays import lit_rays, towards
from .light import Particles, ShadowRays

#: Share of the edges' bounding rectangle that each shape fills.
SHAPES = {"rectangle": 1.0, "ellipse": 0.25 * np.pi}

#: A spread below this many radians is a parallel beam: it would widen by half a millimetre a metre.
_PARALLEL = 1e-3

#: A spread within this many radians of pi is a Lambert emitter; single precision knows no closer.
_LAMBERT = 1e-6

#: Edges whose directions have no larger cosine are perpendicular: single precision makes them no better.
PERPENDICULAR = 1e-6

#: Below this solid angle in sr of the edges' rectangle places are chosen by area: for a rectangle because the other way
#: loses its digits there, for an ellipse because a quarter of the rectangle then goes to waste.
LEAST_SOLID_ANGLE = {"rectangle": 1e-4, "ellipse": 1.0}

#: A point less than this many times the light's size in front of its plane lies in it, and is dark.
IN_PLANE = 1e-12

#: Nodes of the table that starts the search for the angle, and the Newton steps after it.
_TABLE = 129
_NEWTON_STEPS = 4


@dataclass(frozen=True, eq=False)
class AreaLight:
    """A flat light of radiance power / (pi A), narrowed by its spread.

    centre  (3,) metres
    edge_u  (3,) from the middle of one side to the middle of the opposite one, in world space, metres
    edge_v  (3,) the same for the other two sides; need not be perpendicular to edge_u
    power   (3,) radiant flux in W, RGB
    shape   "rectangle" (a parallelogram when the edges are not perpendicular) or "ellipse" (the one inside it)
    spread  radians, 0..pi: at an angle t from the normal the radiance is that above times
            max(tan(spread/2) - tan t, 0) / (tan(spread/2) - spread/2); pi is a Lambert emitter, 0 a parallel beam

    It shines to the side of -(edge_u x edge_v): with the lamp's X and Y axes as edges that is its -Z, as in Blender;
    for a mirrored lamp, which keeps to its -Z, negate one edge. The flux is ``power`` whatever the spread, since
    2 pi times the integral of (tan s - tan t) cos t sin t from 0 to s is pi (tan s - s).

    Raises InvalidArrayError or InvalidSettingError on anything else, also when the light has no area. Source: Cycles'
    area light.
    """

    centre: np.ndarray
    edge_u: np.ndarray
    edge_v: np.ndarray
    power: np.ndarray
    shape: str = "rectangle"
    spread: float = np.pi

    def __post_init__(self):
        for name in ("centre", "edge_u", "edge_v", "power"):
            fill(self, **{name: vector(getattr(self, name), f"The area light's {name}")})
        if self.shape not in SHAPES:
            raise InvalidSettingError(f"Unknown area light shape '{self.shape}': choose {' or '.join(SHAPES)}.")
        fill(self, spread=number_within(self.spread, "The area light's spread", np.pi))
        if self.area == 0.0:
            raise InvalidArrayError("The area light has no area: give it a size in both directions.")

    @property
    def area(self) -> float:
        """Area in square metres."""
        return SHAPES[self.shape] * float(np.linalg.norm(np.cross(self.edge_u, self.edge_v)))

    @cached_property
    def normal(self) -> np.ndarray:
        """Unit vector (3,) on the side that shines."""
        return unit_vector(np.cross(self.edge_v, self.edge_u), "The area light's normal")

    @property
    def sharp(self) -> bool:
        """Whether the light is a parallel beam."""
        return self.spread < _PARALLEL

    def shadow_rays(self, points: np.ndarray, uniforms: np.ndarray) -> ShadowRays:
        """To the part of the light that its spread lets shine on the point.

        Uniform by solid angle on a rectangle, or the one around an ellipse (:func:`..sampling.spherical_rectangle`), by
        area where the solid angle is small or the edges are not perpendicular. A parallel beam comes from straight
        behind: irradiance power / A within it.
        """
        offsets = points - self.centre
        normal = self.normal
        height = offsets @ normal
        lit = height > IN_PLANE * np.sqrt(self.area)
        height = np.where(lit, height, 1.0)
        across = np.cross(self.edge_u, self.edge_v)
        shares = np.stack([np.cross(self.edge_v, across), np.cross(across, self.edge_u)]) / (across @ across)
        foot = offsets @ shares.T
        if self.sharp:
            rays = np.tile(-normal, (len(points), 1)), height, self.power / self.area, np.ones(len(points))
            return lit_rays(*rays, lit & self._covers(foot))
        reach = height[:, None] * (self.tangent * np.linalg.norm(shares, axis=1))
        low = np.maximum(-0.5, foot - reach)
        high = np.maximum(np.minimum(0.5, foot + reach), low)
        way, area, solid_angle = self._chosen(foot, low, high, height, uniforms)
        lit &= area > 0.0
        flat = way @ np.stack([self.edge_u, self.edge_v])
        directions, distances = towards(flat - height[:, None] * normal)
        by_area = distances**3 / (height * np.where(lit, area, 1.0))
        density = np.where(solid_angle > 0.0, 1.0 / np.where(solid_angle > 0.0, solid_angle, 1.0), by_area)
        strength = self._narrowed(np.linalg.norm(flat, axis=1) / height) / (np.pi * self.area)
        return lit_rays(directions, distances, strength[:, None] * self.power, density, lit)

    @property
    def tangent(self) -> float:
        """Tangent of the widest angle at which it shines."""
        return np.inf if np.pi - self.spread < _LAMBERT else np.tan(0.5 * self.spread)

    def _narrowed(self, slope: np.ndarray) -> np.ndarray:
        """Radiance at angles of tangent ``slope`` (K,) from the normal, over that of a Lambert emitter."""
        if np.isinf(self.tangent):
            return np.ones_like(slope)
        return np.maximum(self.tangent - slope, 0.0) / (self.tangent - 0.5 * self.spread)

    def _covers(self, place: np.ndarray) -> np.ndarray:
        """Whether each ``place`` (K, 2), in shares of the edges from the centre, is on the light."""
        if self.shape == "ellipse":
            return (place**2).sum(axis=1) <= 0.25
        return (np.abs(place) <= 0.5).all(axis=1)

    def _chosen(self, foot, low, high, height, uniforms) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places between ``low`` and ``high`` (K, 2), counted from ``foot``, in shares of the edges.

        With the area (K,) in m^2 over which each is uniform, zero for one that misses the light, and the solid angle
        (K,) where it is uniform by that, otherwise zero.
        """
        lengths = np.linalg.norm([self.edge_u, self.edge_v], axis=1)
        way = low - foot + uniforms * (high - low)
        filled = (high - low).prod(axis=1)
        area, solid_angle = filled * (self.area / SHAPES[self.shape]), np.zeros(len(foot))
        if abs(self.edge_u @ self.edge_v) <= PERPENDICULAR * lengths.prod():
            place, solid_angle = spherical_rectangle((low - foot) * lengths, (high - foot) * lengths, height, uniforms)
            solid_angle[solid_angle < LEAST_SOLID_ANGLE[self.shape]] = 0.0
            way = np.where(solid_angle[:, None] > 0.0, place / lengths, way)
        if self.shape == "ellipse":
            whole = (solid_angle == 0.0) & (filled > SHAPES["ellipse"])
            area = np.where(whole, self.area, np.where(self._covers(foot + way), area, 0.0))
            way = np.where(whole[:, None], 0.5 * disc(uniforms) - foot, way)
        return way, area, solid_angle

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W."""
        return self.power

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Particles of equal flux; uniforms (P, 4): direction 2, origin 2."""
        place = 0.5 * disc(uniforms[:, 2:]) if self.shape == "ellipse" else uniforms[:, 2:] - 0.5
        origins = self.centre + place[:, :1] * self.edge_u + place[:, 1:] * self.edge_v
        directions = self._directions(uniforms[:, :2])
        return Particles(origins, directions, np.tile(self.power / len(uniforms), (len(uniforms), 1)))

    def _directions(self, uniforms: np.ndarray) -> np.ndarray:
        if np.pi - self.spread < _LAMBERT:
            return cosine_hemisphere(self.normal, uniforms)
        if self.spread < _PARALLEL:
            return np.tile(self.normal, (len(uniforms), 1))
        sine_squared = _sine_squared(uniforms[:, 0], 0.5 * self.spread)
        # 1 - cos t = sin^2 t / (1 + cos t), which keeps narrow spreads exact
        return around(self.normal, sine_squared / (1.0 + np.sqrt(1.0 - sine_squared)), uniforms[:, 1])


def _sine_squared(uniforms: np.ndarray, half: float) -> np.ndarray:
    """sin^2 t of the emission angle t (P,), density in proportion to (tan half - tan t) cos t sin t, 0 <= t <= half.

    The share of flux within t is (tan half sin^2 t - t + sin t cos t) / (tan half - half). It is inverted by a
    table, close-meshed towards the end where its slope vanishes, and a few Newton steps.
    """
    slope = np.tan(half)
    largest = np.sin(half) ** 2

    def within(w):
        return (slope * w - np.arcsin(np.sqrt(w)) + np.sqrt(w * (1.0 - w))) / (slope - half)

    nodes = largest * (1.0 - np.linspace(1.0, 0.0, _TABLE) ** 2)
    w = np.interp(uniforms, within(nodes), nodes)
    for _ in range(_NEWTON_STEPS):
        density = (slope - np.sqrt(w / (1.0 - w))) / (slope - half)
        step = np.divide(within(w) - uniforms, density, out=np.zeros_like(w), where=density > 1e-9)
        w = np.clip(w - step, 0.0, largest)
    return w
