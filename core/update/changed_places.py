"""Where a scene changed: balls around the triangles that are gone or new, and how they are seen from elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..lights.aim import towards
from ..rows import Rows
from ..sampling import around, cosine_hemisphere

#: Most balls, and the share of a part's extent by which a gap parts it in two.
MOST_BALLS, GAP = 8, 0.15

#: Balls are larger than what they hold by this share, so that rounding leaves nothing out.
MARGIN = 1e-3

#: Rays into a cone, at least and at most, on average; and for each share of all light that may come from there, where a
#: ray is followed.
LEAST_RAYS, MOST_RAYS, FOLLOWING = 1 / 16, 64, 8.0


@dataclass(frozen=True)
class Balls:
    """K balls that hold all that changed: ``centres`` (K, 3) and ``radii`` (K,), metres."""

    centres: np.ndarray
    radii: np.ndarray

    @classmethod
    def around(cls, *parts: np.ndarray) -> Balls:
        """Of triangles (T, 3 corners, 3) m in ``parts``, which are apart; what is far apart in a part has several."""
        groups = [part for part in parts if len(part)]
        while len(groups) < MOST_BALLS:
            halves = [_halves(group) for group in groups]
            best = max(range(len(groups)), key=lambda number: halves[number][0], default=0)
            if not groups or halves[best][0] < GAP:
                break
            groups[best : best + 1] = halves[best][1:]
        centres = np.array([0.5 * (g.min(axis=(0, 1)) + g.max(axis=(0, 1))) for g in groups]).reshape(-1, 3)
        radii = [np.linalg.norm(g - c, axis=2).max() for g, c in zip(groups, centres, strict=True)]
        return cls(centres, (1.0 + MARGIN) * np.array(radii))

    def __len__(self) -> int:
        return len(self.radii)

    def reach(self, places: np.ndarray, margin: np.ndarray | float, times: float = 1.0) -> np.ndarray:
        """Whether (N,) ``places`` (N, 3) m lie within ``margin`` (N,) m of a ball of so many ``times`` its size."""
        near = np.zeros(len(places), bool)
        for centre, radius in zip(self.centres, self.radii, strict=True):
            near |= np.linalg.norm(places - centre, axis=1) < times * radius + margin
        return near

    def crossed(self, origins: np.ndarray, directions: np.ndarray, lengths: np.ndarray) -> np.ndarray:
        """Whether (S,) ways from ``origins`` (S, 3) m along unit ``directions`` (S, 3) over ``lengths`` (S,) m do."""
        found = np.zeros(len(origins), bool)
        for centre, radius in zip(self.centres, self.radii, strict=True):
            way = centre - origins
            ahead = np.einsum("ij,ij->i", way, directions)
            along = np.clip(ahead, 0.0, lengths)
            found |= np.einsum("ij,ij->i", way, way) - along * (2.0 * ahead - along) <= radius**2
        return found


@dataclass(frozen=True)
class Rays(Rows):
    """R rays from some of P places.

    row         (R,) the place of each, ascending within each ball
    ball        (R,) whose cone it was sent into
    directions  (R, 3) unit
    cosine      (R,) to the place's normal
    chance      (R,) how many rays a steradian were sent there
    """

    row: np.ndarray
    ball: np.ndarray
    directions: np.ndarray
    cosine: np.ndarray
    chance: np.ndarray

    @property
    def scale(self) -> np.ndarray:
        """What the radiosity (R,) of a surface that a ray meets counts in the place's irradiance."""
        return self.cosine / (np.pi * self.chance)


