"""Reads Blender's images as linear light."""

from __future__ import annotations

import bpy
import numpy as np

from .findings import Findings
from .recalled import recalled
from .texture_pyramid import TexturePyramid, linear_to_srgb, shares_of_texels, srgb_to_linear
from .working_space import in_working_space, way_from

#: beginnings of names of colour spaces whose byte values are linear already, or data, or sRGB; others are decoded as
#: sRGB, and named
_DATA_SPACES = ("Non-Color", "Raw", "Utility - Raw", "Generic Data")
_LINEAR_SPACES = ("Linear", "ACEScg", "ACES2065", "ACES - ACEScg", "ACES - ACES2065", "Utility - Linear", *_DATA_SPACES)
_SRGB_SPACES = ("sRGB", "sRGB OETF", "sRGB - Texture", "sRGB Encoded Rec.709 (sRGB)", "Utility - sRGB - Texture")

#: steps of the table of decoded values, a multiple of those of bytes
_STEPS = 255 * 16

#: Of files Cycles goes by the image's alpha mode since 5.2, and by the file's format before.
_BY_MODE = bpy.app.version >= (5, 2)

#: formats of linear light, whose colours have the alpha in them as a rule; and those whose files say that themselves
_LIGHT_FORMATS = ("OPEN_EXR", "OPEN_EXR_MULTILAYER", "HDR", "DPX", "CINEON")
_VARIED_FORMATS = ("TIFF", "WEBP")

#: how far the place that stands for a quarter of a texel is from its middle: where the squares of the shares of texels
#: have their mean
_ASIDE = {"Linear": 0.5 - 0.5 / np.sqrt(3.0), "Cubic": 0.245, "Smart": 0.245}

#: images with longer sides have texels enough for one quarter of each to stand for all
_MANY_TEXELS = 256

#: what a missing image shows instead: Blender's default grey
MISSING = np.array([0.8, 0.8, 0.8, 1.0])


class Images:
    """The textures of a scene, each read once. What cannot be read is named in ``findings``."""

    def __init__(self, findings: Findings):
        self._findings = findings
        self._known: dict[tuple[int, bool, str], TexturePyramid] = {}

    def texture(self, image, with_alpha: bool, interpolation: str) -> TexturePyramid:
        """The image as a pyramid; grey when there is none, it is missing or moves.

        ``with_alpha`` says whether the image's alpha is used beside its colours, ``interpolation`` how texels blend.
        """
        if image is None:
            self._findings.warn("image textures without an image count as grey: {}", "node", "no image chosen")
            return _plain(MISSING)
        key = (image.as_pointer(), with_alpha, interpolation)
        if key not in self._known:
            self._known[key] = self._read(image, with_alpha, interpolation)
        return self._known[key]

    def _read(self, image, with_alpha: bool, interpolation: str) -> TexturePyramid:
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
        clear = pixels.shape[2] in (2, 4) and veils(image) and pixels[..., -1].min() < 1.0
        if clear and not _BY_MODE and not _held(image) and image.file_format in _VARIED_FORMATS:
            self._findings.warn("whether colours have the alpha in them, as renders ask the file, is taken from {}",
                                "image", image.name)  # fmt: skip
        spaces = (in_working_space(np.eye(3), each) for each in ("Linear Rec.709", space))
        kind = image.alpha_mode, image.is_float, _held(image), image.file_format
        given = pixels, space, *kind, with_alpha, interpolation, *spaces
        texture = recalled(lambda: _linear(image, pixels, with_alpha, interpolation), *given)
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


def _held(image) -> bool:
    """Whether Cycles takes the image from Blender, and does not open its file."""
    return image.source == "GENERATED" or image.is_dirty or len(image.packed_files) > 0


def veils(image) -> bool:
    """Whether the image's alpha says how much there is of its colours, as far as it has one."""
    return image.alpha_mode != "CHANNEL_PACKED" and image.colorspace_settings.name not in ("Non-Color", "Raw")


