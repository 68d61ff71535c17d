"""Baked animations for engines: a texture of vertices by frames, as vertex animation textures are.

The exporter of glTF gives vertices an order of its own and splits them, so a UV map says where in the texture the light
of each lies: it goes through any exporter.
"""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import AttributeNameTakenError, InvalidSettingError, NotBakedError, UnwritableFileError
from ..files.write_files import reason, replace_file, write_text
from ..reading.read_meshes import corner_vertex_indices
from ..writing.baked_layers import light_of
from .playback import animated_objects, played_frames, stored_keys

#: the name of the UV map
UV_MAP = "detp_frames"

#: the sides of textures that all engines take, from the one that is tried first on
SIDES = (4096, 8192, 16384)

#: layers that a mesh has room for
_MOST_UV_MAPS = 8


def texture_of(scene: bpy.types.Scene, attribute: str) -> tuple[np.ndarray, dict]:
    """The pixels (H, W, 3), first row at the top, of the light of all frames, and what describes them.

    The values of a frame fill rows from the top left on, object by object; so do the next frame's below. Each mesh gets
    the UV map, in which its vertices lie in the rows of one frame. Raises NotBakedError without an animation,
    InvalidSettingError when it fits no texture, AttributeNameTakenError when a mesh has no room for the map.
    """
    objects = animated_objects(scene.objects, attribute)
    if not objects:
        raise NotBakedError(f"No mesh plays an animation in '{attribute}': bake one first.")
    frames = played_frames(objects[0].data, attribute)
    objects = [obj for obj in objects if played_frames(obj.data, attribute) == frames]
    keys = [stored_keys(obj.data, attribute) for obj in objects]
    counts, count = [rgb.shape[1] for rgb in keys], len(frames.keys)
    total = sum(counts)
    width = next((side for side in SIDES if -(-total // min(side, total)) * count <= side), None)
    if width is None:
        raise InvalidSettingError(
            f"{total} values at {count} frames fit no texture of {SIDES[-1]} pixels: bake fewer frames or objects."
        )
    width = min(width, total)
    rows = -(-total // width)
    pixels = np.zeros((count, rows * width, 3), np.float32)
    places, first = {}, 0
    for obj, rgb, size in zip(objects, keys, counts, strict=True):
        pixels[:, first : first + size] = rgb
        layer = _map(obj, np.arange(first, first + size), (width, rows), obj.data.attributes[attribute].domain)
        places[obj.name] = {"mesh": obj.data.name, "first": first, "count": size, "texcoord": layer}
        first += size
    light = light_of(objects[0].data, attribute)
    description = {
        "width": width, "height": rows * count, "rows_per_frame": rows,
        "frames": list(frames.keys), "fps": scene.render.fps / scene.render.fps_base,
        "quantity": light["quantity"], "scale": light["scale"], "attribute": attribute,
        "domain": objects[0].data.attributes[attribute].domain.lower(), "uv_map": UV_MAP,
        "v": "(frame row + v of TEXCOORD) / number of frames, from the top; nearest in u and v, blend two frames",
        "objects": places,
    }  # fmt: skip
    return pixels.reshape(count * rows, width, 3), description


def write_texture(path: Path, pixels: np.ndarray, description: dict) -> None:
    """Write ``pixels`` as an OpenEXR of 32 bits at ``path``, and beside it the ``description`` as JSON.

    Raises DiskFullError or UnwritableFileError.
    """
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(path.stem, width, height, alpha=True, float_buffer=True, is_data=True)
    try:
        rgba = np.ones((height, width, 4), np.float32)
        rgba[..., :3] = pixels[::-1]  # Blender's first row is the lowest
        image.pixels.foreach_set(rgba.ravel())
        replace_file(path, lambda made: _save(image, made, path), rgba.nbytes)
    finally:
        bpy.data.images.remove(image)
    write_text(path.with_suffix(".json"), json.dumps({"texture": path.name, **description}, indent=2) + "\n")


def _save(image: bpy.types.Image, made: Path, path: Path) -> None:
    image.file_format = "OPEN_EXR"
    try:
        image.save(filepath=str(made))
    except RuntimeError as error:
        raise UnwritableFileError(f"Blender cannot write '{path}': {reason(error)}.") from None


def _map(obj: bpy.types.Object, numbers: np.ndarray, size: tuple[int, int], domain: str) -> int:
    """Let the UV map of a mesh say where the values of those ``numbers`` lie in rows of ``size``; its number."""
    layers, (width, rows) = obj.data.uv_layers, size
    layer = layers.get(UV_MAP)
    if layer is None:
        if len(layers) >= _MOST_UV_MAPS:
            raise AttributeNameTakenError(f"'{obj.name}' has no room for the UV map '{UV_MAP}': remove one it has.")
        shown = [layers.active_index, next((row for row, each in enumerate(layers) if each.active_render), 0)]
        layer = layers.new(name=UV_MAP, do_init=False)
        layers.active_index, layers[shown[1]].active_render = shown[0], True
        layer = layers[UV_MAP]
    if domain == "POINT":
        numbers = numbers[corner_vertex_indices(obj.data)]
    # Blender's v grows upwards, and exporters of glTF turn it about.
    at = np.stack([(numbers % width + 0.5) / width, 1.0 - (numbers // width + 0.5) / rows], axis=1)
    layer.uv.foreach_set("vector", at.astype(np.float32).ravel())
    return layers.find(UV_MAP)
