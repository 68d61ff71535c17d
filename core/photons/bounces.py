"""What particles do between leaving a light and being absorbed: their segments, one generation at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..bounds import Bounds
from ..direct.shadows import MOST_PASSAGES
from ..lights.lamp_rays import towards
from ..lights.light import Particles
from ..rays import Hits, RayCaster
from ..sampling import cosine_hemisphere
from ..segments import Segments
from ..sides import BySide
from ..triangles import dots
from .specular import SpecularSurfaces

#: How many tolerances a particle is moved along its direction before it starts. Lights may lie in a surface: an
#: emissive triangle always does, an area light under a ceiling often.
EMISSION_LIFT = 32

#: How many tolerances behind their hit segments end, along the surface's normal.
REACH_BEHIND = 2

#: The smallest cosine for which a segment is lengthened to reach the tolerance behind its hit.
GRAZING_COSINE = 0.01

#: What Russian roulette does with a particle: reflect it diffusely, spread it evenly on the other side, let it pass
#: straight on, mirror or refract it.
ABSORBED, REFLECTED, SPREAD, PASSED, MIRRORED, REFRACTED = range(6)

#: How many uniform random numbers each hit uses: its fate, and the direction after diffuse reflection.
HIT_DIMENSIONS = 3


@dataclass(frozen=True)
class Passing:
    """What triangles let pass of light ``between`` surfaces and from the world, and of light that comes ``straight``
    from lamps and shining triangles, None: the same; by the side that who receives the light sees."""

    between: BySide
    straight: BySide | None

    def share(self, triangle: np.ndarray, directions: np.ndarray, straight: np.ndarray) -> np.ndarray:
        """The share (K, 3) of light that meets ``triangle`` (K,) along ``directions`` (K, 3), ``straight`` (K,) or not.

        It comes out on the side that its receiver sees.
        """
        share = self.between.met(triangle, -directions)
        if self.straight is None:
            return share
        return np.where(straight[:, None], self.straight.met(triangle, -directions), share)


@dataclass(frozen=True)
class Bounces:
    """Follows particles among the triangles of ``caster``.

    albedo         by the side that light meets
    passing        None when nothing lets light pass straight on and nothing is specular
    translucency   by the side that who receives the light sees, or None
    specular       those that also mirror or refract, or None
    bounds         left by segments that meet nothing
    most           bounces
    direct         whether segments before the first bounce are kept
    """

    caster: RayCaster
    albedo: BySide
    passing: Passing | None
    translucency: BySide | None
    specular: SpecularSurfaces | None
    bounds: Bounds
    most: int
    direct: bool

    def followed(
        self, sent: Particles, first: int, generator: np.random.Generator, near: np.ndarray
    ) -> tuple[Segments, np.ndarray]:
        """All segments of particles from their emission on, and the flux (3,) W that the limits on bounces cut.

        ``sent`` are numbered from ``first`` on; ``near`` (P,) tells which come from lamps or shining triangles.
        """
        origins = sent.origins + EMISSION_LIFT * self.caster.tolerance(sent.origins)[:, None] * sent.directions
        count = len(origins)
        particle = np.arange(first, first + count, dtype=np.uint32)
        caustic = None if self.specular is None else np.zeros(count, bool)
        begun = Segments(origins, origins, sent.flux, np.zeros(count, np.uint16), particle, caustic)
        return self._flown(begun, sent.directions, near, generator, sent.start)

    def resumed(
        self, segments: Segments, straight: np.ndarray, generator: np.random.Generator
    ) -> tuple[Segments, np.ndarray]:
        """The same of particles that fly on from the origins of ``segments``, in their directions, wherever these end.

        ``straight`` (S,) tells which are on their straight way from lamps or shining triangles.
        """
        directions, _ = towards(segments.ends - segments.origins)
        return self._flown(segments, directions, straight, generator)

    def _flown(
        self, begun: Segments, directions, straight: np.ndarray, generator: np.random.Generator, start=None
    ) -> tuple[Segments, np.ndarray]:
        """All segments of particles that leave the origins of the ``begun`` ones, whose ends do not count, and the flux
        that was cut."""
        origins, flux, bounce = begun.origins, begun.flux, begun.bounce
        particle, caustic = begun.particle, begun.caustic
        passages = np.zeros(len(origins), np.uint16)
        parts, cut = [], np.zeros(3)
        while len(origins):
            hits = self.caster.first_hits(origins, directions)
            rows = np.flatnonzero(hits.triangle >= 0)
            segments = Segments(origins, self._ends(origins, directions, hits, rows), flux, bounce, particle, caustic)
            if start is not None:
                segments, flux = _begun(segments, directions, start)
                start = None
            parts.append(segments if self.direct else segments.indirect)

            uniforms = generator.random((len(rows), HIT_DIMENSIONS))
            directions, straight = directions.take(rows, axis=0), straight.take(rows)
            fate, flux, directions = self._meet(
                hits, rows, flux.take(rows, axis=0), directions, straight, uniforms, generator
            )
            limit = np.where(fate == PASSED, passages.take(rows) >= MOST_PASSAGES, bounce.take(rows) >= self.most)
            limit &= fate != ABSORBED
            cut += flux[limit].sum(axis=0)
            alive = np.flatnonzero((fate != ABSORBED) & ~limit)
            rows, fate, flux = rows.take(alive), fate.take(alive), flux.take(alive, axis=0)
            particle, straight = particle.take(rows), straight.take(alive) & (fate == PASSED)
            if caustic is not None:
                caustic = np.where(fate == PASSED, caustic.take(rows), fate >= MIRRORED)
            bounce = bounce.take(rows) + (fate != PASSED).astype(np.uint16)
            passages = passages.take(rows) + (fate == PASSED).astype(np.uint16)
            uniforms = uniforms[:, 1:].take(alive, axis=0)
            origins, directions = self._onward(hits, rows, directions.take(alive, axis=0), fate, uniforms)
        return Segments.joined(parts) if parts else begun, cut

    def _ends(self, origins, directions, hits: Hits, rows) -> np.ndarray:
        """Segment ends: past the hit (``rows`` hit) by twice the tolerance along the normal, or out of everything."""
        ends = np.empty_like(origins)
        onward = directions.take(rows, axis=0)
        cosine = np.abs(dots(self.caster.normals.take(hits.triangle.take(rows), axis=0), onward))
        places = hits.points.take(rows, axis=0)
        past = REACH_BEHIND * self.caster.tolerance(places) / np.maximum(cosine, GRAZING_COSINE)
        ends[rows] = places + past[:, None] * onward
        missed = np.flatnonzero(hits.triangle < 0)
        outward = origins.take(missed, axis=0)
        reach = np.linalg.norm(outward - self.bounds.centre, axis=1) + self.bounds.radius
        ends[missed] = outward + reach[:, None] * directions.take(missed, axis=0)
        return ends

    def _meet(
        self, hits: Hits, rows, flux, directions, straight, uniforms, generator
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What happens to particles at their hits: fates (K,), the flux (K, 3) W that goes on, and directions (K, 3).

        The directions are those after a straight passage, mirror or refraction; diffuse reflection has yet to choose.
        """
        triangle, choice = hits.triangle.take(rows), uniforms[:, 0]
        fates, shares = [ABSORBED, REFLECTED], [self.albedo.met(triangle, directions)]
        if self.passing is not None:
            fates.append(PASSED)
            shares.append(self.passing.share(triangle, directions, straight))
        if self.specular is not None:
            turns = self.specular.turns(triangle, directions, hits.points.take(rows, axis=0), generator)
            fates += [MIRRORED, REFRACTED]
            shares += [turns.mirrored, turns.refracted]
        if self.translucency is not None:
            fates.append(SPREAD)
            shares.append(self.translucency.met(triangle, -directions))
        fate, flux = _roulette(flux, shares, choice)
        fate = np.array(fates, np.uint8).take(fate)
        if self.specular is None:
            return fate, flux, directions
        directions = np.where((fate == MIRRORED)[:, None], turns.mirrored_direction, directions)
        return fate, flux, np.where((fate == REFRACTED)[:, None], turns.refracted_direction, directions)

    def _onward(self, hits: Hits, rows, directions, fate, uniforms) -> tuple[np.ndarray, np.ndarray]:
        """Origins just off the surface, and directions, of the particles that go on."""
        normals = self.caster.normals.take(hits.triangle.take(rows), axis=0)
        facing = -np.copysign(1.0, dots(normals, directions))[:, None] * normals
        places = hits.points.take(rows, axis=0)
        away = self.caster.tolerance(places)
        if self.passing is None and self.translucency is None:
            turned = cosine_hemisphere(facing, uniforms)
        else:
            diffuse, side = fate <= SPREAD, np.where(fate == REFLECTED, 1.0, -1.0)[:, None]
            turned = directions.copy()
            turned[diffuse] = cosine_hemisphere((side * facing)[diffuse], uniforms[diffuse])
            away = away * side[:, 0]
        return places + away[:, None] * facing, turned


