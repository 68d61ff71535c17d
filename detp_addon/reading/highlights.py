"""What microfacets send on of even light: a clear boundary above a diffuse surface, rough metals and glass."""

from __future__ import annotations

import numpy as np

from ...core.photons.specular import fresnel, unblocked, visible_normals
from ...core.triangles import dots

#: the reflectance straight on is no more than this, squared
_MOST = 0.99

#: directions that light comes from, by Gauss and Legendre, and microfacets that each of them meets, a number of
#: Fibonacci: rare steep ones tell at small roughnesses
_COSINES, _FACETS = 5, 233

#: both of :func:`_means` by whole hundredths of the root and the roughness, once they have been asked for
_KNOWN = np.full((2, 101 * 101), np.nan)


def reflected_above(ior, level, tint, roughness) -> np.ndarray:
    """Share (m, 3) of even light that is reflected by a boundary of those indices of refraction, Specular IOR levels
    and roughnesses (m or 1, 1), as Blender has them, and of that tint (m or 1, 3) straight on.

    The boundary is one of GGX microfacets, whose reflectance goes from the tinted one straight on to all of the light
    at grazing angles as Fresnel's does. It agrees with Cycles within a twentieth of itself up to a roughness of 0.5,
    and within a sixth beyond, where light goes on from facet to facet.
    """
    straight = ((ior - 1.0) / (ior + 1.0)) ** 2 * 2.0 * np.maximum(level, 0.0)
    root = np.sqrt(np.clip(np.nan_to_num(straight), 0.0, _MOST**2))
    whole, grazing = _known_means(root, roughness)
    return grazing + (whole - grazing) * root**2 * np.clip(tint, 0.0, 1.0)


def let_out_at_once(roughness) -> np.ndarray:
    """Share (m or 1, 1) of even light that white GGX microfacets of those roughnesses, as Blender has them, reflect
    past all others; the rest meets more of them.

    Within half a hundredth of what Cycles keeps of it where a metal is of GGX and not Multiscatter GGX;
    within a hundredth of what each side of a clear pane keeps up to a roughness of 0.5, beyond which that is more, 0.6
    instead of 0.4 at 1.
    """
    return _known_means(0.0, roughness)[0]


def _known_means(root, roughness) -> np.ndarray:
    """Both of :func:`_means` (2, m or 1, 1), looked up by whole hundredths: textures have millions of places."""
    wide = np.clip(np.nan_to_num(roughness), 0.0, 1.0)
    number = np.rint(100.0 * root).astype(np.int64) * 101 + np.rint(100.0 * wide).astype(np.int64)
    asked = np.flatnonzero(np.bincount(number.ravel()))
    new = asked[np.isnan(_KNOWN[0, asked])]
    if len(new):
        _KNOWN[:, new] = _means(new // 101 / 100.0, new % 101 / 100.0)
    return _KNOWN.take(number, axis=1)


def _means(root: np.ndarray, roughness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of even light the share (U,) that microfacets of U roughnesses let out again were they white, and if they
    reflected only as much as Fresnel's reflectance is above that straight on, whose ``root`` (U,) is given."""
    nodes, weights = np.polynomial.legendre.leggauss(_COSINES)
    cosines = 0.5 * (nodes + 1.0)
    spread = (np.arange(_FACETS) + 0.5) / _FACETS, (np.arange(_FACETS) * 0.6180339887498949) % 1.0
    shape = len(root), _COSINES, _FACETS
    grid = np.broadcast_arrays(root[:, None, None], roughness[:, None, None] ** 2, cosines[:, None], *spread)
    root, alpha, cosine, first, second = (np.broadcast_to(part, shape).ravel() for part in grid)
    towards = np.stack([np.sqrt(1.0 - cosine**2), np.zeros_like(cosine), cosine], axis=1)
    up = np.tile((0.0, 0.0, 1.0), (len(cosine), 1))
    facets = visible_normals(up, towards, alpha, np.stack([first, second], axis=1))
    met = np.clip(dots(facets, towards), 0.0, 1.0)
    let_out = unblocked(cosine, 2.0 * met * facets[:, 2] - cosine, alpha)
    reflectance, _ = fresnel(met, (1.0 + root) / (1.0 - root))
    grazing = let_out * (reflectance - root**2) / (1.0 - root**2)
    return tuple((part.reshape(shape).mean(axis=2) * weights * cosines).sum(axis=1) for part in (let_out, grazing))
