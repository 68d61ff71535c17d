"""Tells bodies of glass, which refract, from panes and sheets, through which light goes straight on; NumPy only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...core.photons.specular import fresnel
from ...core.triangles import cross, dots
from .response import Response

#: a body is a pane when so much of its area faces along one line: light leaves it in the direction in which it came
_PANE_SHARE = 0.8
#: cosine between normals that count as parallel
_PARALLEL = 0.9999

#: an index of refraction nearer to 1 does not bend light
_LEAST_BEND = 1e-3

#: specular shares below this are not worth a direction of their own
_FAINT = 0.01

#: steps over which reflectances are averaged
_STEPS = 256


def without_faint(response: Response) -> Response:
    """The ``response`` (T rows) in which what is faintly specular counts as diffuse and clear."""
    specular = np.maximum(np.maximum(response.mirror, response.gloss), response.clear).max(axis=1)
    if not specular.any():
        return response
    plain = replace(
        response.each(np.zeros_like),
        albedo=response.albedo + response.mirror,
        emission=response.emission,
        transmittance=response.transmittance + response.clear,
        spread=response.spread,
        highlight=response.highlight,
    )
    return _chosen(specular < _FAINT, plain, response)


def settled_glass(
    response: Response, vertices: np.ndarray, triangles: np.ndarray, rows: np.ndarray
) -> tuple[Response, np.ndarray, np.ndarray]:
    """The ``response`` of some triangles of a mesh, its ``rows`` (R,), with straight passage for all glass that is not
    a body; and which of them (R,) are panes, and which sheets (R,), where it would have bent light.

    ``vertices`` (V, 3) and ``triangles`` (T, 3) are the mesh's.
    """
    body, pane = (which[rows] for which in _bodies_and_panes(vertices, triangles))
    glass, bends = (response.gloss + response.clear).any(axis=1), np.abs(response.ior[:, 0] - 1.0) > _LEAST_BEND
    sheet = ~pane & ~body
    settled = _chosen(glass & ~(body & bends), straightened(response, sheet[:, None]), response)
    return settled, glass & bends & pane, glass & bends & sheet


def straightened(response: Response, sheet) -> Response:
    """The response with straight passage instead of refraction, and Fresnel reflection at its mean over all angles.

    ``sheet`` (m or 1, 1) tells where one surface stands for both sides of a pane.
    """
    reflectance = mean_reflectance(response.ior, sheet)
    mirror = response.mirror + reflectance * response.gloss
    through = response.transmittance + (1 - reflectance) * response.clear
    kept = {name: getattr(response, name) for name in ("roughness", "spread", "highlight")}
    return Response.of(response.albedo, response.emission, through, mirror, **kept)


def mean_reflectance(ior: np.ndarray, sheet) -> np.ndarray:
    """Share (m, 1) of even light that a boundary of each ``ior`` (m, 1) reflects, or both sides of a pane together."""
    cosine = np.sqrt((np.arange(_STEPS) + 0.5) / _STEPS)
    values, row = np.unique(np.round(np.maximum(ior, _LEAST_BEND), 3), return_inverse=True)
    single = np.stack([fresnel(cosine, value)[0] for value in values])
    both = 2 * single / (1 + single)
    row = row.reshape(ior.shape)
    return np.where(sheet, both.mean(axis=1)[row], single.mean(axis=1)[row])


def _chosen(rows: np.ndarray, first: Response, second: Response) -> Response:
    pairs = zip(first.arrays, second.arrays, strict=True)
    return Response(*(np.where(rows[:, None], mine, theirs) for mine, theirs in pairs))


def _bodies_and_panes(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which triangles (T,) belong to closed parts of the mesh that are no panes, and which to panes.

    A part is closed when each of its edges has an even number of triangles; vertices at one place are one vertex.
    """
    _, same = np.unique(vertices, axis=0, return_inverse=True)
    welded = same.reshape(-1)[triangles]
    part = _parts(welded, len(vertices))
    edges = np.sort(np.concatenate([welded[:, [0, 1]], welded[:, [1, 2]], welded[:, [2, 0]]]), axis=1)
    edges = edges[edges[:, 0] != edges[:, 1]]
    keys, uses = np.unique(edges[:, 0] * len(vertices) + edges[:, 1], return_counts=True)
    closed = np.ones(len(vertices), bool)
    closed[part[keys[uses % 2 == 1] // len(vertices)]] = False

    owner = part[welded[:, 0]]
    corners = vertices[triangles]
    area_vectors = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.sqrt(dots(area_vectors, area_vectors))
    order = np.argsort(areas, kind="stable")
    largest = np.zeros(len(vertices), np.int64)
    largest[owner[order]] = order
    cosines = np.abs(dots(area_vectors, area_vectors[largest[owner]]))
    parallel = cosines >= _PARALLEL * areas * areas[largest[owner]]
    flat = np.bincount(owner, areas * parallel, len(vertices)) >= _PANE_SHARE * np.bincount(owner, areas, len(vertices))
    return (closed & ~flat)[owner], (closed & flat)[owner]


def _parts(triangles: np.ndarray, count: int) -> np.ndarray:
    """The lowest vertex (V,) that each of ``count`` vertices is connected to."""
    lowest = np.arange(count)
    while True:
        found = lowest.copy()
        np.minimum.at(found, triangles.ravel(), np.repeat(lowest[triangles].min(axis=1), 3))
        found = found[found]
        if np.array_equal(found, lowest):
            return lowest
        lowest = found
