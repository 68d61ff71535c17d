"""Lets Cycles make a picture of a world in all directions: whatever its nodes do, that is the light it sends."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import bpy
import numpy as np
from mathutils import Vector

from ...core.errors import SceneBusyError
from ...core.lights.sun import SunLight
from .placed_values import property_of
from .render_view import render, temporary_scene
from .views import WORLD_RAYS
from .world_spots import Spot, hide_suns, spots

#: the largest number of a node
LARGEST = float(np.finfo(np.float32).max)

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

#: sides of close-ups of what may be a sun, in pixels, and samples in each
CLOSE, _CLOSE_SAMPLES = 96, 32

#: suns have more than this share of the world's light, and, of images, are smaller than this many radians
_LEAST_SUN, _SMALL = 1e-3, 0.02

#: what surrounds them is darker than this share of their brightest
_BESIDE = 0.05


def world_lights(world, frame: int, left_out, owners: Sequence = ()) -> tuple[np.ndarray, list[SunLight]]:
    """What diffuse surfaces receive from ``world``: radiance (HEIGHT, WIDTH, 3), in the layout of EnvironmentWorld, and
    suns that are too small for a picture, which are no part of it.

    Other bright things are rendered again with more samples, so that their flux is right to about a percent.
    ``left_out`` is called with what cannot be honoured; ``owners``, the view layer and the scene, have what Attribute
    nodes ask for. Raises SceneBusyError when Blender refuses to render.
    """
    with temporary_scene(bpy.data.scenes.new("detp")) as scene, _seen_by_diffuse_light(world, owners) as copy:
        _prepare(scene, frame)
        scene.world = copy
        found = spots(copy.node_tree, left_out)
        near = [_close_up(scene, spot) for spot in found]
        hide_suns(copy.node_tree)
        _prepare(scene, frame)
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
    suns = [_taken_out(picture, *each) for each in zip(found, near, strict=True)]
    return picture, [sun for sun in suns if sun is not None]


def _close_up(scene, spot: Spot) -> np.ndarray:
    """Radiance (CLOSE, CLOSE, 3) around a spot, as a camera sees it that looks there."""
    camera = scene.camera
    camera.data.type = "PERSP"
    camera.data.sensor_width = 2.0
    camera.data.lens = 1.0 / math.tan(spot.half)
    camera.rotation_euler = Vector(spot.towards).to_track_quat("-Z", "Y").to_euler()
    scene.render.resolution_x = scene.render.resolution_y = CLOSE
    return _rendered(scene, _CLOSE_SAMPLES)


def _taken_out(picture: np.ndarray, spot: Spot, near: np.ndarray) -> SunLight | None:
    """A sun for what a spot's close-up ``near`` has beyond what surrounds it, None when that is little.

    What surrounds it is left in its place in the ``picture``, from which the discs of skies are hidden already.
    """
    steps = ((np.arange(CLOSE) + 0.5) / CLOSE * 2.0 - 1.0) * math.tan(spot.half)
    across, up = np.meshgrid(steps, steps)
    square = across**2 + up**2
    within = square < math.tan(spot.half) ** 2
    solid_angle = within * (2.0 * math.tan(spot.half) / CLOSE) ** 2 / (1.0 + square) ** 1.5
    ring = within & (square > 0.8 * math.tan(spot.half) ** 2)
    background = np.median(near[ring], axis=0)
    excess = near - background
    flux = (excess * solid_angle[..., None]).sum(axis=(0, 1))
    directions, sizes = pixel_directions(HEIGHT, WIDTH)
    whole = np.abs(picture).max(axis=2) @ np.ones(WIDTH) @ sizes + np.abs(flux).max()
    weight = np.maximum(excess.sum(axis=2), 0.0) * solid_angle
    strength = excess.max(axis=2)
    alone = strength[ring].max() <= _BESIDE * strength.max()
    if np.abs(flux).max() <= _LEAST_SUN * whole or not weight.any() or not alone:
        return None
    middle = np.array([(weight * across).sum(), (weight * up).sum()]) / weight.sum()
    turn = np.array(Vector(spot.towards).to_track_quat("-Z", "Y").to_matrix())
    if spot.disc is not None:
        return SunLight(-spot.towards, flux, spot.disc)
    spread = (weight * ((across - middle[0]) ** 2 + (up - middle[1]) ** 2)).sum() / weight.sum()
    # Of a disc that is bright all over the mean square is half of its radius squared.
    angle = 2.0 * math.atan(math.sqrt(2.0 * spread))
    if angle > _SMALL:
        return None
    near_by = directions @ spot.towards > math.cos(spot.half + np.pi / HEIGHT)
    picture[near_by] = np.minimum(picture[near_by], background)
    return SunLight(-turn @ np.array((*middle, -1.0)), flux, angle)


def pixel_directions(height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (height, width, 3) to the middles of a picture's pixels, and solid angles (height,) of a pixel."""
    latitude = np.pi * ((np.arange(height) + 0.5) / height - 0.5)
    azimuth = 2.0 * np.pi * (0.5 - (np.arange(width) + 0.5) / width)
    level = np.cos(latitude)[:, None]
    up = np.broadcast_to(np.sin(latitude)[:, None], (height, width))
    towards = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), up], axis=-1)
    return towards, np.cos(latitude) * (np.pi / height) * (2.0 * np.pi / width)


