"""Surfaces that reflect as mirrors do, or refract: metals and glass, smooth or rough."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..checks import fill, float_rows, index_rows, unit_rows
from ..errors import InvalidArrayError
from ..sampling import cosine_hemisphere, frames
from ..triangles import dots, normals_and_areas

#: How many uniform random numbers each hit of a specular surface uses.
FACET_DIMENSIONS = 5

#: Light that grazes more than by this cosine counts as coming by it, so that nothing is divided by zero.
_LEAST_COSINE = 1e-9


@dataclass(frozen=True)
class Specular:
    """The optical properties of K triangles that send light on in a direction of its own.

    triangles  (K,) rows of the scene's triangles, ascending
    normals    (K, 3 corners, 3) unit shading normals, between which the surface is curved
    mirror     (K, 3) share reflected as by a metal, RGB, at every angle
    gloss      (K, 3) share that the boundary of a clear body handles: tint of what it reflects, RGB
    clear      (K, 3) the same share: tint of what it lets in or out, RGB
    ior        (K,) index of refraction of the body behind the surface, into which the geometric normals do not point
    roughness  (K,) width alpha of the microfacets' distribution (GGX), 0 for a smooth surface

    Raises InvalidArrayError on shapes or values that are not as above.
    """

    triangles: np.ndarray
    normals: np.ndarray
    mirror: np.ndarray
    gloss: np.ndarray
    clear: np.ndarray
    ior: np.ndarray
    roughness: np.ndarray

    def __post_init__(self):
        triangles = index_rows(np.ravel(self.triangles), "specular triangles", None, np.iinfo(np.int64).max)
        if (np.diff(triangles) <= 0).any():
            raise InvalidArrayError("specular triangles must be ascending, each once.")
        count = len(triangles)
        if np.shape(self.normals) != (count, 3, 3):
            raise InvalidArrayError(
                f"shading normals must have the shape ({count}, 3, 3), not {np.shape(self.normals)}."
            )
        checked = {
            "triangles": triangles,
            "normals": unit_rows(np.reshape(self.normals, (-1, 3)), "shading normals").reshape(-1, 3, 3),
            **{name: float_rows(getattr(self, name), name, 3, count) for name in ("mirror", "gloss", "clear")},
            **{name: float_rows(getattr(self, name), name, None, count) for name in ("ior", "roughness")},
        }
        for name in ("mirror", "gloss", "clear", "roughness"):
            if (checked[name] < 0).any():
                raise InvalidArrayError(f"{name} must not be negative.")
        if (checked["ior"] <= 0).any():
            raise InvalidArrayError("An index of refraction must be above zero.")
        fill(self, **checked)


@dataclass(frozen=True)
class Turns:
    """What surfaces would do to K particles each: shares (K, 3), RGB, and unit directions (K, 3)."""

    mirrored: np.ndarray
    mirrored_direction: np.ndarray
    refracted: np.ndarray
    refracted_direction: np.ndarray


class SpecularSurfaces:
    """Finds how particles go on where they meet the ``specular`` triangles of a scene, given by all its ``corners``.

    Attribute: each triangle's ``row`` (T,) among the specular ones, -1 for none.
    """

    def __init__(self, specular: Specular, corners: np.ndarray):
        self._specular = specular
        self._corners = corners[specular.triangles]
        self._normals, _ = normals_and_areas(self._corners)
        self.row = np.full(len(corners), -1, np.int64)
        self.row[specular.triangles] = np.arange(len(specular.triangles))

    def turns(self, triangle: np.ndarray, directions: np.ndarray, points: np.ndarray, generator) -> Turns:
        """What each ``triangle`` (K,) does to a particle of ``directions`` (K, 3) that meets it at ``points`` (K, 3).

        The shares are zero, and no random number is used, where it is not specular.
        """
        rows = self.row[triangle]
        met = np.flatnonzero(rows >= 0)
        found = self._turns(rows[met], directions[met], points[met], generator.random((len(met), FACET_DIMENSIONS)))
        whole = Turns(np.zeros_like(directions), directions.copy(), np.zeros_like(directions), directions.copy())
        for name, values in vars(found).items():
            getattr(whole, name)[met] = values
        return whole

    def _turns(self, rows, directions, points, uniforms) -> Turns:
        """The same for table ``rows`` (K,), by ``uniforms`` (K, FACET_DIMENSIONS).

        A microfacet is chosen among those that the light meets; it mirrors light about its own normal, or refracts it
        by Snell's law, in shares by :func:`fresnel`. What the other microfacets then block, and would send on after
        several reflections, leaves to the same side evenly, so that nothing is lost.
        """
        surface = self._specular
        alpha, ior = surface.roughness[rows], surface.ior[rows]
        front = dots(self._normals[rows], directions) < 0
        side = np.where(front, 1.0, -1.0)[:, None]
        flat, smooth = side * self._normals[rows], side * self._shading(rows, points)
        # A shading normal that turns away from the light says nothing about how the light is met.
        smooth = np.where((dots(smooth, directions) < 0)[:, None], smooth, flat)
        facets = visible_normals(smooth, -directions, alpha, uniforms[:, :2])
        cosine = np.clip(-dots(facets, directions), 0.0, 1.0)
        ratio = np.where(front, ior, 1.0 / ior)
        reflectance, beyond = fresnel(cosine, ratio)
        mirrored = directions + (2 * cosine)[:, None] * facets
        refracted = directions / ratio[:, None] + (cosine / ratio - beyond)[:, None] * facets
        arriving = -dots(smooth, directions)
        return Turns(
            surface.mirror[rows] + reflectance[:, None] * surface.gloss[rows],
            _let_out(mirrored, flat, smooth, arriving, alpha, uniforms[:, 2:]),
            (1.0 - reflectance)[:, None] * surface.clear[rows],
            _let_out(refracted, -flat, -smooth, arriving, alpha, uniforms[:, 2:]),
        )

    def _shading(self, rows, points: np.ndarray) -> np.ndarray:
        """Unit shading normals (K, 3) at points on the triangles."""
        corners = self._corners[rows]
        # The areas opposite the corners, signed along the normal, are the corners' weights.
        spokes = corners - points[:, None]
        opposite = np.cross(np.roll(spokes, -1, axis=1), np.roll(spokes, -2, axis=1))
        weights = np.maximum(np.einsum("kci,ki->kc", opposite, self._normals[rows]), 0.0)
        normals = np.einsum("kc,kci->ki", weights, self._specular.normals[rows])
        length = np.linalg.norm(normals, axis=1)
        return np.where(
            (length > 0)[:, None], normals / np.where(length > 0, length, 1.0)[:, None], self._normals[rows]
        )


def fresnel(cosine: np.ndarray, ratio: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Reflectance (K,) of a clear boundary for unpolarised light, and the refracted ray's cosine (K,).

    ``cosine`` (K,) of the angle of incidence, 0..1; ``ratio`` (K,) of the index behind the boundary to the one before
    it. Where all is reflected the reflectance is 1 and the refracted cosine 0.
    """
    beyond = np.sqrt(np.maximum(ratio**2 - 1.0 + cosine**2, 0.0)) / ratio
    tiny = np.finfo(float).tiny
    across = (cosine - ratio * beyond) / np.maximum(cosine + ratio * beyond, tiny)
    along = (ratio * cosine - beyond) / np.maximum(ratio * cosine + beyond, tiny)
    return np.where(beyond > 0, 0.5 * (across**2 + along**2), 1.0), beyond


