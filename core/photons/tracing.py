"""Photon tracing: from the lights over reflections and refractions to photon path segments."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from ..bounds import Bounds
from ..rays import RayCaster
from ..scene import Scene
from ..segments import Segments
from ..sides import BySide
from .bounces import EMISSION_LIFT, Bounces, Passing
from .emission import Emission
from .specular import SpecularSurfaces


@dataclass(frozen=True)
class TracedPhotons:
    """What P particles did: their path segments, the flux that the bounce limit cut, (3,) W, and which ``lights`` (P,)
    they came from, as the tracer numbers them."""

    segments: Segments
    cut_flux: np.ndarray
    lights: np.ndarray


class PhotonTracer:
    """Traces particles through ``scene`` with its ``caster``; distant lights shoot at ``bounds`` (scene and discs).

    ``direct`` tells whether the segments of direct light (bounce 0) are kept, which shadow rays can replace; ``seen``
    (J,) what places see of each light, see light_shares.py, and ``box`` where most of them are, see distant_light.py.

    Attribute ``emitted_flux`` (3,): the radiant flux in W of all lights together. Raises NoLightError when nothing
    emits.
    """

    def __init__(
        self,
        scene: Scene,
        caster: RayCaster,
        bounds: Bounds,
        bounces: int,
        direct: bool = True,
        seen: np.ndarray | None = None,
        box: Bounds | None = None,
    ):
        # Most scenes let no light pass and have no specular surfaces, and then pay nothing for them.
        specular = SpecularSurfaces(scene.specular, scene.corners) if scene.specular is not None else None
        straight = None if scene.unshaded is None else BySide(scene.unshaded, caster.normals)
        passes = specular is not None or scene.transmittance.any() or straight is not None
        passing = Passing(BySide(scene.transmittance, caster.normals), straight) if passes else None
        albedo = BySide(scene.albedo, caster.normals)
        spread = None if scene.translucency is None else BySide(scene.translucency, caster.normals)
        self._bounces = Bounces(caster, albedo, passing, spread, specular, bounds, bounces, direct)
        # Indirect light all comes from surfaces: what passes beside them need not be emitted.
        whole = scene.bounds
        margin = 2 * EMISSION_LIFT * float(caster.tolerance(np.stack([whole.lower, whole.upper])).max())
        self._emission = Emission(scene, bounds if direct else whole.expanded(margin), seen, box)
        self.emitted_flux = self._emission.flux

    def keeping_all(self) -> PhotonTracer:
        """The same tracer, of which the segments of direct light are kept in any case."""
        tracer = copy(self)
        tracer._bounces = replace(self._bounces, direct=True)
        return tracer

    def resumed(self, segments: Segments, light: np.ndarray, generator: np.random.Generator) -> Segments:
        """What particles do from the origins of ``segments`` on, in their directions, in the scene as it is here.

        They came from that ``light`` (S,), as the tracer numbers them.
        """
        straight = self._emission.near[light] & (segments.bounce == 0)
        return self._bounces.resumed(segments, straight, generator)[0]

    def trace(self, particles: int, generator: np.random.Generator, first: int = 0) -> TracedPhotons:
        """Follow ``particles`` from emission to absorption; their segments carry the scene's full power together.

        The particles are numbered from ``first`` on.
        """
        sent, lights = self._emission.emit(particles, generator)
        return TracedPhotons(*self._bounces.followed(sent, first, generator, self._emission.near[lights]), lights)
