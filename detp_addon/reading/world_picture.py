"""Lets Cycles make a picture of a world in all directions: whatever its nodes do, that is the light it sends."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

from ...core.errors import SceneBusyError
from .render_view import render, temporary_scene
from .views import WORLD_RAYS

#: size of the picture; the sun is about one and a half pixels wide
WIDTH, HEIGHT = 1024, 512

#: samples a pixel, everywhere
_SAMPLES = 8

#: samples, together, for the part that holds the brightest pixels
_BRIGHT_SAMPLES = 1 << 21

#: a pixel this many times brighter than the mean, and this share of the brightest, is looked at again
_BRIGHT, _AS_BRIGHT_AS = 10.0, 0.01

#: most samples a pixel
_MOST_SAMPLES = 1 << 13


def world_picture(world, frame: int) -> np.ndarray:
    """Radiance (HEIGHT, WIDTH, 3) that diffuse surfaces receive from ``world``, in the layout of EnvironmentWorld.

    Small bright things such as the sun are rendered again with more samples, so that their flux is right to about a
    percent. Raises SceneBusyError when Blender refuses to render.
    """
    with temporary_scene(bpy.data.scenes.new("detp")) as scene, _seen_by_diffuse_light(world) as copy:
        _prepare(scene, frame)
        scene.world = copy
        picture = _rendered(scene, _SAMPLES)
        box = _bright_box(picture)
        if box is not None:
            low_row, high_row, low_column, high_column = box
            settings = scene.render
            settings.use_border = True
            settings.border_min_x, settings.border_max_x = low_column / WIDTH, high_column / WIDTH
            settings.border_min_y, settings.border_max_y = low_row / HEIGHT, high_row / HEIGHT
            pixels = (high_row - low_row) * (high_column - low_column)
            again = _rendered(scene, int(np.clip(_BRIGHT_SAMPLES // pixels, _SAMPLES, _MOST_SAMPLES)))
            rows, columns = slice(low_row, high_row), slice(low_column, high_column)
            picture[rows, columns] = again[rows, columns]
    return picture


@contextmanager
def _seen_by_diffuse_light(world) -> Iterator[bpy.types.World]:
    """A copy of the world that shows the camera what diffuse rays see."""
    copy, groups = world.copy(), []
    try:
        visibility = getattr(copy, "cycles_visibility", None)
        if visibility:
            visibility.camera = True
        if hasattr(copy, "cycles"):
            # Only the camera looks at the sky: a map of where to send shadow rays would be made for nothing.
            copy.cycles.sampling_method = "NONE"
        tree = copy.node_tree
        output = tree.get_output_node("CYCLES")
        for link in list(output.inputs["Volume"].links):
            tree.links.remove(link)
        _set_rays(tree, groups)
        yield copy
    finally:
        bpy.data.worlds.remove(copy)
        for group in groups:
            bpy.data.node_groups.remove(group)


def _set_rays(tree, groups: list) -> None:
    """Let all Light Path nodes in a tree tell what diffuse light sees; its node groups become copies, in ``groups``."""
    for node in list(tree.nodes):
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            node.node_tree = node.node_tree.copy()
            groups.append(node.node_tree)
            _set_rays(node.node_tree, groups)
        elif node.bl_idname == "ShaderNodeLightPath":
            for socket in node.outputs:
                _replace(tree, socket, 0.0 if node.mute else WORLD_RAYS.get(socket.identifier, 0.0))


def _replace(tree, socket, number: float) -> None:
    """Let a plain number take the place of an output."""
    targets = [link.to_socket for link in socket.links]
    if not targets:
        return
    value = tree.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = number
    for target in targets:
        tree.links.new(value.outputs[0], target)


def _prepare(scene, frame: int) -> None:
    """Set an empty scene up for an equirectangular picture of exact linear values."""
    scene.frame_current = frame
    camera = scene.camera
    camera.data.type = "PANO"
    # Panoramas were Cycles' own setting before 5.0.
    panorama = camera.data if hasattr(camera.data, "panorama_type") else camera.data.cycles
    panorama.panorama_type = "EQUIRECTANGULAR"
    # Upright, with the middle of the picture looking along +X.
    camera.rotation_euler = (0.5 * math.pi, 0.0, -0.5 * math.pi)
    scene.collection.objects.link(camera)
    settings = scene.render
    settings.engine = "CYCLES"
    settings.resolution_x, settings.resolution_y, settings.resolution_percentage = WIDTH, HEIGHT, 100
    settings.use_compositing = settings.use_sequencer = settings.use_crop_to_border = False
    settings.film_transparent = False
    settings.image_settings.file_format = "OPEN_EXR"
    settings.image_settings.color_mode = "RGB"
    settings.image_settings.color_depth = "32"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    cycles.seed = 0


def _rendered(scene, samples: int) -> np.ndarray:
    scene.cycles.samples = samples
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "world.exr")
        scene.render.filepath = path
        render(scene, write=True)
        if not os.path.exists(path):
            raise SceneBusyError("Cycles could not make a picture of the world: try again when no render is running.")
        image = bpy.data.images.load(path)
        try:
            # The file holds scene-linear values, which any conversion would change.
            image.colorspace_settings.name = "Non-Color"
            values = np.empty(len(image.pixels), np.float32)
            image.pixels.foreach_get(values)
        finally:
            bpy.data.images.remove(image)
    return np.nan_to_num(values.reshape(HEIGHT, WIDTH, -1)[..., :3].astype(np.float64), posinf=0.0, neginf=0.0)


def _bright_box(picture: np.ndarray) -> tuple[int, int, int, int] | None:
    """Rows and columns (low, high, low, high) around the pixels that outshine the rest, None without such pixels."""
    solid_angle = np.cos(np.pi * ((np.arange(HEIGHT) + 0.5) / HEIGHT - 0.5))
    strength = np.abs(picture).max(axis=2)
    mean = (strength * solid_angle[:, None]).sum() / (solid_angle.sum() * WIDTH)
    rows, columns = np.nonzero(strength > max(_BRIGHT * mean, _AS_BRIGHT_AS * strength.max()))
    if len(rows) == 0:
        return None
    margin = 2
    return (
        max(int(rows.min()) - margin, 0),
        min(int(rows.max()) + 1 + margin, HEIGHT),
        max(int(columns.min()) - margin, 0),
        min(int(columns.max()) + 1 + margin, WIDTH),
    )