@dataclass(frozen=True)
class Sight:
    """How P places see K balls: as cones about ``axis`` (K, P, 3), with ``fall`` (K, P) one less the cosine of half
    their angle; the first cone of a place inside a ball has all directions, and an infinite fall.

    ``normals`` (P, 3) are those of the places; ``count`` (K, P) rays are to be sent into each cone, on average.
    """

    axis: np.ndarray
    fall: np.ndarray
    normals: np.ndarray
    count: np.ndarray

    @classmethod
    def of(cls, balls: Balls, places: np.ndarray, normals: np.ndarray, noise: float | None = None) -> Sight:
        """Of ``balls`` from ``places`` (P, 3) m with unit ``normals`` (P, 3).

        As many rays are to be sent as leave about ``noise`` of all light; None: at most one.
        """
        axis, fall = np.empty((len(balls), len(places), 3)), np.empty((len(balls), len(places)))
        count = np.zeros((len(balls), len(places)))
        inside = np.zeros(len(places), bool)
        for ball, (centre, radius) in enumerate(zip(balls.centres, balls.radii, strict=True)):
            axis[ball], distance = towards(centre - places)
            inside |= distance <= radius
            sine = np.minimum(radius / np.maximum(distance, 1e-300), 1.0)
            fall[ball] = sine**2 / (1.0 + np.sqrt(1.0 - sine**2))
            height = np.einsum("ij,ij->i", axis[ball], normals)
            seen = height > -sine
            share = 2.0 * fall[ball] * np.clip(height + sine, 0.0, 1.0)
            wanted = (
                np.minimum(FOLLOWING * share, 1.0) if noise is None else np.minimum((share / noise) ** 2, MOST_RAYS)
            )
            count[ball] = np.where(seen, np.maximum(wanted, LEAST_RAYS), 0.0)
        if len(balls):
            fall[0, inside] = np.inf
            count[:, inside] = 0
            count[0, inside] = 1 if noise is None else MOST_RAYS
        return cls(axis, fall, normals, count)

    def ball(self, row: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """The first ball (R,) in whose cone each of unit ``directions`` (R, 3) from the places ``row`` (R,) lies, or
        -1."""
        found = np.full(len(row), -1)
        for ball in reversed(range(len(self.fall))):
            away = 1.0 - np.einsum("ij,ij->i", self.axis[ball].take(row, axis=0), directions)
            found[away <= self.fall[ball].take(row)] = ball
        return found

    def chance(self, row: np.ndarray, ball: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Rays a steradian (R,) into the cone of that ``ball`` (R,) from places ``row`` (R,), at that ``cosine``."""
        fall, count = self.fall[ball, row], self.count[ball, row]
        return np.where(np.isinf(fall), count * cosine / np.pi, count / (2.0 * np.pi * fall))

    def rays(self, generator: np.random.Generator) -> Rays:
        """The rays that are to be sent; none that belongs to another ball's cone or leads behind its place."""
        whole = np.floor(self.count + generator.random(self.count.shape)).astype(np.int64)
        ball, row = (np.repeat(each.ravel(), whole.ravel()) for each in np.indices(whole.shape))
        uniforms = generator.random((len(row), 2))
        fall, normals = self.fall[ball, row], self.normals.take(row, axis=0)
        whole = np.isinf(fall)
        directions = around(self.axis[ball, row], uniforms[:, 0] * np.where(whole, 0.0, fall), uniforms[:, 1])
        directions[whole] = cosine_hemisphere(normals[whole], uniforms[whole])
        cosine = np.einsum("ij,ij->i", normals, directions)
        kept = np.flatnonzero((cosine > 0) & (self.ball(row, directions) == ball))
        row, ball, cosine = row.take(kept), ball.take(kept), cosine.take(kept)
        return Rays(row, ball, directions.take(kept, axis=0), cosine, self.chance(row, ball, cosine))


def _halves(group: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """The widest gap between triangles along an axis, over their extent, and the triangles on either side."""
    low, high = group.min(axis=1), group.max(axis=1)
    size = max(float(np.linalg.norm(high.max(axis=0) - low.min(axis=0))), np.finfo(float).tiny)
    best = 0.0, group, group[:0]
    for axis in range(3):
        order = np.argsort(low[:, axis])
        reached = np.maximum.accumulate(high[order, axis])
        gaps = low[order[1:], axis] - reached[:-1]
        if len(gaps) and gaps.max() / size > best[0]:
            cut = int(gaps.argmax()) + 1
            best = float(gaps.max()) / size, group[order[:cut]], group[order[cut:]]
    return best