@contextmanager
def _seen_by_diffuse_light(world, owners: Sequence = ()) -> Iterator[bpy.types.World]:
    """A copy of the world that shows the camera what diffuse rays see."""
    copy, groups = world.copy(), []
    try:
        visibility = getattr(copy, "cycles_visibility", None)
        if visibility:
            visibility.camera = True
        if hasattr(copy, "cycles"):
            # Only the camera looks at the sky: a map of where to send shadow rays would be made for nothing.
            copy.cycles.sampling_method = "NONE"
        _set_known(copy.node_tree, groups, (*owners, world))
        yield copy
    finally:
        bpy.data.worlds.remove(copy)
        for group in groups:
            bpy.data.node_groups.remove(group)


def _set_known(tree, groups: list, owners: Sequence) -> None:
    """Let all Light Path nodes in a tree tell what diffuse light sees, and Attribute nodes what the ``owners`` have.

    Its outputs have no volume, and its node groups become copies, in ``groups``.
    """
    for node in list(tree.nodes):
        if node.bl_idname == "ShaderNodeOutputWorld":
            # Cycles takes outputs inside groups, too.
            for link in list(node.inputs["Volume"].links):
                tree.links.remove(link)
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            node.node_tree = node.node_tree.copy()
            groups.append(node.node_tree)
            _set_known(node.node_tree, groups, owners)
        elif node.bl_idname == "ShaderNodeLightPath" and not node.mute:
            for socket in node.outputs:
                _replace(tree, socket, min(WORLD_RAYS.get(socket.identifier, 0.0), LARGEST))
        elif getattr(node, "attribute_type", "") == "VIEW_LAYER" and not node.mute:
            found = property_of(owners, node.attribute_name)
            for socket in node.outputs if found is not None else ():
                number = {"Fac": found[:3].mean(), "Alpha": found[3]}.get(socket.identifier)
                _replace(tree, socket, tuple(found) if number is None else number)


def _replace(tree, socket, known: float | tuple) -> None:
    """Let a plain number or colour take the place of an output."""
    targets = [link.to_socket for link in socket.links]
    if not targets:
        return
    value = tree.nodes.new("ShaderNodeRGB" if isinstance(known, tuple) else "ShaderNodeValue")
    value.outputs[0].default_value = known
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
    if camera.name not in scene.collection.objects:
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
    shape = scene.render.resolution_y, scene.render.resolution_x, -1
    return np.nan_to_num(values.reshape(shape)[..., :3].astype(np.float64), posinf=0.0, neginf=0.0)


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
