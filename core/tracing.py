"""Photon tracing: from the lights over diffuse bounces to photon path segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .bounds import Bounds
from .emission import Emission
from .rays import Hits, RayCaster
from .sampling import cosine_hemisphere
from .scene import Scene
from .segments import Segments
from .triangles import normals_and_areas

#: Surfaces that one particle may pass straight through, all together, before it is given up.
MOST_PASSAGES = 1024

#: How many tolerances a particle is moved along its direction before it starts.
EMISSION_LIFT = 4

#: The smallest cosine for which a segment is lengthened to reach the tolerance behind its hit.
GRAZING_COSINE = 0.01

#: What Russian roulette does with a particle.
ABSORBED, REFLECTED, PASSED = 0, 1, 2


@dataclass(frozen=True)
class TracedPhotons:
    """What some particles did: their path segments and the flux that the bounce limit cut, (3,) W."""

    segments: Segments
    cut_flux: np.ndarray


class PhotonTracer:
    """Traces particles through ``scene`` with its ``caster``; distant lights shoot at ``bounds`` (scene and discs).

    ``direct`` tells whether the segments of direct light (bounce 0) are kept, which shadow rays can replace.

    Attribute ``emitted_flux`` (3,): the radiant flux in W of all lights together. Raises NoLightError when it is zero.
    """

    def __init__(self, scene: Scene, caster: RayCaster, bounds: Bounds, bounces: int, direct: bool = True):
        self._bounds = bounds
        self._bounces = bounces
        self._direct = direct
        self._albedo = scene.albedo
        # Most scenes let no light pass, and then pay nothing for it.
        self._transmittance = scene.transmittance if scene.transmittance.any() else None
        self._caster = caster
        self._normals, _ = normals_and_areas(scene.corners)
        self._emission = Emission(scene, bounds)
        self.emitted_flux = self._emission.flux

    def trace(self, particles: int, generator: np.random.Generator) -> TracedPhotons:
        """Follow ``particles`` from emission to absorption; their segments carry the scene's full power together."""
        emitted = self._emission.emit(particles, generator)
        directions, flux, start = emitted.directions, emitted.flux, emitted.start
        # Lights may lie in a surface: an emissive triangle always does, an area light under a ceiling often.
        origins = emitted.origins + EMISSION_LIFT * self._caster.tolerance * directions
        bounce, passages = np.zeros(particles, np.uint16), np.zeros(particles, np.uint16)
        parts, cut = [], np.zeros(3)
        while len(origins):
            hits = self._caster.first_hits(origins, directions)
            rows = np.flatnonzero(hits.triangle >= 0)
            segments = Segments(origins, self._ends(origins, directions, hits, rows), flux, bounce)
            if start is not None:
                shining = start < np.linalg.norm(segments.ends - origins, axis=1)
                begins = origins + start[:, None] * directions
                segments = Segments(begins, segments.ends, flux, bounce).taken(shining)
                rows, start = rows[shining[rows]], None
            parts.append(segments if self._direct else segments.taken(np.flatnonzero(segments.bounce)))

            fate, flux = self._roulette(flux.take(rows, axis=0), hits.triangle.take(rows), generator)
            limit = (fate == REFLECTED) & (bounce.take(rows) >= self._bounces)
            limit |= (fate == PASSED) & (passages.take(rows) >= MOST_PASSAGES)
            cut += flux[limit].sum(axis=0)
            alive = np.flatnonzero((fate != ABSORBED) & ~limit)
            rows, fate, flux = rows.take(alive), fate.take(alive), flux.take(alive, axis=0)
            bounce = bounce.take(rows) + (fate == REFLECTED).astype(np.uint16)
            passages = passages.take(rows) + (fate == PASSED).astype(np.uint16)
            origins, directions = self._onward(hits, rows, directions.take(rows, axis=0), fate, generator)
        return TracedPhotons(Segments.joined(parts), cut)

    def _ends(self, origins, directions, hits: Hits, rows) -> np.ndarray:
        """Segment ends: past the hit (``rows`` hit) by twice the tolerance along the normal, or out of everything."""
        ends = np.empty_like(origins)
        onward = directions.take(rows, axis=0)
        cosine = np.abs(_dot(self._normals.take(hits.triangle.take(rows), axis=0), onward))
        past = 2 * self._caster.tolerance / np.maximum(cosine, GRAZING_COSINE)
        ends[rows] = hits.points.take(rows, axis=0) + past[:, None] * onward
        missed = np.flatnonzero(hits.triangle < 0)
        outward = origins.take(missed, axis=0)
        reach = np.linalg.norm(outward - self._bounds.centre, axis=1) + self._bounds.radius
        ends[missed] = outward + reach[:, None] * directions.take(missed, axis=0)
        return ends

    def _roulette(self, flux, triangle, generator) -> tuple[np.ndarray, np.ndarray]:
        """Russian roulette over what each surface does: the fates (K,) and the flux (K, 3) W that goes on.

        With f the flux, reflection has the probability max|f rho| / max|f| and straight passage max|f tau| / max|f|,
        so a particle's largest channel keeps its flux; probabilities that add up to more than one are scaled to one.
        """
        largest = np.maximum(_largest(flux), np.finfo(float).tiny)
        reflected = flux * self._albedo.take(triangle, axis=0)
        reflect = _largest(reflected) / largest
        choice = generator.random(len(flux))
        if self._transmittance is None:
            reflect = np.minimum(reflect, 1.0)
            fate = (choice < reflect).astype(np.uint8)
            return fate, reflected / np.where(reflect > 0, reflect, 1.0)[:, None]
        passed = flux * self._transmittance.take(triangle, axis=0)
        transmit = _largest(passed) / largest
        excess = np.maximum(reflect + transmit, 1.0)
        reflect, transmit = reflect / excess, transmit / excess
        fate = np.where(choice < reflect, REFLECTED, np.where(choice < reflect + transmit, PASSED, ABSORBED))
        probability = np.where(fate == REFLECTED, reflect, transmit)
        going = np.where((fate == REFLECTED)[:, None], reflected, passed)
        return fate.astype(np.uint8), going / np.where(probability > 0, probability, 1.0)[:, None]

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


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", a, b)


def _largest(rgb: np.ndarray) -> np.ndarray:
    """The largest absolute channel (K,); a reduction along so short an axis would be slow."""
    size = np.abs(rgb)
    return np.maximum(np.maximum(size[:, 0], size[:, 1]), size[:, 2])
