"""Photon tracing: from the lights over diffuse bounces to photon path segments."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .bounds import Bounds
from .errors import NoLightError
from .lights.emissive import EmissiveTriangles
from .lights.light import EMISSION_DIMENSIONS, Light, Particles
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


@dataclass(frozen=True)
class TracedPhotons:
    """What some particles did: their path segments and the flux that the bounce limit cut, (3,) W."""

    segments: Segments
    cut_flux: np.ndarray


class PhotonTracer:
    """Traces particles through ``scene``; distant lights shoot at ``bounds``, which holds scene and discs.

    Attribute ``emitted_flux`` (3,): the radiant flux in W of all lights together. Raises NoLightError when it is zero.
    """

    def __init__(self, scene: Scene, bounds: Bounds, bounces: int):
        self._scene = scene
        self._bounds = bounds
        self._bounces = bounces
        corners = scene.corners
        self._caster = RayCaster(corners)
        self._normals, _ = normals_and_areas(corners)
        self._lights, self._shares, self.emitted_flux = _by_power(scene, corners, bounds)

    def trace(self, particles: int, generator: np.random.Generator) -> TracedPhotons:
        """Follow ``particles`` from emission to absorption; their segments carry the scene's full power together."""
        emitted = self._emit(particles, generator)
        directions, flux = emitted.directions, emitted.flux
        # Lights may lie in a surface: an emissive triangle always does, an area light under a ceiling often.
        origins = emitted.origins + EMISSION_LIFT * self._caster.tolerance * directions
        bounce = np.zeros(particles, np.uint16)
        passages = np.zeros(particles, np.uint16)
        start = emitted.start
        parts, cut = [], np.zeros(3)
        while len(origins):
            hits = self._caster.first_hits(origins, directions)
            ends = self._ends(origins, directions, hits)
            segments, rows = Segments(origins, ends, flux, bounce), np.flatnonzero(hits.triangle >= 0)
            if start is not None:
                shining = start < np.linalg.norm(ends - origins, axis=1)
                begins = origins + start[:, None] * directions
                segments = Segments(begins, ends, flux, bounce).taken(shining)
                rows, start = rows[shining[rows]], None
            parts.append(segments)
            triangle = hits.triangle[rows]
            reflected, passed = self._scatter(flux[rows], triangle, generator)
            ended = (bounce[rows] >= self._bounces) & reflected.any(axis=1)
            ended |= (passages[rows] >= MOST_PASSAGES) & passed.any(axis=1)
            cut += (reflected + passed)[ended].sum(axis=0)
            reflects = reflected.any(axis=1) & ~ended
            alive = reflects | (passed.any(axis=1) & ~ended)
            rows, triangle, reflects = rows[alive], triangle[alive], reflects[alive]
            flux = (reflected + passed)[alive]
            bounce = bounce[rows] + reflects.astype(np.uint16)
            passages = passages[rows] + (~reflects).astype(np.uint16)
            side = self._facing(triangle, directions[rows])
            onward = directions[rows]
            turned = cosine_hemisphere(side[reflects], generator.random((int(reflects.sum()), 2)))
            onward[reflects] = turned
            away = np.where(reflects, self._caster.tolerance, -self._caster.tolerance)[:, None]
            origins, directions = hits.points[rows] + away * side, onward
        return TracedPhotons(Segments.joined(parts), cut)

    def _emit(self, particles: int, generator: np.random.Generator) -> Particles:
        """Particles shared out among the lights by power: systematic sampling, so each count is exact to one."""
        steps = (np.arange(particles) + generator.random()) / particles
        chosen = np.searchsorted(np.cumsum(self._shares)[:-1], steps, side="right")
        counts = np.bincount(chosen, minlength=len(self._lights))
        emitted = []
        for light, share, count in zip(self._lights, self._shares, counts, strict=True):
            if count == 0:
                continue
            sent = light.emit(generator.random((count, EMISSION_DIMENSIONS)), self._bounds)
            # A light's particles carry its whole flux together; weighting by the expected instead of the actual
            # count keeps lights that get no particle in this batch right on average.
            emitted.append(replace(sent, flux=sent.flux * (count / (particles * share))))
        return Particles.joined(emitted)

    def _ends(self, origins, directions, hits: Hits) -> np.ndarray:
        """Segment ends: past the hit by twice the tolerance along the normal, or out of everything."""
        reach = np.linalg.norm(origins - self._bounds.centre, axis=1) + self._bounds.radius
        ends = origins + reach[:, None] * directions
        rows = np.flatnonzero(hits.triangle >= 0)
        onward = directions[rows]
        cosine = np.abs(np.einsum("ij,ij->i", self._normals[hits.triangle[rows]], onward))
        past = 2 * self._caster.tolerance / np.maximum(cosine, GRAZING_COSINE)
        ends[rows] = hits.points[rows] + past[:, None] * onward
        return ends

    def _scatter(self, flux, triangle, generator):
        """Russian roulette between diffuse reflection, straight passage and absorption, (K, 3) W each.

        With f the flux, the probabilities are max|f rho| / max|f| and max|f tau| / max|f|, so a particle's largest
        channel keeps its flux; probabilities that add up to more than one are scaled to one.
        """
        reflectable = flux * self._scene.albedo[triangle]
        passable = flux * self._scene.transmittance[triangle]
        largest = np.maximum(np.abs(flux).max(axis=1), np.finfo(float).tiny)
        reflect = np.abs(reflectable).max(axis=1) / largest
        transmit = np.abs(passable).max(axis=1) / largest
        excess = np.maximum(reflect + transmit, 1.0)
        reflect, transmit = reflect / excess, transmit / excess
        choice = generator.random(len(flux))
        reflects = choice < reflect
        passes = ~reflects & (choice < reflect + transmit)
        with np.errstate(divide="ignore", invalid="ignore"):
            reflected = np.where(reflects[:, None], reflectable / reflect[:, None], 0.0)
            passed = np.where(passes[:, None], passable / transmit[:, None], 0.0)
        return reflected, passed

    def _facing(self, triangle, directions) -> np.ndarray:
        """The triangles' unit normals (K, 3) on the side from which ``directions`` arrive."""
        normals = self._normals[triangle]
        behind = np.einsum("ij,ij->i", normals, directions) > 0
        return np.where(behind[:, None], -normals, normals)


def _by_power(scene: Scene, corners, bounds: Bounds) -> tuple[list[Light], np.ndarray, np.ndarray]:
    """The lights that emit, each one's share (L,) of the particles, and the flux (3,) W of all."""
    lights: list[Light] = list(scene.lights)
    emissive = np.flatnonzero((scene.emission != 0).any(axis=1))
    if len(emissive):
        lights.append(EmissiveTriangles(corners[emissive], scene.emission[emissive]))
    fluxes = np.array([light.flux(bounds) for light in lights]).reshape(-1, 3)
    power = np.abs(fluxes).sum(axis=1)
    shining = np.flatnonzero(power > 0)
    if len(shining) == 0:
        raise NoLightError(
            "Nothing in the scene gives light: add a light, an emissive material or a world that is not black."
        )
    return [lights[i] for i in shining], power[shining] / power[shining].sum(), fluxes[shining].sum(axis=0)
