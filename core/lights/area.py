"""Area light: a rectangle or ellipse that shines to one side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bounds import Bounds
from ..checks import number_within, unit_rows, vector
from ..errors import InvalidArrayError, InvalidSettingError
from ..sampling import around, cosine_hemisphere, disc
from .light import Particles

#: Share of the edges' bounding rectangle that each shape fills.
SHAPES = {"rectangle": 1.0, "ellipse": 0.25 * np.pi}

#: A spread below this many radians is a parallel beam: it would widen by half a millimetre a metre.
_PARALLEL = 1e-3

#: A spread within this many radians of pi is a Lambert emitter; single precision knows no closer.
_LAMBERT = 1e-6

#: Nodes of the table that starts the search for the angle, and the Newton steps after it.
_TABLE = 129
_NEWTON_STEPS = 4


@dataclass(frozen=True)
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
            object.__setattr__(self, name, vector(getattr(self, name), f"The area light's {name}"))
        if self.shape not in SHAPES:
            raise InvalidSettingError(f"Unknown area light shape '{self.shape}': choose {' or '.join(SHAPES)}.")
        object.__setattr__(self, "spread", number_within(self.spread, "The area light's spread", 0.0, np.pi))
        if self.area == 0.0:
            raise InvalidArrayError("The area light has no area: give it a size in both directions.")

    @property
    def area(self) -> float:
        """Area in square metres."""
        return SHAPES[self.shape] * float(np.linalg.norm(np.cross(self.edge_u, self.edge_v)))

    @property
    def normal(self) -> np.ndarray:
        """Unit vector (3,) on the side that shines."""
        return unit_rows(np.cross(self.edge_v, self.edge_u)[None, :], "The area light's normal")[0]

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
