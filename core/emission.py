"""All lights of a scene as one source: particles are shared out by power."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .bounds import Bounds
from .errors import NoLightError
from .lights.emissive import EmissiveTriangles
from .lights.light import EMISSION_DIMENSIONS, Light, Particles
from .scene import Scene


def lights_of(scene: Scene) -> list[Light]:
    """The lamps and the world of ``scene``, and all its emissive triangles as one light more."""
    emissive = np.flatnonzero((scene.emission != 0).any(axis=1))
    if len(emissive) == 0:
        return list(scene.lights)
    return [*scene.lights, EmissiveTriangles(scene.corners[emissive], scene.emission[emissive], emissive)]


class Emission:
    """The lamps, the world and the emissive triangles of ``scene``; distant ones shoot at ``bounds``.

    Attribute ``flux`` (3,): radiant flux in W of all together. Raises NoLightError when nothing emits.
    """

    def __init__(self, scene: Scene, bounds: Bounds):
        self._bounds = bounds
        lights = lights_of(scene)
        fluxes = np.array([light.flux(bounds) for light in lights]).reshape(-1, 3)
        power = np.abs(fluxes).sum(axis=1)
        shining = np.flatnonzero(power > 0)
        if len(shining) == 0:
            raise NoLightError(
                "Nothing in the scene gives light: add a light, an emissive material or a world that is not black."
            )
        self._lights = [lights[i] for i in shining]
        self._shares = power[shining] / power[shining].sum()
        self.flux = fluxes[shining].sum(axis=0)

    def emit(self, particles: int, generator: np.random.Generator) -> Particles:
        """``particles`` that carry the whole flux together, by systematic sampling: each light's count is exact to one.

        Weighting by a light's expected instead of its actual count keeps lights that get no particle right on average.
        """
        steps = (np.arange(particles) + generator.random()) / particles
        chosen = np.searchsorted(np.cumsum(self._shares)[:-1], steps, side="right")
        counts = np.bincount(chosen, minlength=len(self._lights))
        emitted = []
        for light, share, count in zip(self._lights, self._shares, counts, strict=True):
            if count:
                sent = light.emit(generator.random((count, EMISSION_DIMENSIONS)), self._bounds)
                emitted.append(replace(sent, flux=sent.flux * (count / (particles * share))))
        return Particles.joined(emitted)
