"""An image at halving sizes, so that its mean over a patch of any size is one look-up; NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: larger images are halved until they fit: what counts is the mean over whole triangles
LARGEST_SIDE = 1024


@dataclass(frozen=True)
class TexturePyramid:
    """Linear RGBA pictures (H, W, 4), row 0 at the bottom, each half the size of the one before.

    ``associated`` says that the colours are multiplied by the alpha, which keeps clear texels from tinting means.
    """

    levels: tuple[np.ndarray, ...]
    associated: bool

    @classmethod
    def of(cls, rgba: np.ndarray, associated: bool) -> TexturePyramid:
        """From linear RGBA (H, W, 4) whose colours are not multiplied by the alpha."""
        if associated:
            rgba = np.concatenate([rgba[..., :3] * rgba[..., 3:], rgba[..., 3:]], axis=2)
        while max(rgba.shape[:2]) > LARGEST_SIDE:
            rgba = _halved(rgba)
        levels = [rgba]
        while max(levels[-1].shape[:2]) > 1:
            levels.append(_halved(levels[-1]))
        # Half floats are exact to 0.05 % and keep a scene with many textures small; bright skies do not fit.
        dtype = np.float16 if rgba.max(initial=0.0) < 6e4 else np.float32
        return cls(tuple(level.astype(dtype) for level in levels), associated)

    @property
    def mean(self) -> np.ndarray:
        """The mean colour and alpha (4,), associated as the levels are."""
        return self.levels[-1][0, 0].astype(np.float64)

    def patches(self, u: np.ndarray, v: np.ndarray, share: np.ndarray, extension: str) -> np.ndarray:
        """Mean RGBA (m, 4) around the coordinates ``u``, ``v`` (m,), over a patch of ``share`` (m,) of the image.

        ``extension`` says what lies outside 0..1: REPEAT, MIRROR, EXTEND or CLIP (clear black). Coordinates that are
        not finite give the mean of the whole image.
        """
        height, width = self.levels[0].shape[:2]
        texels = np.nan_to_num(share * (height * width), nan=1.0, posinf=1.0)
        level = np.clip(np.rint(0.5 * np.log2(np.maximum(texels, 1.0))), 0, len(self.levels) - 1).astype(np.int64)
        known = np.isfinite(u) & np.isfinite(v)
        level[~known] = len(self.levels) - 1
        x, y = (_wrapped(np.where(known, place, 0.5), extension) for place in (u, v))
        result = np.empty((len(u), 4))
        for index in np.unique(level):
            here = level == index
            picture = self.levels[index]
            rows = np.minimum((y[here] * picture.shape[0]).astype(np.int64), picture.shape[0] - 1)
            columns = np.minimum((x[here] * picture.shape[1]).astype(np.int64), picture.shape[1] - 1)
            result[here] = picture[rows, columns]
        if extension == "CLIP":
            result[known & ((u < 0) | (u > 1) | (v < 0) | (v > 1))] = 0.0
        return result


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