def _begun(segments: Segments, directions, start) -> tuple[Segments, np.ndarray]:
    """The segments of particles that shine from ``start`` (R,) on, and the flux (R, 3) that goes on.

    What is blocked before has no segment and no flux.
    """
    shining = start < np.linalg.norm(segments.ends - segments.origins, axis=1)
    begins = segments.origins + start[:, None] * directions
    begun = replace(segments, origins=begins)
    return begun.taken(shining), np.where(shining[:, None], segments.flux, 0.0)


def _roulette(flux: np.ndarray, shares: list[np.ndarray], choice: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Russian roulette over the ``shares`` (K, 3) of what surfaces do: fates (K,) and the flux (K, 3) W that goes on.

    With f the flux, fate i has the probability max|f s_i| / max|f|, so that a particle's largest channel keeps its
    flux; probabilities that add up to more than one are scaled to one. Fates count from 1, 0 is to be absorbed.
    ``choice`` (K,) are uniform numbers.
    """
    largest = np.maximum(_largest(flux), np.finfo(float).tiny)
    going = [flux * share for share in shares]
    chances = [_largest(part) / largest for part in going]
    excess = np.maximum(sum(chances), 1.0)
    chances = [chance / excess for chance in chances]
    fate, kept, probability = np.zeros(len(flux), np.uint8), going[0], np.ones(len(flux))
    for number in reversed(range(len(shares))):
        # From the last one down, so that the first whose running sum exceeds the choice is the one that stays.
        chosen = choice < sum(chances[: number + 1])
        fate[chosen] = number + 1
        probability = np.where(chosen, chances[number], probability)
        kept = np.where(chosen[:, None], going[number], kept)
    return fate, kept / probability[:, None]


def _largest(rgb: np.ndarray) -> np.ndarray:
    """The largest absolute channel (K,); a reduction along so short an axis would be slow."""
    size = np.abs(rgb)
    return np.maximum(np.maximum(size[:, 0], size[:, 1]), size[:, 2])
