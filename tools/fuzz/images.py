"""Images: generated, packed, missing, moving, empty, and with pixels that are no numbers."""

from __future__ import annotations

import bpy
import numpy as np
from fuzz.chance import Chance, put

KINDS = ("none", "missing", "generated", "painted", "painted", "packed", "float", "float", "tiled", "odd")


def odd_image(chance: Chance) -> bpy.types.Image | None:
    """An image, or none."""
    kind = chance.one_of(*KINDS)
    if kind == "none":
        return None
    if kind == "missing":
        image = bpy.data.images.new("missing", 1, 1)
        image.source = "FILE"
        image.filepath = "//no/such/file.png"
        return image
    width, height = chance.one_of((1, 1), (4, 4), (7, 3), (64, 1), (33, 65))
    image = bpy.data.images.new(
        kind, width, height, alpha=chance.likely(0.7), float_buffer=kind == "float", tiled=kind == "tiled"
    )
    put(image, "alpha_mode", chance.one_of("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"))
    put(image.colorspace_settings, "name", chance.one_of("sRGB", "Non-Color", "Linear Rec.709", "Filmic sRGB"))
    if kind in ("painted", "packed", "float"):
        pixels = chance.rows((len(image.pixels),), 0, 1)
        image.pixels.foreach_set(np.clip(pixels, -3e38, 3e38).astype(np.float32))
    if kind == "packed":
        image.pack()
    if kind == "odd":
        put(image, "source", chance.one_of("SEQUENCE", "MOVIE", "VIEWER", "GENERATED", "TILED"))
    return image
