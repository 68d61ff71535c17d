"""Light from lamps with extent, or from many lamps: some are chosen, and rays go to places on them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights.lamp_rays import rays_to_ball
from ..lights.light import SHADOW_DIMENSIONS, Light, ShadowRays
from ..lights.point import PointLight
from .emitter_choice import EmitterChoice
from .emitter_cuts import most_ranges
from .learnt_choice import LearntChoice
from .low_discrepancy import nets
from .round_sums import RoundSums, batches, net_means
from .shadows import Shadows
from .stands import Stands

#: Lamps that are lower over a point than so many times the way from it to where its rays start, count as seen from the
#: point itself.
CLOSE = 1000.0

_MIDDLE = 0.5
_BALL, _SOFT = -1, -2


class LampLight:
    """Irradiance from the attribute ``lamps``, by ``rays`` (a power of two) in a round to all of them together.

    ``learnt`` has what groups of points know of them, and ``stands`` where the points' rays start.
    """

    def __init__(self, lamps: Sequence[Light], shadows: Shadows, rays: int, learnt: LearntChoice, stands: Stands):
        self.lamps, self._shadows, self._rays, self.learnt, self._stands = lamps, shadows, rays, learnt, stands
        self._balls = _Balls(lamps)
        self.rays_per_round = rays

    def exact(self, part: slice, rows: slice, points: np.ndarray, normals: np.ndarray, group: np.ndarray) -> np.ndarray:
        """Irradiance (K, 3) at points whose rays start at ``points`` (K, 3), with ``normals`` (K, 3), from lamps that
        are all without extent, and no more than groups have ranges; the rest is as for :meth:`cast`."""
        found, spot, stands = np.zeros_like(points), np.arange(len(points)), self._stands.taken(rows)
        choice = self._choice(part, rows, points, normals, group)
        for column, number in enumerate(self.learnt.emitters.order):
            chosen, sure = np.full(len(points), number), np.ones(len(points))
            uniforms = np.zeros((len(points), SHADOW_DIMENSIONS))
            light = self._arriving(stands, normals, spot, chosen, sure, uniforms)
            found += light
            brought, column = np.abs(light).sum(axis=1), np.full(len(points), column)
            self.learnt.add(part, rows, choice, choice.scale(np.zeros(len(points))), spot, column, brought)
        return found

    @property
    def count(self) -> int:
        """How many lamps there are."""
        return len(self.lamps)

    def unshadowed(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What their middles would bring to ``points`` (K, 3) with ``normals`` (K, 3) if nothing were in between: RGB
        sums (K, lamps), and the same without cosine; lamps are in the order of the emitters."""
        order = self.learnt.emitters.order
        light, strength = np.empty((2, len(points), len(order)))
        middle = np.full((len(points), SHADOW_DIMENSIONS), _MIDDLE)
        for column, number in enumerate(order):
            rays = self.lamps[number].shadow_rays(points, middle)
            strength[:, column] = np.abs(rays.radiance).sum(axis=1) / rays.density
            cosine = np.einsum("ij,ij->i", normals, rays.directions)
            light[:, column] = strength[:, column] * np.maximum(cosine, 0.0)
        return light, strength

    def rays_to(self, chosen: np.ndarray, points: np.ndarray, uniforms: np.ndarray) -> ShadowRays:
        """A ray from each of ``points`` (K, 3) to the ``chosen`` (K,) lamp, by ``uniforms`` (K, 2)."""
        found = [np.empty((len(points), 3)), np.empty(len(points)), np.empty((len(points), 3)), np.empty(len(points))]
        kinds = self._balls.kinds[chosen]
        for kind in np.unique(kinds).tolist():
            rows = np.flatnonzero(kinds == kind)
            if kind < 0:
                rays = self._balls.shadow_rays(kind, chosen[rows], points[rows], uniforms[rows])
            else:
                rays = self.lamps[kind].shadow_rays(points[rows], uniforms[rows])
            for whole, part in zip(found, (rays.directions, rays.distances, rays.radiance, rays.density), strict=True):
                whole[rows] = part
        return ShadowRays(*found)

    def cast(
        self,
        part: slice,
        rows: slice,
        points: np.ndarray,
        normals: np.ndarray,
        group: np.ndarray,
        rounds: np.ndarray,
        generator: np.random.Generator,
        sums: RoundSums,
        lit: np.ndarray,
    ) -> None:
        """Add to the ``sums`` of K points what ``rounds`` (K,) rounds of rays from each of them find.

        The points are the ``rows`` of all, and make up the groups in ``part``, from the first of which ``group`` (K,)
        counts. ``lit`` (K,) is what light, RGB sum, has been found at each so far.
        """
        choice = self._choice(part, rows, points, normals, group)
        scale, stands = choice.scale(lit), self._stands.taken(rows)
        for batch in batches(rounds):
            count = batch.size * self._rays
            spot = np.repeat(batch.spot, count)
            uniforms = nets(count, len(spot) // count, generator)
            chosen, rest, column, probability = choice.chosen(spot, uniforms[:, 0])
            uniforms[:, 0] = rest
            found = self._arriving(stands, normals, spot, chosen, probability, uniforms)
            sums.add(batch, net_means(found, count))
            brought = np.abs(found).sum(axis=1) * choice.share[spot, column]
            self.learnt.add(part, rows, choice, scale, spot, column, brought)

    def _choice(self, part: slice, rows: slice, points, normals, group) -> EmitterChoice:
        order = self.learnt.emitters.order
        if len(order) > most_ranges(self.learnt.emitters):
            return self.learnt.choice(part, rows, points, normals, group)
        # Each is a range of its own, and its middle tells more of it than a range does.
        return self.learnt.choice(part, rows, points, normals, group, self.unshadowed(points, normals))

    def _arriving(self, stands: Stands, normals, spot, chosen, probability, uniforms) -> np.ndarray:
        """Irradiance (S, 3) at each ``spot`` (S,) of the points by a ray to the ``chosen`` lamp (S,)."""
        origins, normals = stands.origins.take(spot, axis=0), normals.take(spot, axis=0)
        rays = self.rays_to(chosen, origins, uniforms)
        cosine = np.einsum("ij,ij->i", normals, rays.directions)
        ahead = stands.before(spot, rays.directions)
        height = rays.distances * np.maximum(np.abs(cosine), np.finfo(float).tiny)
        close = np.flatnonzero(height < CLOSE * stands.aside.take(spot))
        if len(close):
            ahead = ahead & np.full(len(spot), True)
            near = spot.take(close)
            points = stands.points.take(near, axis=0)
            seen = self.rays_to(chosen.take(close), points, uniforms.take(close, axis=0))
            cosine[close] = np.einsum("ij,ij->i", normals.take(close, axis=0), seen.directions)
            ahead[close] = stands.before(near, seen.directions)
            rays.radiance[close], rays.density[close] = seen.radiance, seen.density
            # Light that comes from nowhere, infinitely far away, keeps its direction.
            bounded = np.flatnonzero(np.isfinite(seen.distances))
            ends = points[bounded] + seen.distances[bounded, None] * seen.directions[bounded]
            ways = stands.ways(near[bounded], ends)
            rays.directions[close[bounded]], rays.distances[close[bounded]] = ways
        lit = np.flatnonzero((cosine > 0) & rays.shines & ahead)
        weight = cosine.take(lit) / (rays.density.take(lit) * probability.take(lit))
        ways = rays.directions.take(lit, axis=0), rays.distances.take(lit)
        found = np.zeros((len(chosen), 3))
        share = self._shadows.transmitted(origins.take(lit, axis=0), *ways)
        found[lit] = rays.radiance.take(lit, axis=0) * weight[:, None] * share
        return found


class _Balls:
    """Point lamps with extent among ``lamps``, which may be thousands, as arrays.

    Attribute ``kinds`` (L,): -1 for these, -2 for those of soft falloff, the number of the lamp for any other.
    """

    def __init__(self, lamps: Sequence[Light]):
        self.kinds = np.arange(len(lamps))
        self._places, self._powers, self._radii = (
            np.zeros((len(lamps), 3)),
            np.zeros((len(lamps), 3)),
            np.zeros(len(lamps)),
        )
        for number, lamp in enumerate(lamps):
            if type(lamp) is PointLight and not lamp.sharp:
                self.kinds[number] = _SOFT if lamp.soft else _BALL
                self._places[number], self._powers[number] = lamp.position, lamp.power
                self._radii[number] = lamp.radius

    def shadow_rays(self, kind: int, chosen: np.ndarray, points: np.ndarray, uniforms: np.ndarray) -> ShadowRays:
        """From each of ``points`` (K, 3) to the lamp ``chosen`` (K,), all of that ``kind`` < 0."""
        lamps = (each.take(chosen, axis=0) for each in (self._places, self._powers, self._radii))
        return rays_to_ball(points, *lamps, kind == _SOFT, uniforms)
