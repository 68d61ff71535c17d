"""Photon tracing: from the lights over reflections and refractions to photon path segments."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import numpy as np

from ..bounds import Bounds
from ..compiled import kernels
from ..direct.shadows import MOST_PASSAGES
from ..rays import Hits, RayCaster
from ..sampling import cosine_hemisphere
from ..scene import Scene
from ..segments import Segments
from .diffuse_bounces import GRAZING_COSINE, REACH_BEHIND, DiffuseBounces
from .emission import Emission
from .emission_guide import Draws, EmissionGuide
from .specular import SpecularSurfaces

#: How many tolerances a particle is moved along its direction before it starts.
EMISSION_LIFT = 4

#: What Russian roulette does with a particle: reflect it diffusely, let it pass straight on, mirror or refract it.
ABSORBED, REFLECTED, PASSED, MIRRORED, REFRACTED = range(5)


@dataclass(frozen=True)
class TracedPhotons:
    """What some particles did: their path segments, the flux that the bounce limit cut, (3,) W, and their ``draws``."""

    segments: Segments
    cut_flux: np.ndarray
    draws: Draws


class PhotonTracer:
    """Traces particles through ``scene`` with its ``caster``; distant lights shoot at ``bounds`` (scene and discs).

    ``direct`` tells whether the segments of direct light (bounce 0) are kept, which shadow rays can replace.

    Attributes: ``emitted_flux`` (3,), the radiant flux in W of all lights together, and ``guide``, which aims them; at
    first by power alone. Raises NoLightError when nothing emits.
    """

    def __init__(self, scene: Scene, caster: RayCaster, bounds: Bounds, bounces: int, direct: bool = True):
        self._bounds = bounds
        self._bounces = bounces
        self._direct = direct
        # A copy, since what a scene is made from may be read-only, which the kernels do not take.
        self._albedo = np.array(scene.albedo)
        # Most scenes let no light pass and have no specular surfaces, and then pay nothing for them.
        self._specular = SpecularSurfaces(scene.specular, scene.corners) if scene.specular is not None else None
        passes = self._specular is not None or scene.transmittance.any()
        self._transmittance = scene.transmittance if passes else None
        self._caster = caster
        self._normals = caster.normals
        # Indirect light all comes from surfaces: what passes beside them need not be emitted.
        self._emission = Emission(
            scene, bounds if direct else scene.bounds.expanded(2 * EMISSION_LIFT * caster.tolerance)
        )
        self.emitted_flux = self._emission.flux
        self.guide = self._emission.by_power

    def guided(self, guide: EmissionGuide) -> PhotonTracer:
        """The same tracer, but with the lights aimed by ``guide``."""
        tracer = copy(self)
        tracer.guide = guide
        return tracer

    def trace(self, particles: int, generator: np.random.Generator, first: int = 0) -> TracedPhotons:
        """Follow ``particles`` from emission to absorption; their segments carry the scene's full power together.

        The particles are numbered from ``first`` on.
        """
        draws = self.guide.draws(particles, generator)
        emitted = self._emission.emit(draws)
        directions, flux, start = emitted.directions, emitted.flux, emitted.start
        # Lights may lie in a surface: an emissive triangle always does, an area light under a ceiling often.
        origins = emitted.origins + EMISSION_LIFT * self._caster.tolerance * directions
        bounce, passages = np.zeros(particles, np.uint16), np.zeros(particles, np.uint16)
        particle = np.arange(first, first + particles, dtype=np.uint32)
        compiled = kernels(saving=0.0) if self._transmittance is None else None
        parts, cut = [], np.zeros(3)
        while len(origins) and (compiled is None or start is not None):
            hits = self._caster.first_hits(origins, directions)
            rows = np.flatnonzero(hits.triangle >= 0)
            segments = Segments(origins, self._ends(origins, directions, hits, rows), flux, bounce, particle)
            if start is not None:
                shining = start < np.linalg.norm(segments.ends - origins, axis=1)
                begins = origins + start[:, None] * directions
                segments = Segments(begins, segments.ends, flux, bounce, particle).taken(shining)
                rows, start = rows[shining[rows]], None
            parts.append(segments if self._direct else segments.taken(np.flatnonzero(segments.bounce)))

            directions = directions.take(rows, axis=0)
            fate, flux, directions = self._meet(hits, rows, flux.take(rows, axis=0), directions, generator)
            limit = np.where(fate == PASSED, passages.take(rows) >= MOST_PASSAGES, bounce.take(rows) >= self._bounces)
            limit &= fate != ABSORBED
            cut += flux[limit].sum(axis=0)
            alive = np.flatnonzero((fate != ABSORBED) & ~limit)
            rows, fate, flux = rows.take(alive), fate.take(alive), flux.take(alive, axis=0)
            particle = particle.take(rows)
            bounce = bounce.take(rows) + (fate != PASSED).astype(np.uint16)
            passages = passages.take(rows) + (fate == PASSED).astype(np.uint16)
            origins, directions = self._onward(hits, rows, directions.take(alive, axis=0), fate, generator)
        if len(origins):
            bounces = DiffuseBounces(compiled, self._caster, self._normals, self._albedo, self._bounds)
            most = self._bounces - int(bounce[0])
            rest, left = bounces.followed(origins, directions, flux, bounce, particle, most, generator)
            if not self._direct and bounce[0] == 0:
                rest[0] = rest[0].taken(slice(0))
            parts, cut = parts + rest, cut + left
        return TracedPhotons(Segments.joined(parts), cut, draws)

    def _ends(self, origins, directions, hits: Hits, rows) -> np.ndarray:
        """Segment ends: past the hit (``rows`` hit) by twice the tolerance along the normal, or out of everything."""
        ends = np.empty_like(origins)
        onward = directions.take(rows, axis=0)
        cosine = np.abs(_dot(self._normals.take(hits.triangle.take(rows), axis=0), onward))
        past = REACH_BEHIND * self._caster.tolerance / np.maximum(cosine, GRAZING_COSINE)
        ends[rows] = hits.points.take(rows, axis=0) + past[:, None] * onward
        missed = np.flatnonzero(hits.triangle < 0)
        outward = origins.take(missed, axis=0)
        reach = np.linalg.norm(outward - self._bounds.centre, axis=1) + self._bounds.radius
        ends[missed] = outward + reach[:, None] * directions.take(missed, axis=0)
        return ends

    def _meet(self, hits: Hits, rows, flux, directions, generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What happens to particles at their hits: fates (K,), the flux (K, 3) W that goes on, and directions (K, 3).

        The directions are those after a straight passage, mirror or refraction; diffuse reflection has yet to choose.
        """
        triangle = hits.triangle.take(rows)
        shares = [self._albedo.take(triangle, axis=0)]
        if self._transmittance is None:
            return *_roulette(flux, shares, generator), directions
        shares.append(self._transmittance.take(triangle, axis=0))
        if self._specular is None:
            return *_roulette(flux, shares, generator), directions
        turns = self._specular.turns(triangle, directions, hits.points.take(rows, axis=0), generator)
        fate, flux = _roulette(flux, [*shares, turns.mirrored, turns.refracted], generator)
        directions = np.where((fate == MIRRORED)[:, None], turns.mirrored_direction, directions)
        return fate, flux, np.where((fate == REFRACTED)[:, None], turns.refracted_direction, directions)

    def _onward(self, hits: Hits, rows, directions, fate, generator) -> tuple[np.ndarray, np.ndarray]:
        """Origins just off the surface, and directions, of the particles that go on."""
        normals = self._normals.take(hits.triangle.take(rows), axis=0)
        facing = -np.copysign(1.0, _dot(normals, directions))[:, None] * normals
        if self._transmittance is None:
            away, turned = self._caster.tolerance, cosine_hemisphere(facing, generator.random((len(rows), 2)))
        else:
            reflects = fate == REFLECTED
            turned = directions.copy()
            turned[reflects] = cosine_hemisphere(facing[reflects], generator.random((int(reflects.sum()), 2)))
            away = np.where(reflects, self._caster.tolerance, -self._caster.tolerance)[:, None]
        return hits.points.take(rows, axis=0) + away * facing, turned


