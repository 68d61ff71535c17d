"""Shadows: what share of the light a straight way between two places lets through."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lights.light import Light, Surroundings, is_world
from ..rays import RayCaster
from ..scene import Scene
from ..sides import any_side
from .passage import SeeThrough

#: A ray stops this many tolerances short of the light, which may be a surface of the scene itself.
STOP_SHORT = 32


class Shadows:
    """Casts rays through the surfaces of ``scene`` as far as those let light pass straight (alpha, thin glass).

    They stand for light from lamps and shining triangles; those of ``between`` for light from the world and from
    surfaces, which may be let pass otherwise. Attribute ``surfaces``: all of them.
    """

    def __init__(self, scene: Scene, caster: RayCaster, straight: bool = True):
        differs = straight and scene.unshaded is not None
        passing = scene.unshaded if differs else scene.transmittance
        clear = any_side(passing)
        self._caster = caster
        self._opaque, self._clear = caster, None
        self.between = Shadows(scene, caster, False) if differs else self
        self.surfaces = SeeThrough(caster, passing if clear.any() else None)
        if clear.any():
            # In whatever order they come: what is opaque blocks, which is soon known, and few rays meet the rest.
            self._opaque = None if clear.all() else caster.part(np.flatnonzero(~clear))
            self._clear = SeeThrough(caster.part(np.flatnonzero(clear)), passing[..., clear, :])

    def ways(self, lights: Sequence[Surroundings]) -> list[tuple[SeeThrough, list[Surroundings]]]:
        """All surfaces as the light of some of ``lights`` passes them, with those; first, as reflected light does."""
        if self.between is self:
            return [(self.surfaces, list(lights))]
        near = [light for light in lights if not is_world(light)]
        ways = [(self.between.surfaces, [light for light in lights if is_world(light)])]
        return [*ways, (self.surfaces, near)] if near else ways

    def of(self, light: Light) -> Shadows:
        """Those that stand for that ``light``."""
        return self.between if is_world(light) else self

    def transmitted(self, origins: np.ndarray, directions: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """Share of the light, RGB 0..1, that comes through: (K, 3), or (K, 1) when no surface lets any pass.

        From ``origins`` (K, 3), clear of surfaces by the caster's tolerance, along unit ``directions`` (K, 3) over
        ``distances`` (K,) metres, which may be inf.
        """
        reach = self._short_of(origins, directions, distances)
        if self._clear is None:
            return ~self._opaque.occluded(origins, directions, reach)[:, None]
        left = np.arange(len(origins))
        if self._opaque is not None:
            left = np.flatnonzero(~self._opaque.occluded(origins, directions, reach))
        share = np.zeros((len(origins), 3))
        for rows, hits, through in self._clear.met(origins[left], directions[left], reach[left]):
            arrived = hits.triangle < 0
            share[left[rows[arrived]]] = through[arrived]
        return share

    def _short_of(self, origins: np.ndarray, directions: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """How far (K,) rays go that must not meet the light itself at its ``distances`` (K,)."""
        if np.isinf(distances).all():
            return distances
        near = np.isfinite(distances)
        ends = origins + np.where(near, distances, 0.0)[:, None] * directions
        return np.where(near, distances - STOP_SHORT * self._caster.tolerance(ends), distances)