def visible_normals(normals, towards, alpha, uniforms) -> np.ndarray:
    """Normals (K, 3) of microfacets as they are seen from ``towards`` (K, 3), on a surface of ``normals`` (K, 3).

    Source: Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", Computer Graphics Forum 42(8), 2023.
    """
    first, second = frames(normals)
    wide = alpha[:, None]
    upward = np.maximum(dots(towards, normals), _LEAST_COSINE)
    seen = np.stack([dots(towards, first), dots(towards, second), upward], axis=1)
    seen = _unit(np.concatenate([wide * seen[:, :2], seen[:, 2:]], axis=1))
    height = (1.0 - uniforms[:, 1]) * (1.0 + seen[:, 2]) - seen[:, 2]
    ring = np.sqrt(np.clip(1.0 - height**2, 0.0, 1.0))
    turn = 2 * np.pi * uniforms[:, 0]
    local = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1) + seen
    local = _unit(np.concatenate([wide * local[:, :2], local[:, 2:]], axis=1))
    return local[:, :1] * first + local[:, 1:2] * second + local[:, 2:] * normals


def _let_out(directions, flat, smooth, arriving, alpha, uniforms) -> np.ndarray:
    """The directions (K, 3), or even ones for what microfacets block, on the side of the normals ``flat`` (K, 3).

    ``smooth`` (K, 3) are the shading normals on that side, ``arriving`` (K,) the cosine at which the light came;
    uniforms (K, 3).
    """
    leaving = dots(smooth, directions)
    blocked = uniforms[:, 0] >= unblocked(np.abs(arriving), leaving, alpha)
    directions = np.where(blocked[:, None], cosine_hemisphere(flat, uniforms[:, 1:]), directions)
    # Where the shading normal would send light through the flat triangle, it leaves as much to the other side.
    inside = np.minimum(dots(flat, directions), 0.0)
    return directions - (2 * inside)[:, None] * flat


def unblocked(arriving, leaving, alpha) -> np.ndarray:
    """Share (K,) of what a microfacet that light meets sends on that no other one blocks.

    ``arriving`` and ``leaving`` are cosines (K,) to the surface's normal, the latter below zero where it goes inside:
    Smith's masking and shadowing of heights that are correlated (Heitz 2014).
    """
    before, behind = _shadowing(arriving, alpha), _shadowing(np.abs(leaving), alpha)
    return np.where(leaving < 0, 0.0, (1.0 + before) / (1.0 + before + behind))


def _shadowing(cosine, alpha) -> np.ndarray:
    """Smith's Lambda (K,) of GGX microfacets for light at that cosine to the surface's normal, 0 for a smooth one."""
    cosine = np.maximum(cosine, _LEAST_COSINE)
    return 0.5 * (np.sqrt(1.0 + alpha**2 * (1.0 / cosine**2 - 1.0)) - 1.0)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]
