"""Looking for light all around: rays that lights choose, and rays by chance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights.light import Surroundings
from .direction_guide import SIDE, Sightings, cells
from .looks import Look
from .shadows import Shadows


class LooksByNumPy:
    """Looks for ``lights``, which only surfaces within ``reach`` metres shade."""

    def __init__(self, lights: Sequence[Surroundings], shadows: Shadows, reach: float):
        self._lights, self._shadows, self._reach = lights, shadows, reach
        self._distant = all(light.distant for light in lights)

    def aimed(self, light: Surroundings, look: Look, uniforms: np.ndarray) -> None:
        """Add what rays chosen by ``light`` bring."""
        spots, guide, found = look.rays, look.guide, look.found
        aim = look.aims.get(id(light))
        if aim is None:
            rays = light.shadow_rays(spots.points, uniforms)
        else:
            rays, column = aim.shadow_rays(look.row, spots.points, uniforms)
        cosine = np.einsum("ij,ij->i", spots.normals, rays.directions)
        rows = np.flatnonzero((cosine > 0) & rays.shines)
        directions, cosine, density = rays.directions[rows], cosine[rows], rays.density[rows]
        through = self._shadows.transmitted(spots.points[rows], directions, rays.distances[rows])
        arriving = rays.radiance[rows] * through * cosine[:, None]
        if aim is not None:
            aim.learn(look.row, column, rows, arriving, density)
        chance = cosine / np.pi
        if guide is None and look.seen is None:
            found[rows] += arriving / (density + chance)[:, None]
            return
        group = spots.group[rows]
        place = group * (SIDE * SIDE) + cells(spots.taken(rows).uniforms(directions))
        guided = chance if guide is None else chance * guide.density[place]
        found[rows] += arriving / (density + guided)[:, None]
        if look.seen is not None:
            plain, sent = np.abs(arriving).sum(axis=1) / (density + chance), density + guided
            look.seen.append(Sightings(look.row[rows], place, plain, chance / sent, (density + chance) / sent))

    def by_chance(self, look: Look, uniforms: np.ndarray) -> None:
        """Add what rays along the cosine bring, or where the guide moves them."""
        spots, guide, found = look.rays, look.guide, look.found
        factor = np.ones(len(spots))
        if guide is not None:
            uniforms, factor = guide.warped(spots.group, uniforms)
        directions, cosine = spots.directions(uniforms)
        chance = cosine / np.pi
        plain, densities = np.zeros(len(spots)), np.zeros(len(spots))
        for rows, density, radiance in self._met(look, spots.points, directions):
            arriving = radiance * cosine[rows, None]
            found[rows] += arriving / (density + chance[rows] * factor[rows])[:, None]
            if look.seen is not None:
                plain[rows] += np.abs(arriving).sum(axis=1) / (density + chance[rows])
                densities[rows] += density
        if look.seen is not None:
            place = spots.group * (SIDE * SIDE) + cells(uniforms)
            sent = densities + chance * factor
            look.seen.append(Sightings(look.row, place, plain, chance / sent, (densities + chance) / sent))

    def _met(self, look, points, directions):
        """For each light: rows (R,) of rays, the density (R,) of aiming there, and the radiance (R, 3) that arrives."""
        if self._distant:
            share = self._shadows.transmitted(points, directions, np.full(len(points), self._reach))
            rows = np.flatnonzero(share.any(axis=1))
            nothing = np.full(len(rows), -1)
            for light in self._lights:
                radiance, density = light.met(points[rows], directions[rows], nothing, None)
                yield rows, density, radiance * share[rows]
            return
        for rows, hits, share in self._shadows.surfaces.met(points, directions, self._reach):
            for light in self._lights:
                mine = np.flatnonzero(light.among(hits.triangle))
                at = rows[mine]
                radiance, density = light.met(points[at], directions[at], hits.triangle[mine], hits.points[mine])
                if id(light) in look.aims:
                    density = density * look.aims[id(light)].factor(look.row[at], hits.triangle[mine])
                yield at, density, radiance * share[mine]
