"""Light that surrounds a point: a world, shining triangles. Rays are aimed at it, and go where light was found.

Both kinds of rays are weighed by the balance heuristic (Veach and Guibas 1995), so that neither a small bright window
nor a lamp that touches the point is noisy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..lights.light import Surroundings, met_among
from ..rays import Hits
from .direction_guide import SIDE, DirectionChoice, Sightings, cells
from .low_discrepancy import nets
from .nearby_lamps import NearbyLamps
from .round_sums import RoundSums, batches, net_means
from .shadows import Shadows
from .spots import Spots
from .triangle_choice import TriangleChoice

#: Of reflected light: what halves of the photons that it comes from differ by, in so many ways that tell nothing of
#: each other.
CONTRASTS = 7


class Reflections(Protocol):
    """What surfaces reflect towards rays that meet them by chance."""

    def sent(
        self,
        points: np.ndarray,
        directions: np.ndarray,
        rows: np.ndarray,
        hits: Hits,
        group: np.ndarray,
        nearby: NearbyLamps | None,
        generator: np.random.Generator,
    ) -> np.ndarray:
        """Radiosity (K, 10) W/m^2 of what ``rows`` (K,) of rays met at the K ``hits``: RGB, and by how much that is off
        with each of some CONTRASTS of photons, RGB sum.

        The rays go from ``points`` (R, 3) m along unit ``directions`` (R, 3); rays that are followed on take their
        random numbers from ``generator``, and aim at the lamps ``nearby`` as ``group`` (R,) knows them.
        """
        ...


@dataclass(frozen=True)
class Look:
    """What it takes to look for light all around K ``spots``.

    guide      moves rays by chance to where light is; None: they follow the cosine
    generator  of random numbers
    seen       a list to which Sightings are added; None when nothing is learnt any more
    aims       how points choose what to aim at, of lights that they know how to aim at better, by their identities
    nearby     aims at lamps from places near the points, of groups from number ``first`` on; None without any
    """

    spots: Spots
    guide: DirectionChoice | None
    generator: np.random.Generator
    seen: list[Sightings] | None
    aims: dict[int, TriangleChoice]
    nearby: NearbyLamps | None
    first: int

    def saw(self, row, place, light, chance, density, aimed) -> None:
        """Let it be learnt what rays of the spots ``row`` (R,) saw in ``place`` (R,), see :class:`.Sightings`.

        By the cosine alone they would have been sent with the density ``chance`` (R,), aimed at the light with
        ``aimed`` (R,), and both kinds of rays together were with ``density`` (R,).
        """
        self.seen.append(Sightings(row, place, light, chance / density, (aimed + chance) / density))


class SurroundingLight:
    """Irradiance from ``lights``, by ``rays`` (a power of two) in a round to each of them and ``rays`` by chance.

    Surfaces farther than ``reach`` metres do not shade a point from the world. Attribute ``lit``: whether there are
    lights; ``gathers``: whether rays by chance also bring what surfaces reflect.
    """

    def __init__(self, lights: Sequence[Surroundings], shadows: Shadows, reach: float, rays: int):
        self._lights, self._shadows, self._reach = lights, shadows, reach
        self._rays, self._chances = rays, rays
        self._distant = all(light.distant for light in lights)
        self._reflected: Reflections | None = None
        self.lit, self.gathers = bool(lights), False

    def gather(self, reflected: Reflections, rays: int) -> None:
        """Let ``rays`` rays by chance (a power of two) in a round bring ``reflected`` light from now on."""
        self._reflected, self._chances, self.gathers = reflected, rays, True

    @property
    def rays_per_round(self) -> int:
        """Rays from each point in a round."""
        if not (self.lit or self.gathers):
            return 0
        return self._chances + self._rays * sum(light.aimed for light in self._lights)

    def cast(self, look: Look, rounds: np.ndarray, direct: RoundSums, reflected: RoundSums, spread: RoundSums) -> None:
        """Add to the sums of the K spots of ``look`` what ``rounds`` (K,) rounds of rays from each of them find.

        ``spread`` sums up by how much the reflected light is off with each of the CONTRASTS, RGB sum.
        """
        aimed = [light for light in self._lights if light.aimed]
        for batch in batches(rounds):
            spot, total = batch.spot, 0.0
            count, chances = batch.size * self._rays, batch.size * self._chances
            row = np.repeat(spot, count if aimed else 0)
            spots = look.spots.taken(row)
            for light in aimed:
                found = self._aimed(light, look, row, spots, nets(count, len(spot), look.generator))
                total = total + net_means(found, count)
            found, sent = self._by_chance(look, np.repeat(spot, chances), nets(chances, len(spot), look.generator))
            if self.lit:
                direct.add(batch, total + net_means(found, chances))
            if sent is not None:
                means = net_means(sent, chances)
                reflected.add(batch, means[:, :3])
                spread.add(batch, means[:, 3:])

    @property
    def _ratio(self) -> float:
        """Rays by chance over those that are aimed at one light."""
        return self._chances / self._rays

    def _aimed(self, light: Surroundings, look: Look, row: np.ndarray, spots: Spots, uniforms) -> np.ndarray:
        """What rays from ``spots`` (R), which are the look's ``row`` (R,), bring that ``light`` chooses: W/m^2 (R, 3),
        as far as rays by chance do not bring it."""
        guide, aim = look.guide, look.aims.get(id(light))
        if aim is None:
            rays = light.shadow_rays(spots.points, uniforms)
        else:
            rays, column = aim.shadow_rays(row, spots.points, uniforms)
        cosine = np.einsum("ij,ij->i", spots.normals, rays.directions)
        rows = np.flatnonzero((cosine > 0) & rays.shines & spots.before(rays.directions))
        directions, cosine = rays.directions[rows], cosine[rows]
        through = self._shadows.of(light).transmitted(spots.points[rows], directions, rays.distances[rows])
        arriving = rays.radiance[rows] * through * cosine[:, None]
        if aim is not None:
            aim.learn(row, column, rows, arriving, rays.density[rows])
        # Densities per ray by chance.
        density, chance = rays.density[rows] / self._ratio, cosine / np.pi
        guided = chance
        if guide is not None or look.seen is not None:
            place = spots.group[rows] * (SIDE * SIDE) + cells(spots.taken(rows).uniforms(directions))
            guided = chance if guide is None else chance * guide.density[place]
        found = np.zeros((len(spots), 3))
        found[rows] = arriving / (self._ratio * (density + guided))[:, None]
        if look.seen is not None:
            look.saw(row[rows], place, _strength(arriving) / (density + chance), chance, density + guided, density)
        return found

    def _by_chance(self, look: Look, row: np.ndarray, uniforms) -> tuple[np.ndarray, np.ndarray | None]:
        """What rays of the look's spots ``row`` (R,) bring along the cosine, or where the guide moves them: W/m^2 of
        the lights (R, 3), and what surfaces reflect, with its contrasts, (R, 10), or None."""
        spots, factor = look.spots.taken(row), np.ones(len(row))
        if look.guide is not None:
            uniforms, factor = look.guide.warped(spots.group, uniforms)
        directions, cosine = spots.directions(uniforms)
        chance = cosine / np.pi
        found = np.zeros((len(spots), 3))
        sent = np.zeros((len(spots), 3 + CONTRASTS)) if self.gathers else None
        plain, densities = np.zeros(len(spots)), np.zeros(len(spots))
        before = spots.before(directions)
        for rows, density, radiance in self._met(look, row, spots, directions, sent):
            density = density / self._ratio
            arriving = radiance * cosine[rows, None]
            found[rows] += arriving / (density + chance[rows] * factor[rows])[:, None]
            if look.seen is not None:
                plain[rows] += _strength(arriving) / (density + chance[rows])
                densities[rows] += density
        if before is not True:
            for part in (found, plain, sent):
                if part is not None:
                    part[~before] = 0.0
        if look.seen is not None:
            if sent is not None:
                plain += np.einsum("ij->i", sent[:, :3])
            place = spots.group * (SIDE * SIDE) + cells(uniforms)
            look.saw(row, place, plain, chance, densities + chance * factor, densities)
        if sent is not None:
            sent /= factor[:, None]
        return found, sent

    def _met(self, look: Look, row: np.ndarray, spots: Spots, directions: np.ndarray, sent: np.ndarray | None):
        """For each light: rows (K,) of rays, the density (K,) of aiming there, and the radiance (K, 3) that arrives.

        The radiosity of surfaces is added to ``sent`` (R, 10), unless that is None.
        """
        points = spots.points
        if self._distant and sent is None:
            share = self._shadows.between.transmitted(points, directions, np.full(len(points), self._reach))
            rows = np.flatnonzero(share.any(axis=1))
            nothing = np.full(len(rows), -1)
            for light in self._lights:
                radiance, density = light.met(points[rows], directions[rows], nothing, None)
                yield rows, density, radiance * share[rows]
            return
        for surfaces, lights in self._shadows.ways(self._lights):
            for layer, (rows, hits, share) in enumerate(surfaces.met(points, directions, self._reach)):
                for light, mine, radiance, density in met_among(lights, points, directions, rows, hits):
                    at = rows.take(mine)
                    if id(light) in look.aims:
                        density = density * look.aims[id(light)].factor(row[at], hits.triangle[mine])
                    yield at, density, radiance * share[mine]
                if sent is not None:
                    group = spots.group + look.first
                    more = self._reflected.sent(points, directions, rows, hits, group, look.nearby, look.generator)
                    if layer:
                        sent[rows] += in_part(more, share)
                    else:
                        sent += more
            # Reflected light comes the first of these ways alone.
            sent = None


def in_part(light: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Of ``light`` (K, 10), which becomes that, the ``share`` (K, 3); of its contrasts what remains of the RGB sum."""
    colour = light[:, :3]
    before = _strength(colour)
    colour *= share
    light[:, 3:] *= (_strength(colour) / np.maximum(before, np.finfo(float).tiny))[:, None]
    return light


def _strength(light: np.ndarray) -> np.ndarray:
    """RGB sum (K,) of ``light`` (K, 3)."""
    return np.einsum("ij->i", np.abs(light))
