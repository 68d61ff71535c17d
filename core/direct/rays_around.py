"""Looking for light all around: rays that lights choose, and rays by chance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights.light import Surroundings
from .direction_guide import SIDE, Sightings, cells
from .looks import Look, Reflections
from .passage import SeeThrough
from .round_sums import net_means
from .shadows import Shadows


class RaysAround:
    """Looks for ``lights``, which only surfaces within ``reach`` metres shade.

    Attribute ``reflected``: what surfaces send on, which rays by chance bring too; None as long as it is not known.
    """

    def __init__(self, lights: Sequence[Surroundings], shadows: Shadows, reach: float):
        self._lights, self._shadows, self._reach = lights, shadows, reach
        self._distant = all(light.distant for light in lights)
        self.reflected: Reflections | None = None

    def aimed(self, light: Surroundings, look: Look, uniforms: np.ndarray) -> None:
        """Add to ``look.total`` what rays chosen by ``light`` bring."""
        spots, guide = look.rays, look.guide
        aim = look.aims.get(id(light))
        if aim is None:
            rays = light.shadow_rays(spots.points, uniforms)
        else:
            rays, column = aim.shadow_rays(look.row, spots.points, uniforms)
        cosine = np.einsum("ij,ij->i", spots.normals, rays.directions)
        rows = np.flatnonzero((cosine > 0) & rays.shines & spots.before(rays.directions))
        directions, cosine = rays.directions[rows], cosine[rows]
        through = self._shadows.of(light).transmitted(spots.points[rows], directions, rays.distances[rows])
        arriving = rays.radiance[rows] * through * cosine[:, None]
        if aim is not None:
            aim.learn(look.row, column, rows, arriving, rays.density[rows])
        # Densities per ray by chance.
        density, chance = rays.density[rows] / look.chances, cosine / np.pi
        guided = chance
        if guide is not None or look.seen is not None:
            group = spots.group[rows]
            place = group * (SIDE * SIDE) + cells(spots.taken(rows).uniforms(directions))
            guided = chance if guide is None else chance * guide.density[place]
        found = np.zeros((len(spots), 3))
        found[rows] = arriving / (look.chances * (density + guided))[:, None]
        look.total[:] += net_means(found, look.count)
        if look.seen is not None:
            plain, sent = _strength(arriving) / (density + chance), density + guided
            look.seen.append(Sightings(look.row[rows], place, plain, chance / sent, (density + chance) / sent))

    def by_chance(self, look: Look, uniforms: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """What rays along the cosine bring, or where the guide moves them: W/m^2 of the lights (S * count, 3).

        Then what surfaces reflect, by both halves of the records, (S * count, 6), or None.
        """
        spots, guide = look.rays, look.guide
        factor = np.ones(len(spots))
        if guide is not None:
            uniforms, factor = guide.warped(spots.group, uniforms)
        directions, cosine = spots.directions(uniforms)
        chance = cosine / np.pi
        found = np.zeros((len(spots), 3))
        sent_on = None if self.reflected is None else np.zeros((len(spots), 6))
        plain, densities = np.zeros(len(spots)), np.zeros(len(spots))
        before = spots.before(directions)
        for rows, density, radiance in self._met(look, spots.points, directions, sent_on):
            density = density / look.chances
            arriving = radiance * cosine[rows, None]
            found[rows] += arriving / (density + chance[rows] * factor[rows])[:, None]
            if look.seen is not None:
                plain[rows] += _strength(arriving) / (density + chance[rows])
                densities[rows] += density
        if before is not True:
            for part in (found, plain, sent_on):
                if part is not None:
                    part[~before] = 0.0
        if look.seen is not None:
            if sent_on is not None:
                plain += 0.5 * np.einsum("ij->i", sent_on)
            place = spots.group * (SIDE * SIDE) + cells(uniforms)
            sent = densities + chance * factor
            look.seen.append(Sightings(look.row, place, plain, chance / sent, (densities + chance) / sent))
        if sent_on is not None:
            sent_on /= factor[:, None]
        return found, sent_on

    def _met(self, look, points, directions, sent_on):
        """For each light: rows (R,) of rays, the density (R,) of aiming there, and the radiance (R, 3) that arrives.

        The radiosity of surfaces is added to ``sent_on`` (K, 6), unless that is None.
        """
        if self._distant and sent_on is None:
            share = self._shadows.between.transmitted(points, directions, np.full(len(points), self._reach))
            rows = np.flatnonzero(share.any(axis=1))
            nothing = np.full(len(rows), -1)
            for light in self._lights:
                radiance, density = light.met(points[rows], directions[rows], nothing, None)
                yield rows, density, radiance * share[rows]
            return
        for surfaces, lights in self._shadows.ways(self._lights):
            yield from self._arriving(look, points, directions, surfaces, lights, sent_on)
            # Reflected light comes the first of these ways alone.
            sent_on = None

    def _arriving(self, look, points, directions, surfaces: SeeThrough, lights, sent_on):
        """The same of those ``lights`` alone, as far as ``surfaces`` let it pass."""
        for layer, (rows, hits, share) in enumerate(surfaces.met(points, directions, self._reach)):
            for light in lights:
                mine = np.flatnonzero(light.among(hits.triangle))
                at, there = rows.take(mine), (hits.triangle.take(mine), hits.points.take(mine, axis=0))
                radiance, density = light.met(points.take(at, axis=0), directions.take(at, axis=0), *there)
                if id(light) in look.aims:
                    density = density * look.aims[id(light)].factor(look.row[at], hits.triangle[mine])
                yield at, density, radiance * share[mine]
            if sent_on is not None:
                sent = self.reflected.sent(look, rows, directions, hits.triangle, hits.points)
                if layer:
                    sent_on[rows] += np.tile(share, 2) * sent
                else:
                    sent_on += sent


def _strength(light: np.ndarray) -> np.ndarray:
    """RGB sum (K,) of ``light`` (K, 3)."""
    return np.einsum("ij->i", np.abs(light))
