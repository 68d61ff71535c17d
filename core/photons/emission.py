"""All lights of a scene as one source: particles are shared out by power and by what places see of each light."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain

import numpy as np

from ..bounds import Bounds
from ..errors import NoLightError
from ..lights.emissive import EmissiveTriangles
from ..lights.light import EMISSION_DIMENSIONS, Light, Particles, is_world
from ..sampling import BELOW_ONE
from ..scene import Scene
from ..sides import any_side
from .distant_light import Between, Shell, shells_of


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

    Attribute ``flux`` (3,): radiant flux in W of all together; ``near`` (P,): whether each part is of a lamp or of
    shining triangles, and not of the world; ``shares`` (P,) of the particles, by power and, for a half where it is
    known, by what is ``seen`` of each light (J,), see light_shares.py. Lights are one part each. But of distant ones,
    what goes through a small ``box`` and through each shell around it is a part, and these share alike, see
    distant_light.py. Raises NoLightError when nothing emits.
    """

    def __init__(self, scene: Scene, bounds: Bounds, seen: np.ndarray | None = None, box: Bounds | None = None):
        self._bounds = bounds
        lights = lights_of(scene)
        fluxes = np.array([light.flux(bounds) for light in lights]).reshape(-1, 3)
        power = np.abs(fluxes).sum(axis=1)
        shining = np.flatnonzero(power > 0)
        if len(shining) == 0:
            raise NoLightError(
                "Nothing in the scene gives light: add a light, an emissive material or a world that is not black."
            )
        self.flux = fluxes[shining].sum(axis=0)
        shares = power[shining] / power[shining].sum()
        if seen is not None and seen[shining].any():
            shares = 0.5 * (shares + seen[shining] / seen[shining].sum())
        shells = [] if box is None else shells_of(box, bounds)
        parts = [_parts(lights[row], shells) for row in shining]
        count = np.array([len(each) for each in parts])
        self._lights = list(chain(*parts))
        self.near = np.repeat([not is_world(lights[row]) for row in shining], count)
        self.shares = np.repeat(shares / count, count)

    def emit(self, particles: int, generator: np.random.Generator) -> tuple[Particles, np.ndarray]:
        """So many ``particles``, which carry the whole flux together, and which part (P,) each came from, ascending.

        They are shared out by systematic sampling, so that each part's count is exact to one. Of each part the first
        of the uniform numbers is stratified and ascends: bright places gain, and tables are looked up in order.
        Weighting by a part's expected instead of its actual count keeps those that get no particle right on average.
        """
        sums, offset = np.cumsum(self.shares), generator.random()
        uniforms = generator.random((particles, EMISSION_DIMENSIONS))
        light = np.searchsorted(sums[:-1], (np.arange(particles) + offset) / particles, side="right")
        count = np.bincount(light, minlength=len(self.shares))
        begin = np.cumsum(count) - count
        rank = np.arange(particles) - begin.take(light)
        uniforms[:, 0] = np.minimum((rank + uniforms[:, 0]) / count.take(light), BELOW_ONE)
        emitted = []
        for number in np.flatnonzero(count):
            rows = slice(begin[number], begin[number] + count[number])
            sent = self._lights[number].emit(uniforms[rows], self._bounds)
            emitted.append(replace(sent, flux=sent.flux * (count[number] * (1.0 / (particles * self.shares[number])))))
        return Particles.joined(emitted), light


def _parts(light: Light, shells: list[Shell]) -> list[Light]:
    """What the ``light`` sends through each of the ``shells``, if there are any and it is a distant one."""
    distant = bool(shells) and getattr(light, "distant", False)
    return [Between(light, *shell) for shell in shells] if distant else [light]
