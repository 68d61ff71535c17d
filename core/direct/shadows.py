"""Shadows: what share of the light a straight way lets through, and what is met on it (alpha, thin glass)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..lights.light import Light, Surroundings, is_world
from ..rays import Hits, RayCaster
from ..scene import Scene
from ..sides import BySide, any_side

#: A ray stops this many tolerances short of the light, which may be a surface of the scene itself.
STOP_SHORT = 32

#: Surfaces that a ray or particle may pass straight through, all together, before it is given up.
MOST_PASSAGES = 1024

#: Rays are given up of whose light less than this share would come through.
LEAST_SHARE = 1e-6

#: So are those that so many passages in a row have brought no farther than rounding tells, each by less than so many
#: tolerances: they meet the same needle, or corner, again and again.
MOST_IDLE, IDLE = 8, 2.0


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


class SeeThrough:
    """The triangles of ``caster``, of which each lets ``transmittance`` of the light pass, None: nothing.

    That is (T, 3), or (2, T, 3) by the side that a ray meets (see :class:`.Scene`).
    """

    def __init__(self, caster: RayCaster, transmittance: np.ndarray | None):
        self._caster = caster
        self._transmittance = None
        if transmittance is not None:
            self._transmittance = BySide(transmittance, caster.normals)
            # The last row stands for no triangle.
            self._clear = np.append(any_side(transmittance), False)

    def met(
        self, origins: np.ndarray, directions: np.ndarray, reach: np.ndarray | float = np.inf
    ) -> Iterator[tuple[np.ndarray, Hits, np.ndarray]]:
        """Everything that rays meet one after another within ``reach`` (K,) m, until no light would come through.

        Yields, for the first surfaces, the second ones and so on: the rays' rows (R,), what they meet, which may be
        nothing, and the share (R, 3) of the light from there that reaches the origins. Rays that rounding holds fast
        meet nothing more, as if what holds them were opaque.
        """
        rows, share = np.arange(len(origins)), np.ones((len(origins), 3))
        reach = np.broadcast_to(reach, len(origins))
        starts, along, endless = origins, directions, np.isinf(reach).all()
        last, idle = origins, np.zeros(len(origins), np.int64)
        for _ in range(MOST_PASSAGES):
            hits = self._caster.first_hits(starts, along)
            triangle = hits.triangle
            if not endless:
                beyond = np.linalg.norm(hits.points - origins[rows], axis=1) >= reach[rows]
                triangle = np.where(beyond, -1, triangle)
            yield rows, Hits(triangle, hits.points), share
            if self._transmittance is None:
                return
            going = np.flatnonzero(self._clear.take(triangle, mode="wrap"))
            passing = self._transmittance.met(triangle.take(going), along.take(going, axis=0))
            share = share.take(going, axis=0) * passing
            places = hits.points.take(going, axis=0)
            onward = np.einsum("ij,ij->i", places - last.take(going, axis=0), along.take(going, axis=0))
            idle = np.where(onward < IDLE * self._caster.tolerance(places), idle.take(going) + 1, 0)
            left = np.flatnonzero((share > LEAST_SHARE).any(axis=1) & (idle < MOST_IDLE))
            if len(left) == 0:
                return
            going, share, idle, last = (
                going.take(left),
                share.take(left, axis=0),
                idle.take(left),
                places.take(left, axis=0),
            )
            rows, along = rows.take(going), along.take(going, axis=0)
            starts = self._past(last, triangle.take(going), along)

    def _past(self, places: np.ndarray, triangle: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """The ``places`` (R, 3) of hits, moved just behind the surface."""
        normals = self._caster.normals[triangle]
        side = np.copysign(1.0, np.einsum("ij,ij->i", normals, directions))
        return places + (self._caster.tolerance(places) * side)[:, None] * normals