def _roulette(flux: np.ndarray, shares: list[np.ndarray], generator) -> tuple[np.ndarray, np.ndarray]:
    """Russian roulette over the ``shares`` (K, 3) of what surfaces do: fates (K,) and the flux (K, 3) W that goes on.

    With f the flux, fate i has the probability max|f s_i| / max|f|, so that a particle's largest channel keeps its
    flux; probabilities that add up to more than one are scaled to one. Fates count from 1, 0 is to be absorbed.
    """
    largest = np.maximum(_largest(flux), np.finfo(float).tiny)
    going = [flux * share for share in shares]
    chances = [_largest(part) / largest for part in going]
    excess = np.maximum(sum(chances), 1.0)
    chances = [chance / excess for chance in chances]
    choice = generator.random(len(flux))
    fate, kept, probability = np.zeros(len(flux), np.uint8), going[0], np.ones(len(flux))
    for number in reversed(range(len(shares))):
        # From the last one down, so that the first whose running sum exceeds the choice is the one that stays.
        chosen = choice < sum(chances[: number + 1])
        fate[chosen] = number + 1
        probability = np.where(chosen, chances[number], probability)
        kept = np.where(chosen[:, None], going[number], kept)
    return fate, kept / probability[:, None]


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", a, b)


def _largest(rgb: np.ndarray) -> np.ndarray:
    """The largest absolute channel (K,); a reduction along so short an axis would be slow."""
    size = np.abs(rgb)
    return np.maximum(np.maximum(size[:, 0], size[:, 1]), size[:, 2])
