"""What every light source offers: particles to the photon tracer, and shadow rays to the points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from ..bounds import Bounds
from ..rays import Hits

#: How many uniform random numbers a particle's emission may use, and a shadow ray's choice, for every light.
EMISSION_DIMENSIONS = 4
SHADOW_DIMENSIONS = 2


@dataclass(frozen=True)
class Particles:
    """Photon particles as they leave a light.

    origins     (P, 3) metres
    directions  (P, 3) unit vectors
    flux        (P, 3) radiant flux in W, RGB; negative for lights of negative power
    start       (P,) metres along the direction before which a particle is blocked by surfaces but does not shine, or
                None for particles that shine from their origins on
    """

    origins: np.ndarray
    directions: np.ndarray
    flux: np.ndarray
    start: np.ndarray | None = None

    @staticmethod
    def joined(parts: list[Particles]) -> Particles:
        """All particles of ``parts`` in their order; ``parts`` holds at least one."""
        if len(parts) == 1:
            return parts[0]
        start = None
        if any(part.start is not None for part in parts):
            start = np.concatenate([np.zeros(len(p.origins)) if p.start is None else p.start for p in parts])
        joined = (np.concatenate([getattr(part, name) for part in parts]) for name in ("origins", "directions", "flux"))
        return Particles(*joined, start)


@dataclass(frozen=True)
class ShadowRays:
    """One ray from each of K points to a place on a light, and what comes back along it if nothing is in between.

    directions  (K, 3) unit, from the point to the light
    distances   (K,) metres to the light, inf for distant ones
    radiance    (K, 3) W/(m^2 sr), RGB, that arrives from there; zero where the light does not shine that way
    density     (K,) with which the direction was chosen, per steradian, > 0 wherever the radiance is not zero

    For a light without extent ``density`` is 1 and ``radiance`` the irradiance, W/m^2, on a surface that faces it.
    Either way radiance cos t / density, averaged over the choices, is the irradiance where nothing is in between.
    """

    directions: np.ndarray
    distances: np.ndarray
    radiance: np.ndarray
    density: np.ndarray

    @property
    def shines(self) -> np.ndarray:
        """Whether (K,) any radiance comes back."""
        red, green, blue = self.radiance.T
        return (red != 0) | (green != 0) | (blue != 0)


class Light(Protocol):
    """A source of photon particles, at which points can also aim shadow rays.

    Attribute ``sharp``: whether all uniforms give the same ray, so that a single one tells everything.
    """

    sharp: bool

    def shadow_rays(self, points: np.ndarray, uniforms: np.ndarray) -> ShadowRays:
        """A ray from each of ``points`` (K, 3) by ``uniforms`` (K, SHADOW_DIMENSIONS) in [0, 1), deterministic."""
        ...

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W that the light sends out; distant lights: that enters ``bounds``."""
        ...

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Turn ``uniforms`` (P, EMISSION_DIMENSIONS) in [0, 1) into P particles.

        The mapping is deterministic, so that random and low-discrepancy numbers serve alike. The
        particles' flux adds up to :meth:`flux` in expectation. Distant lights start their particles on the
        surface of ``bounds``.
        """
        ...


def is_lamp(light: Light) -> bool:
    """Whether rays meet the light by aiming at it alone, and not by chance too, as they do :class:`Surroundings`."""
    return not hasattr(light, "met")


def is_world(light: Light) -> bool:
    """Whether a light surrounds everything, so that rays meet it where they leave the scene; lamps do not."""
    return not is_lamp(light) and light.distant


class Surroundings(Light, Protocol):
    """A light that rays from a point may also meet by chance: the world behind everything, or shining triangles.

    Rays chosen by the light and rays chosen by the cosine are then weighed by both densities (balance heuristic).
    Attributes ``aimed``: whether the light chooses rays at all; one that the cosine alone finds best has no
    shadow_rays; ``distant``: whether it lies behind everything, so that rays meet it wherever they leave the scene.
    """

    aimed: bool
    distant: bool

    def among(self, triangle: np.ndarray) -> np.ndarray:
        """Whether (K,) this light may be what rays see that met the scene's ``triangle`` (K,), -1 for none."""
        ...

    def met(self, points: np.ndarray, directions: np.ndarray, triangle: np.ndarray, places: np.ndarray):
        """What ``points`` (K, 3) see of this light along unit ``directions`` (K, 3): radiance and density.

        Their rays met the scene's ``triangle`` (K,) at ``places`` (K, 3), or left the scene where it is -1. Returns the
        radiance (K, 3) W/(m^2 sr), zero where this light is not what was met, and the density (K,) per steradian with
        which :meth:`shadow_rays` chooses these directions.
        """
        ...


class Sky:
    """What worlds have in common, all of which lie behind everything."""

    sharp: ClassVar[bool] = False
    distant: ClassVar[bool] = True

    def among(self, triangle: np.ndarray) -> np.ndarray:
        """Whether rays that met ``triangle`` (K,) left the scene: where it is -1."""
        return triangle < 0


def met_among(
    lights: Sequence[Surroundings], points: np.ndarray, directions: np.ndarray, rows: np.ndarray, hits: Hits
) -> Iterator[tuple[Surroundings, np.ndarray, np.ndarray, np.ndarray]]:
    """What ``rows`` (K,) of rays from ``points`` (R, 3) along ``directions`` (R, 3) see of ``lights`` at K ``hits``.

    Yields each light, which (L,) of the K may see it, the radiance (L, 3) that comes from there, and the density (L,)
    of aiming there.
    """
    for light in lights:
        mine = np.flatnonzero(light.among(hits.triangle))
        ahead = (part.take(rows.take(mine), axis=0) for part in (points, directions))
        yield light, mine, *light.met(*ahead, hits.triangle.take(mine), hits.points.take(mine, axis=0))
