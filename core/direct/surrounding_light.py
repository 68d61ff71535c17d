"""Light that surrounds a point: a world, shining triangles. Rays are aimed at it, and go where light was found.

Both kinds of rays are weighed by the balance heuristic (Veach and Guibas 1995), so that neither a small bright window
nor a lamp that touches the point is noisy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..lights.light import SHADOW_DIMENSIONS, Surroundings
from .direction_guide import SIDE, DirectionChoice, cells
from .low_discrepancy import scrambled_net
from .round_sums import RoundSums, batches, net_means
from .shadows import Shadows
from .spots import Spots


@dataclass(frozen=True)
class Sightings:
    """What K rays saw, to learn from.

    spot    (K,) the point's row
    place   (K,) its group * SIDE^2 + the cell of the direction
    light   (K,) W/m^2, RGB sum, that a ray which follows the cosine alone would bring from there; zero if blocked
    weight  (K,) density of the cosine over that with which both kinds of rays together were sent there
    whole   (K,) the same with that of the cosine and of aiming
    """

    spot: np.ndarray
    place: np.ndarray
    light: np.ndarray
    weight: np.ndarray
    whole: np.ndarray


class SurroundingLight:
    """Irradiance from ``lights``, by ``rays`` (a power of two) in a round to each of them and ``rays`` by chance.

    Surfaces farther than ``reach`` metres do not shade a point from the world.
    """

    def __init__(self, lights: Sequence[Surroundings], shadows: Shadows, reach: float, rays: int):
        self._lights, self._shadows, self._reach, self._rays = lights, shadows, reach, rays
        self._distant = all(light.distant for light in lights)
        self.rays_per_round = rays * (1 + sum(light.aimed for light in lights)) if lights else 0

    def cast(
        self,
        spots: Spots,
        rounds: np.ndarray,
        guide: DirectionChoice | None,
        generator: np.random.Generator,
        sums: RoundSums,
        seen: list[Sightings] | None = None,
    ) -> None:
        """Add to the ``sums`` of the K ``spots`` what ``rounds`` (K,) rounds of rays from each of them find.

        What was seen goes into the list ``seen``.
        """
        for rows, spot in batches(rounds):
            count = len(spot)
            from_ = np.repeat(spot, self._rays)
            around = spots.taken(from_)
            found = np.zeros((len(from_), 3))
            for light in self._lights:
                if light.aimed:
                    self._aimed(light, around, from_, guide, self._uniforms(count, generator), found, seen)
            self._by_chance(around, from_, guide, self._uniforms(count, generator), found, seen)
            sums.add(rows, rounds[rows], net_means(found, self._rays))

    def _aimed(self, light, spots: Spots, spot, guide, uniforms, found, seen) -> None:
        """Add to ``found`` what rays chosen by ``light`` bring."""
        rays = light.shadow_rays(spots.points, uniforms)
        cosine = np.einsum("ij,ij->i", spots.normals, rays.directions)
        rows = np.flatnonzero((cosine > 0) & rays.shines)
        directions, cosine, density = rays.directions[rows], cosine[rows], rays.density[rows]
        through = self._shadows.transmitted(spots.points[rows], directions, rays.distances[rows])
        arriving = rays.radiance[rows] * through * cosine[:, None]
        chance = cosine / np.pi
        if guide is None and seen is None:
            found[rows] += arriving / (density + chance)[:, None]
            return
        group = spots.group[rows]
        place = group * (SIDE * SIDE) + cells(spots.taken(rows).uniforms(directions))
        guided = chance if guide is None else chance * guide.density[place]
        found[rows] += arriving / (density + guided)[:, None]
        if seen is not None:
            plain, sent = np.abs(arriving).sum(axis=1) / (density + chance), density + guided
            seen.append(Sightings(spot[rows], place, plain, chance / sent, (density + chance) / sent))

    def _by_chance(self, spots: Spots, spot, guide, uniforms, found, seen) -> None:
        """Add to ``found`` what rays along the cosine bring, or where ``guide`` moves them."""
        factor = np.ones(len(spots))
        if guide is not None:
            uniforms, factor = guide.warped(spots.group, uniforms)
        directions, cosine = spots.directions(uniforms)
        chance = cosine / np.pi
        plain, densities = np.zeros(len(spots)), np.zeros(len(spots))
        for rows, density, radiance in self._met(spots.points, directions):
            arriving = radiance * cosine[rows, None]
            found[rows] += arriving / (density + chance[rows] * factor[rows])[:, None]
            if seen is not None:
                plain[rows] += np.abs(arriving).sum(axis=1) / (density + chance[rows])
                densities[rows] += density
        if seen is not None:
            place = spots.group * (SIDE * SIDE) + cells(uniforms)
            sent = densities + chance * factor
            seen.append(Sightings(spot, place, plain, chance / sent, (densities + chance) / sent))

    def _met(self, points, directions):
        """For each light: rows (R,) of rays, the density (R,) of aiming there, and the radiance (R, 3) that arrives."""
        if self._distant:
            share = self._shadows.transmitted(points, directions, np.full(len(points), self._reach))
            rows = np.flatnonzero(share.any(axis=1))
            nothing = np.full(len(rows), -1)
            for light in self._lights:
                radiance, density = light.met(points[rows], directions[rows], nothing, None)
                yield rows, density, radiance * share[rows]
            return
        for rows, hits, share in self._shadows.surfaces(points, directions, self._reach):
            for light in self._lights:
                mine = np.flatnonzero(light.among(hits.triangle))
                at = rows[mine]
                radiance, density = light.met(points[at], directions[at], hits.triangle[mine], hits.points[mine])
                yield at, density, radiance * share[mine]

    def _uniforms(self, count: int, generator: np.random.Generator) -> np.ndarray:
        """Low-discrepancy pairs for each of ``count`` points, (count * rays, 2)."""
        shifts = generator.integers(0, 1 << 32, (count, SHADOW_DIMENSIONS), np.uint32)
        return scrambled_net(self._rays, shifts).reshape(-1, SHADOW_DIMENSIONS)
