"""Nested discs: each disc parted into rings, so that its estimate can be as sharp as its light asks for.

Ring 0 is the outer half of a disc's radius, ring 1 the outer half of the disc of half the radius within, and so on; the
last is all that remains. The rings from k on make up the nested disc k, of radius d / 2^k.
"""

from __future__ import annotations

import numpy as np

from ..discs import TangentDiscs
from ..gatherers.gatherer import Crossings
from ..segments import Segments

#: Rings of a disc whose outline is known. The last nested disc has an eighth of the radius and a 64th of the crossings.
RINGS = 4

#: The ring of a crossing outside the outline.
OUTSIDE = 255


def nested_areas(reach: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Area (N, RINGS) m^2 of what N outlines leave of each nested disc; of the whole discs where nothing is in the way.

    reach  (N, D) metres: the outline's corners, at equal angles around the centre
    radii  (N,) metres, of the discs
    """
    sector = 2 * np.pi / reach.shape[1]
    wide = _nested_radii(radii)
    areas = whole_areas(radii)
    nearest = reach.min(axis=1)
    partial = nearest < radii
    areas[partial, 0] = outline_area(reach[partial])
    for ring in range(1, RINGS):
        # Farther away, not even the line between two corners comes into the disc.
        cut = np.flatnonzero(partial & (nearest * np.cos(0.5 * sector) < wide[:, ring]))
        areas[cut, ring] = _area_within(reach[cut], wide[cut, ring, None], sector)
    # Rounding must not leave a ring an area below nothing.
    return np.minimum.accumulate(areas, axis=1)


def whole_areas(radii: np.ndarray) -> np.ndarray:
    """Area (N, RINGS) m^2 of the nested discs of discs with these ``radii`` (N,) metres."""
    return np.pi * _nested_radii(radii) ** 2


def outline_area(reach: np.ndarray) -> np.ndarray:
    """Area (N,) of the polygon whose corners have the distances ``reach`` (N, D), at equal angles: of its triangles."""
    return 0.5 * np.sin(2 * np.pi / reach.shape[1]) * (reach * np.roll(reach, -1, axis=1)).sum(axis=1)


def rings_of(offset: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """In which ring (C,), 0...RINGS - 1, of discs of ``radii`` (C,) places so far (C, 3) from the centres lie."""
    squared, limit = np.einsum("ij,ij->i", offset, offset), radii**2
    ring = np.zeros(len(radii), np.uint8)
    for level in range(1, RINGS):
        ring += squared <= limit * 0.25**level
    return ring


def offsets(discs: TangentDiscs, segments: Segments, crossings: Crossings) -> np.ndarray:
    """From the centres to where (C, 3) metres the segments cross their discs."""
    normals, away = (rows.take(crossings.disc, axis=0) for rows in (discs.normals, discs.centres))
    origins, along = (rows.take(crossings.segment, axis=0) for rows in (segments.origins, segments.ends))
    along -= origins
    away -= origins
    time = np.einsum("ij,ij->i", away, normals) / np.einsum("ij,ij->i", along, normals)
    along *= time[:, None]
    along -= away
    return along


def _nested_radii(radii: np.ndarray) -> np.ndarray:
    return radii[:, None] * 0.5 ** np.arange(RINGS)


def _area_within(reach: np.ndarray, radius: np.ndarray, sector: float) -> np.ndarray:
    """Area (N,) of the outlines inside circles of ``radius`` (N, 1) around their centres.

    Of each triangle between the centre and two corners, what lies within: where the line of the corners runs inside the
    circle the triangle's part, elsewhere the circle's. Along that line, s is the way from its foot, h its distance.
    """
    one, other = reach, np.roll(reach, -1, axis=1)
    along = one * other * np.cos(sector)
    length = np.maximum(np.sqrt(one**2 + other**2 - 2 * along), 1e-300)
    begin, end = (along - one**2) / length, (other**2 - along) / length
    height = one * other * np.sin(sector) / length
    inside = np.sqrt(np.maximum(radius**2 - height**2, 0.0))
    begin, end = np.clip(begin, -inside, inside), np.clip(end, -inside, inside)
    straight = np.arctan2(end, height) - np.arctan2(begin, height)
    parts = height * (end - begin) + radius**2 * (sector - straight)
    return 0.5 * np.where(height > 0, parts, 0.0).sum(axis=1)
