"""An image at halving sizes, so that its mean over a triangle of any size takes few look-ups; NumPy only."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .recalled import digest

#: larger images are halved until they fit: what counts is the mean over whole triangles
LARGEST_SIDE = 1024

#: a triangle is cut into rows of at least and at most so many looks along each edge, where it covers so many texels
_LEAST_CUTS, _MOST_CUTS = 4, 16

#: a triangle with shorter edges, in texels, is but a point: rounding makes them of none
_POINT = 1e-3

#: looks for all triangles that are asked for at once, unless each has its least already
_LOOKS = 1 << 22


@dataclass(frozen=True)
class TexturePyramid:
    """Linear RGBA pictures (H, W, 4), row 0 at the bottom, each half the size of the one before.

    ``associated`` says that the colours are multiplied by the alpha, which keeps clear texels from tinting means.
    ``encoded`` says that texels are blended in sRGB; then ``texels`` are those of the first picture themselves, which
    has what is shown on each on average.
    """

    levels: tuple[np.ndarray, ...]
    associated: bool
    texels: np.ndarray
    encoded: bool

    @classmethod
    def of(cls, rgba: np.ndarray, associated: bool, shown: np.ndarray | None = None) -> TexturePyramid:
        """From linear RGBA (H, W, 4) whose colours are not multiplied by the alpha.

        ``shown`` (H, W, 3) are the mean colours over each texel, where they are not its own.
        """
        encoded = shown is not None
        texels, *shown = (_fitting(rgba, colours, associated) for colours in (rgba, shown) if colours is not None)
        levels = [*(shown or [texels])]
        while max(levels[-1].shape[:2]) > 1:
            levels.append(_halved(levels[-1]))
        # Half floats are exact to 0.05 % and keep a scene with many textures small; bright skies do not fit.
        dtype = np.float16 if texels.max(initial=0.0) < 6e4 else np.float32
        levels = tuple(level.astype(dtype) for level in levels)
        return cls(levels, associated, texels.astype(dtype) if encoded else levels[0], encoded)

    @cached_property
    def digest(self) -> bytes:
        """What tells it from all others."""
        return digest(*self.levels, self.associated, self.texels, self.encoded)

    @property
    def mean(self) -> np.ndarray:
        """The mean colour and alpha (4,), associated as the levels are."""
        return self.levels[-1][0, 0].astype(np.float64)

    def patches(
        self, centres: np.ndarray, edges: np.ndarray, extension: str, interpolation: str = "Linear"
    ) -> np.ndarray:
        """Mean RGBA (m, 4) over the triangles around the coordinates ``centres`` (m, 2), with two ``edges`` (m, 2, 2).

        ``extension`` says what lies outside 0..1: REPEAT, MIRROR, EXTEND or CLIP (clear black). Coordinates that are
        not finite give the mean of the whole image. A triangle that is but a point, as those of faces that have no UV
        map, takes its part of the texels around by their ``interpolation``.
        """
        result = np.empty((len(centres), 4))
        known = np.isfinite(centres).all(axis=1)
        result[~known] = self.mean
        cuts, levels = self._fineness(np.nan_to_num(edges, posinf=0.0, neginf=0.0))
        kinds = np.where(known, levels * (2 * _MOST_CUTS) + cuts, -1)
        for kind in np.unique(kinds[known]):
            here = np.flatnonzero(kinds == kind)
            level, rows = divmod(int(kind), 2 * _MOST_CUTS)
            middle, first, second = centres[here], edges[here, 0], edges[here, 1]
            total = np.zeros((len(here), 4))
            for _, along, across in triangle_centres(rows) - 1.0 / 3.0:
                total += _texels(self.levels[level], middle + along * first + across * second, extension)
            result[here] = total / rows**2
        sides = np.abs(edges * self.levels[0].shape[1::-1]).max(axis=(1, 2), initial=0.0)
        points = np.flatnonzero(known & (sides < _POINT)) if interpolation != "Closest" else []
        if len(points):
            result[points] = self._blended(centres[points], extension, interpolation)
        return result

    def looked_at(self, places: np.ndarray, extension: str, interpolation: str) -> np.ndarray:
        """RGBA (m, 4) at ``places`` (m, 2), as the texels around are blended, or of the texel there alone."""
        if interpolation == "Closest":
            return _texels(self.texels, places, extension).astype(np.float64)
        return self._blended(places, extension, interpolation)

    def _fineness(self, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Into how many rows (m,) to cut each triangle, and the level (m,) to look at, for about two looks a texel."""
        sides = edges * self.levels[0].shape[1::-1]
        area = 0.5 * np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
        longest = np.abs(sides).max(axis=(1, 2), initial=0.0)
        most = np.clip(2.0 ** np.floor(0.5 * np.log2(_LOOKS / max(len(edges), 1))), _LEAST_CUTS, _MOST_CUTS)
        # A sliver without an area may be long all the same.
        wanted = np.maximum(np.sqrt(2.0 * area), np.minimum(longest, _LEAST_CUTS))
        levels = np.ceil(np.log2(np.maximum(np.sqrt(2.0 * area) / most, 1.0)))
        cuts = 2.0 ** np.ceil(np.log2(np.clip(wanted, 1.0, most)))
        return cuts.astype(np.int64), np.minimum(levels, len(self.levels) - 1).astype(np.int64)

    def _blended(self, places: np.ndarray, extension: str, interpolation: str) -> np.ndarray:
        """RGBA (m, 4) between the texels around each of the ``places`` (m, 2)."""
        size = np.array(self.levels[0].shape[1::-1])
        low = np.floor(places * size - 0.5)
        shares = shares_of_texels(places * size - 0.5 - low, interpolation)
        total = np.zeros((len(places), 4))
        for right, across in shares.items():
            for up, along in shares.items():
                weight = across[:, :1] * along[:, 1:]
                texels = _texels(self.texels, (low + (right + 0.5, up + 0.5)) / size, extension)
                total += weight * (self._recoded(texels.astype(float), linear_to_srgb) if self.encoded else texels)
        return self._recoded(total, srgb_to_linear) if self.encoded else total

    def _recoded(self, rgba: np.ndarray, curve) -> np.ndarray:
        """RGBA (m, 4) whose colours, without the alpha that they may be multiplied by, go through a ``curve``."""
        alpha = np.maximum(rgba[:, 3:], 1e-9) if self.associated else 1.0
        return np.concatenate([curve(rgba[:, :3] / alpha) * alpha, rgba[:, 3:]], axis=1)


