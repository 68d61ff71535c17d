"""All lights of a scene as one source: particles are shared out by power, or where a guide has learnt to aim."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..bounds import Bounds
from ..errors import NoLightError
from ..lights.emissive import EmissiveTriangles
from ..lights.light import Light, Particles, is_world
from ..scene import Scene
from ..sides import any_side
from .distant_light import Beside, Through
from .emission_guide import Draws, EmissionGuide


def lights_of(scene: Scene) -> list[Light]:
    """The lamps and the world of ``scene``, and all its emissive triangles as one light more."""
    emissive = np.flatnonzero(any_side(scene.emission))
    if len(emissive) == 0:
        return list(scene.lights)
    return [
        *scene.lights,
        EmissiveTriangles(scene.vertices[scene.triangles[emissive]], scene.emission[..., emissive, :], emissive),
    ]


class Emission:
    """The lamps, the world and the emissive triangles of ``scene``; distant ones shoot at ``bounds``.

    Attribute ``flux`` (3,): radiant flux in W of all together; ``near`` (J,): whether each light that shines is a lamp
    or shining triangles, and not the world; ``natural``: the guide that has learnt nothing, by power and, for a half
    where it is known, by what is ``seen`` of each light (J,), see light_shares.py. What distant lights send through a
    small ``box`` is apart from the rest, see distant_light.py. Raises NoLightError when nothing emits.
    """

    def __init__(self, scene: Scene, bounds: Bounds, seen: np.ndarray | None = None, box: Bounds | None = None):
        self._bounds = bounds
        lights = lights_of(scene)
        near = np.array([not is_world(light) for light in lights], bool)
        if box is not None:
            far = [getattr(light, "distant", False) for light in lights]
            beside = [Beside(light, box) for light, distant in zip(lights, far, strict=True) if distant]
            lights = [Through(light, box) if distant else light for light, distant in zip(lights, far, strict=True)]
            lights += beside
            near = np.append(near, near[far])
            seen = None if seen is None else np.append(seen, np.zeros(len(beside)))
        fluxes = np.array([light.flux(bounds) for light in lights]).reshape(-1, 3)
        power = np.abs(fluxes).sum(axis=1)
        shining = np.flatnonzero(power > 0)
        if len(shining) == 0:
            raise NoLightError(
                "Nothing in the scene gives light: add a light, an emissive material or a world that is not black."
            )
        self.flux = fluxes[shining].sum(axis=0)
        self._lights = [lights[i] for i in shining]
        self.near = near[shining]
        shares = power[shining] / power[shining].sum()
        if seen is not None and seen[shining].any():
            shares = 0.5 * (shares + seen[shining] / seen[shining].sum())
        self.natural = EmissionGuide.by_shares(shares)

    def emit(self, draws: Draws) -> Particles:
        """The particles of ``draws``, one a row; they carry the whole flux together.

        Weighting by a light's expected instead of its actual count keeps lights that get no particle right on average.
        """
        emitted = []
        ends = np.searchsorted(draws.light, np.arange(len(self._lights)), side="right")
        for number, (light, end) in enumerate(zip(self._lights, ends, strict=True)):
            rows = slice(ends[number - 1] if number else 0, end)
            count = rows.stop - rows.start
            if count:
                sent = light.emit(draws.uniforms[rows], self._bounds)
                emitted.append(replace(sent, flux=sent.flux * (count * draws.weight[rows, None])))
        return Particles.joined(emitted)
