"""Reads Blender's images as linear light."""

from __future__ import annotations

import numpy as np

from .findings import Findings
from .recalled import recalled
from .texture_pyramid import TexturePyramid, srgb_to_linear
from .working_space import in_working_space

#: colour spaces whose byte values are linear already, or data; others but sRGB are decoded as sRGB, and named
_LINEAR_SPACES = ("Non-Color", "Linear", "Raw", "ACES", "Utility - Linear", "Utility - Raw", "Generic Data")
_DATA_SPACES = ("Non-Color", "Raw", "Utility - Raw", "Generic Data")

#: what a missing image shows instead: Blender's default grey
MISSING = np.array([0.8, 0.8, 0.8, 1.0])


class Images:
    """The textures of a scene, each read once. What cannot be read is named in ``findings``."""

    def __init__(self, findings: Findings):
        self._findings = findings
        self._known: dict[tuple[int, bool], TexturePyramid] = {}

    def texture(self, image, with_alpha: bool) -> TexturePyramid:
        """The image as a pyramid; grey when there is none, it is missing or moves.

        ``with_alpha`` says whether the image's alpha is used beside its colours.
        """
        if image is None:
            self._findings.warn("image textures without an image count as grey: {}", "node", "no image chosen")
            return _plain(MISSING)
        key = (image.as_pointer(), with_alpha)
        if key not in self._known:
            self._known[key] = self._read(image, with_alpha)
        return self._known[key]

    def _read(self, image, with_alpha: bool) -> TexturePyramid:
        if image.source in ("SEQUENCE", "MOVIE", "VIEWER"):
            self._findings.warn("moving and rendered images count as grey: {}", "image", image.name)
            return _plain(MISSING)
        if image.source == "TILED":
            self._findings.warn("only the first tile is read of {}", "tiled image", image.name)
        had_data = image.has_data
        pixels = pixels_of(image)
        if pixels is None:
            self._findings.warn("missing images count as grey: {}", "image", image.name)
            return _plain(MISSING)
        self._findings.modelled("{}, averaged over each triangle", "image texture", image.name)
        space = image.colorspace_settings.name
        if not image.is_float and not space.startswith(("sRGB", *_LINEAR_SPACES)):
            self._findings.warn(f"colours in the space {space} are taken for sRGB in {{}}", "image", image.name)
        spaces = (in_working_space(np.eye(3), each) for each in ("Linear Rec.709", space))
        known = pixels, space, image.alpha_mode, image.is_float, with_alpha, *spaces
        texture = recalled(lambda: _linear(image, pixels, with_alpha), *known)
        if not had_data:
            # Asking an image for almost anything loads it; what Blender did not hold before it need not hold now.
            image.buffers_free()
        return texture


def _plain(rgba: np.ndarray) -> TexturePyramid:
    return TexturePyramid.of(rgba[None, None, :], associated=True)


def pixels_of(image) -> np.ndarray | None:
    """The image's values as stored (H, W, 1 to 4), row 0 at the bottom; None when the file is missing."""
    width, height = image.size
    channels = image.channels
    count = len(image.pixels) if width and height else 0
    if count == 0 or count != width * height * channels:
        return None
    values = np.empty(count, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(height, width, channels)


def _linear(image, pixels: np.ndarray, with_alpha: bool) -> TexturePyramid:
    """The image as Cycles shows it: colours are divided by the alpha where that is used too, otherwise clear is black.

    Cycles keeps bytes as they are encoded until then, so their alpha multiplies the encoded colours.
    """
    channels = pixels.shape[2]
    rgb = np.repeat(pixels[..., :1], 3, axis=2) if channels < 3 else pixels[..., :3]
    has_alpha = channels in (2, 4) and image.alpha_mode != "NONE"
    alpha = pixels[..., -1:] if has_alpha else np.ones_like(rgb[..., :1])
    space = image.colorspace_settings.name
    veiled = has_alpha and image.alpha_mode != "CHANNEL_PACKED" and space not in ("Non-Color", "Raw")
    # Blender hands out float images as linear, associated colours and byte images as they are stored.
    if image.is_float:
        if veiled and with_alpha:
            rgb = np.divide(rgb, alpha, out=rgb.copy(), where=alpha > 0)
    else:
        rgb = rgb * alpha if veiled and not with_alpha else rgb
        linear = space.startswith(_LINEAR_SPACES)
        rgb = rgb if linear else _decoded(rgb)
        if space not in _DATA_SPACES:
            rgb = in_working_space(rgb, space if linear else "Linear Rec.709")
    rgba = np.concatenate([np.nan_to_num(rgb), np.nan_to_num(alpha)], axis=2)
    return TexturePyramid.of(rgba, associated=veiled and with_alpha)


def _decoded(rgb: np.ndarray) -> np.ndarray:
    """Linear values of bytes that Blender hands out as floats: 256 of them, so a table does it."""
    table = srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)
    return table[np.clip(np.rint(rgb * 255.0), 0, 255).astype(np.uint8)]
