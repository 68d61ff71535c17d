"""Reads Blender's images as linear light."""

from __future__ import annotations

import numpy as np

from .findings import Findings
from .recalled import recalled
from .texture_pyramid import TexturePyramid, srgb_to_linear
from .working_space import in_working_space, way_from

#: beginnings of names of colour spaces whose byte values are linear already, or data, or sRGB; others are decoded as
#: sRGB, and named
_DATA_SPACES = ("Non-Color", "Raw", "Utility - Raw", "Generic Data")
_LINEAR_SPACES = ("Linear", "ACEScg", "ACES2065", "ACES - ACEScg", "ACES - ACES2065", "Utility - Linear", *_DATA_SPACES)
_SRGB_SPACES = ("sRGB", "sRGB OETF", "sRGB - Texture", "sRGB Encoded Rec.709 (sRGB)", "Utility - sRGB - Texture")

#: steps of the table of decoded values, a multiple of those of bytes
_STEPS = 255 * 16

#: how far the place that stands for a quarter of a texel is from its middle: (1 - x)^2 + x^2 is 2/3, the mean there
_ASIDE = 0.5 - 0.5 / np.sqrt(3.0)

#: images with longer sides have texels enough for one quarter of each to stand for all
_MANY_TEXELS = 256

#: what a missing image shows instead: Blender's default grey
MISSING = np.array([0.8, 0.8, 0.8, 1.0])


class Images:
    """The textures of a scene, each read once. What cannot be read is named in ``findings``."""

    def __init__(self, findings: Findings):
        self._findings = findings
        self._known: dict[tuple[int, bool, bool], TexturePyramid] = {}

    def texture(self, image, with_alpha: bool, blend: bool) -> TexturePyramid:
        """The image as a pyramid; grey when there is none, it is missing or moves.

        ``with_alpha`` says whether the image's alpha is used beside its colours, ``blend`` whether texels are blended.
        """
        if image is None:
            self._findings.warn("image textures without an image count as grey: {}", "node", "no image chosen")
            return _plain(MISSING)
        key = (image.as_pointer(), with_alpha, blend)
        if key not in self._known:
            self._known[key] = self._read(image, with_alpha, blend)
        return self._known[key]

    def _read(self, image, with_alpha: bool, blend: bool) -> TexturePyramid:
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
        linear = space.startswith(_LINEAR_SPACES)
        known = space in (*_SRGB_SPACES, *_DATA_SPACES) or (linear and way_from(space) is not None)
        if not image.is_float and not known:
            taken = "Rec. 709" if linear else "sRGB"
            self._findings.warn(f"colours in the space {space} are taken for {taken} in {{}}", "image", image.name)
        spaces = (in_working_space(np.eye(3), each) for each in ("Linear Rec.709", space))
        given = pixels, space, image.alpha_mode, image.is_float, with_alpha, blend, *spaces
        texture = recalled(lambda: _linear(image, pixels, with_alpha, blend), *given)
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


def veils(image) -> bool:
    """Whether the image's alpha says how much there is of its colours, as far as it has one."""
    return image.alpha_mode != "CHANNEL_PACKED" and image.colorspace_settings.name not in ("Non-Color", "Raw")


def _linear(image, pixels: np.ndarray, with_alpha: bool, blend: bool) -> TexturePyramid:
    """The image as Cycles shows it: colours are divided by the alpha where that is used too, otherwise clear is black.

    Cycles keeps bytes as they are encoded until then, so their alpha multiplies the encoded colours. ``blend`` says
    whether it blends texels.
    """
    channels = pixels.shape[2]
    rgb = np.repeat(pixels[..., :1], 3, axis=2) if channels < 3 else pixels[..., :3]
    has_alpha = channels in (2, 4) and image.alpha_mode != "NONE"
    alpha = pixels[..., -1:] if has_alpha else np.ones_like(rgb[..., :1])
    space = image.colorspace_settings.name
    veiled = has_alpha and veils(image)
    linear, shown = image.is_float or space.startswith(_LINEAR_SPACES), None
    # Blender hands out float images as linear, associated colours and byte images as they are stored.
    if image.is_float:
        if veiled and with_alpha:
            rgb = np.divide(rgb, alpha, out=rgb.copy(), where=alpha > 0)
    elif veiled and not with_alpha:
        rgb = rgb * alpha
    if not linear:
        shown = _blended(rgb, alpha if veiled and with_alpha else np.ones_like(alpha)) if blend else None
        rgb = _decoded(rgb)
    if not image.is_float and space not in _DATA_SPACES:
        known = space if linear else "Linear Rec.709"
        rgb, shown = (None if part is None else in_working_space(part, known) for part in (rgb, shown))
    rgba = np.concatenate([np.nan_to_num(rgb), np.nan_to_num(alpha)], axis=2)
    return TexturePyramid.of(rgba, veiled and with_alpha, shown)


def _decoded(rgb: np.ndarray) -> np.ndarray:
    """Linear values of encoded ones, by a table that is exact for bytes."""
    table = srgb_to_linear(np.arange(_STEPS + 1) / _STEPS).astype(np.float32)
    return table[np.clip(np.rint(rgb * _STEPS), 0, _STEPS).astype(np.uint16)]


def _blended(encoded: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Linear colours (H, W, 3) that are shown on each texel on average, of ``encoded`` ones under an ``alpha``.

    Cycles blends the four texels around a place as they are encoded, and decodes then (kernel/svm/image.h). One place
    in each quarter of a texel has the mean of squares right; of many texels one of the four will do.
    """
    veiled, total, weight = np.concatenate([encoded * alpha, alpha], axis=2), 0.0, 1e-9
    for up, right in ((1, 1), (1, -1), (-1, 1), (-1, -1))[: 1 if max(encoded.shape) > _MANY_TEXELS else 4]:
        mixed = veiled
        for axis, way in enumerate((up, right)):
            mixed = (1.0 - _ASIDE) * mixed + _ASIDE * np.roll(mixed, way, axis)
        share = mixed[..., 3:]
        total = total + share * _decoded(mixed[..., :3] / np.maximum(share, 1e-9))
        weight = weight + share
    return total / weight