def _fitting(rgba: np.ndarray, colours: np.ndarray, associated: bool) -> np.ndarray:
    """Those ``colours`` (H, W, 3 or more) with the alpha of ``rgba`` (H, W, 4), halved until they fit."""
    alpha = rgba[..., 3:]
    picture = np.concatenate([colours[..., :3] * alpha if associated else colours[..., :3], alpha], axis=2)
    while max(picture.shape[:2]) > LARGEST_SIDE:
        picture = _halved(picture)
    return picture


def shares_of_texels(x, interpolation: str) -> dict[int, np.ndarray]:
    """The shares, along an axis, of the texels by how many steps on they are, at a place ``x`` of a step past one.

    *Cubic* and *Smart* are uniform cubic B-splines.
    """
    if interpolation == "Linear":
        return {0: 1.0 - x, 1: x}
    parts = (1.0 - x) ** 3, 4.0 - 6.0 * x**2 + 3.0 * x**3, 1.0 + 3.0 * x + 3.0 * x**2 - 3.0 * x**3, x**3
    return {step - 1: part / 6.0 for step, part in enumerate(parts)}


def _texels(picture: np.ndarray, places: np.ndarray, extension: str) -> np.ndarray:
    """RGBA (m, 4) of the texels of a ``picture`` (H, W, 4) at ``places`` (m, 2)."""
    height, width = picture.shape[:2]
    column, row = (
        np.minimum((_wrapped(places[:, axis], extension) * size).astype(np.int32), size - 1)
        for axis, size in enumerate((width, height))
    )
    texels = picture.reshape(-1, 4).take(row * width + column, axis=0)
    if extension == "CLIP":
        texels[((places < 0) | (places > 1)).any(axis=1)] = 0.0
    return texels


def triangle_centres(rows: int) -> np.ndarray:
    """Barycentric centres (rows^2, 3) of the equal triangles that ``rows`` cuts along each edge give."""
    centres = []
    for i in range(rows):
        for j in range(rows - i):
            centres.append((3 * i + 1, 3 * j + 1))
            if j < rows - i - 1:
                centres.append((3 * i + 2, 3 * j + 2))
    first_two = np.array(centres) / (3.0 * rows)
    return np.concatenate([first_two, 1.0 - first_two.sum(axis=1, keepdims=True)], axis=1)


def _wrapped(place: np.ndarray, extension: str) -> np.ndarray:
    """Coordinates brought into 0..1."""
    if extension == "REPEAT":
        return place - np.floor(place)
    if extension == "MIRROR":
        return 1.0 - np.abs(place % 2.0 - 1.0)
    return np.clip(place, 0.0, 1.0)


def _halved(picture: np.ndarray) -> np.ndarray:
    """The picture with each side halved; the last row or column of an odd side counts twice."""
    height, width = picture.shape[:2]
    padded = np.pad(picture, ((0, height % 2 if height > 1 else 0), (0, width % 2 if width > 1 else 0), (0, 0)), "edge")
    if height > 1:
        padded = 0.5 * (padded[0::2] + padded[1::2])
    if width > 1:
        padded = 0.5 * (padded[:, 0::2] + padded[:, 1::2])
    return padded


def srgb_to_linear(encoded: np.ndarray) -> np.ndarray:
    """Linear light of sRGB-encoded values (IEC 61966-2-1)."""
    low = encoded <= 0.04045
    return np.where(low, encoded / 12.92, ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(linear: np.ndarray) -> np.ndarray:
    """The inverse of :func:`srgb_to_linear`."""
    low = linear <= 0.04045 / 12.92
    return np.where(low, linear * 12.92, 1.055 * np.maximum(linear, 0.04045 / 12.92) ** (1 / 2.4) - 0.055)