def _linear(image, pixels: np.ndarray, with_alpha: bool, interpolation: str) -> TexturePyramid:
    """The image as Cycles shows it: colours are divided by the alpha where that is used too, otherwise clear is black.

    Cycles keeps whole numbers of files as they are encoded until then, so their alpha multiplies the encoded colours.
    """
    channels = pixels.shape[2]
    rgb = np.repeat(pixels[..., :1], 3, axis=2) if channels < 3 else pixels[..., :3]
    has_alpha = channels in (2, 4) and image.alpha_mode != "NONE"
    alpha = pixels[..., -1:] if has_alpha else np.ones_like(rgb[..., :1])
    space = image.colorspace_settings.name
    veiled = has_alpha and veils(image)
    linear, shown = image.is_float or space.startswith(_LINEAR_SPACES), None
    if veiled:
        rgb = _under_alpha(image, rgb, alpha, with_alpha)
    if not linear:
        shares = alpha if veiled and with_alpha else np.ones((1, 1, 1), np.float32)
        shown = _blended(rgb, shares, interpolation) if interpolation != "Closest" else None
        rgb = _decoded(rgb)
    if not image.is_float and space not in _DATA_SPACES:
        known = space if linear else "Linear Rec.709"
        rgb, shown = (None if part is None else in_working_space(part, known) for part in (rgb, shown))
    rgba = np.concatenate([np.nan_to_num(rgb), np.nan_to_num(alpha)], axis=2)
    return TexturePyramid.of(rgba, veiled and with_alpha, shown)


def _under_alpha(image, rgb: np.ndarray, alpha: np.ndarray, with_alpha: bool) -> np.ndarray:
    """The image's ``rgb`` without the ``alpha`` in them where that is used too, with it otherwise.

    Blender hands out float images as linear, associated colours and byte images as they are stored.
    """
    held, encoded = _held(image), not image.colorspace_settings.name.startswith(_LINEAR_SPACES)
    usual = "PREMUL" if image.file_format in _LIGHT_FORMATS else "STRAIGHT"
    # Then Blender multiplied with the alpha, or divided by it, and Cycles did not.
    unlike_file = not _BY_MODE and not held and {image.alpha_mode, usual} == {"PREMUL", "STRAIGHT"}
    if image.is_float and encoded and not held and usual == "STRAIGHT":
        # Numbers of 16 bits, encoded, which Blender hands out as linear.
        rgb = _divided(rgb, alpha)
        for _ in range(unlike_file + (not with_alpha)):
            rgb = srgb_to_linear(linear_to_srgb(rgb) * alpha)
        return rgb
    if unlike_file:
        rgb = _divided(rgb, alpha) if usual == "PREMUL" else rgb * alpha
    # What Blender holds itself Cycles takes by the alpha mode since 5.2, whatever was done to it.
    associated = image.alpha_mode == "PREMUL" if _BY_MODE and held else image.is_float
    if associated == with_alpha:
        rgb = _divided(rgb, alpha) if with_alpha else rgb * alpha
    return rgb


def _divided(rgb: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    return np.divide(rgb, alpha, out=rgb.copy(), where=alpha > 0)


def _decoded(rgb: np.ndarray) -> np.ndarray:
    """Linear values of encoded ones, up to 1 by a table that is exact for bytes."""
    if rgb.max(initial=0.0) > 1.0 + 1e-6:
        return srgb_to_linear(rgb)
    table = srgb_to_linear(np.arange(_STEPS + 1) / _STEPS).astype(np.float32)
    return table[np.clip(np.rint(rgb * _STEPS), 0, _STEPS).astype(np.uint16)]


def _blended(encoded: np.ndarray, alpha: np.ndarray, interpolation: str) -> np.ndarray:
    """Linear colours (H, W, 3) that are shown on each texel on average, of ``encoded`` ones under an ``alpha``.

    Cycles blends the texels around a place as they are encoded, and decodes then (kernel/svm/image.h). One place in
    each quarter of a texel has the mean of squares right; of many texels one of the four will do.
    """
    parts = shares_of_texels(_ASIDE[interpolation], interpolation)

    def mixed(texels, ways):
        for axis, way in enumerate(ways):
            texels = sum(part * np.roll(texels, step * way, axis) for step, part in parts.items())
        return texels

    total, weight = 0.0, 1e-9
    for ways in ((1, 1), (1, -1), (-1, 1), (-1, -1))[: 1 if max(encoded.shape) > _MANY_TEXELS else 4]:
        share = mixed(alpha, ways)
        total = total + share * _decoded(mixed(encoded * alpha, ways) / np.maximum(share, 1e-9))
        weight = weight + share
    return total / weight
