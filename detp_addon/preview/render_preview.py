"""A picture of baked colours, rendered without lights by Cycles on the CPU, so that a person can look."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ..reading.render_view import render, temporary_scene
from ..writing.baked_layers import stored_colours
from .camera import frame

#: faces that coincide show by chance one or the other: there more samples are taken
WIDTH, HEIGHT, LEAST_SAMPLES, MOST_SAMPLES, NOISE = 960, 540, 16, 64, 0.05
BACKGROUND = 0.02
#: what meshes without the attribute show
NEUTRAL = 0.18
#: share of the colours that the exposure keeps below this brightness
EXPOSED_SHARE, EXPOSED_TO = 0.95, 0.8
#: by so much of an object's usual size faces are lifted to their fronts, so that of two back to back each shows its own
LIFT = 1e-4
#: pass index that marks objects without the attribute while the picture is rendered
UNBAKED = 32767

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)


def render_preview(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, attribute: str, path: Path) -> float:
    """Render the colour ``attribute`` of the scene's meshes to the PNG file ``path``; return the exposure in stops.

    The scene's camera is used, or one that sees everything baked, from inside when the scene is a closed room.
    What the picture needs is made for it and removed again; nothing of the scene changes.

    Raises SceneBusyError when Blender cannot render or write.
    """
    gain = exposure_gain(scene, attribute)
    baked = _baked_objects(scene, attribute) or [obj for obj in scene.objects if obj.type == "MESH"]
    look = _look(attribute, gain, LIFT * float(np.median([obj.dimensions.length for obj in baked] or [0.0])))
    marked, sharp = _unbaked_marked(attribute), _sharp(scene.camera)
    with temporary_scene(scene.copy()) as copy, look as (material, world), marked, sharp:
        if scene.camera is None:
            frame(copy.camera, baked, scene, view_layer, WIDTH / HEIGHT)
        size = (WIDTH, HEIGHT) if scene.camera is None else _size_for(scene.render)
        _set_up(copy, view_layer.name, size, material, world, path)
        render(copy, write=True)
    return math.log2(gain)


def exposure_gain(scene: bpy.types.Scene, attribute: str) -> float:
    """The factor that brings EXPOSED_SHARE of the baked, lit colours below EXPOSED_TO; 1 when all are black."""
    layers = [obj.data.attributes[attribute] for obj in _baked_objects(scene, attribute)]
    lit = [light[light > 0] for light in (stored_colours(layer)[:, :3] @ _LUMINANCE for layer in layers)]
    lit = np.concatenate(lit) if lit else np.empty(0)
    return EXPOSED_TO / float(np.quantile(lit, EXPOSED_SHARE)) if len(lit) else 1.0


def _baked_objects(scene: bpy.types.Scene, attribute: str) -> list[bpy.types.Object]:
    return [obj for obj in scene.objects if not obj.hide_render and _has_colours(obj, attribute)]


def _has_colours(obj: bpy.types.Object, attribute: str) -> bool:
    layer = obj.data.attributes.get(attribute) if obj.type == "MESH" else None
    return layer is not None and layer.data_type in ("FLOAT_COLOR", "BYTE_COLOR")


def _size_for(settings: bpy.types.RenderSettings) -> tuple[int, int]:
    """Width and height with the proportions for which the scene's camera was placed, and as many pixels as usual."""
    wide = settings.resolution_x * settings.pixel_aspect_x
    high = settings.resolution_y * settings.pixel_aspect_y
    width = math.sqrt(WIDTH * HEIGHT * wide / high)
    return max(4, round(width)), max(4, round(width * high / wide))


def _set_up(scene, layer_name: str, size: tuple[int, int], material, world, path: Path) -> None:
    for layer in scene.view_layers:
        layer.use = layer.name == layer_name
        layer.material_override = material
        layer.world_override = None
        layer.samples = 0
    scene.world = world
    settings = scene.render
    settings.engine = "CYCLES"
    settings.resolution_x, settings.resolution_y = size
    settings.resolution_percentage = 100
    settings.pixel_aspect_x = settings.pixel_aspect_y = 1.0
    settings.filepath = str(path.absolute())
    settings.use_file_extension = False
    settings.use_overwrite = True
    settings.film_transparent = False
    if hasattr(settings.image_settings, "media_type"):  # Blender 5.0: formats are those of what is made, maybe a film
        settings.image_settings.media_type = "IMAGE"
    settings.image_settings.file_format = "PNG"
    settings.image_settings.color_mode, settings.image_settings.color_depth = "RGB", "8"
    settings.image_settings.color_management = "FOLLOW_SCENE"
    # A picture that is passed on should not tell in which folder it was made.
    for name in (
        "border", "compositing", "sequencer", "freestyle", "multiview", "stamp", "stamp_filename", "motion_blur",
        "persistent_data", "placeholder",
    ):  # fmt: skip
        setattr(settings, f"use_{name}", False)
    scene.display_settings.display_device = "sRGB"
    view = scene.view_settings
    view.view_transform, view.look, view.exposure, view.gamma = "Standard", "None", 0.0, 1.0
    view.use_curve_mapping = False
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.max_bounces = "CPU", MOST_SAMPLES, 0
    cycles.use_adaptive_sampling, cycles.adaptive_min_samples, cycles.adaptive_threshold = True, LEAST_SAMPLES, NOISE
    cycles.use_denoising = False
    cycles.film_exposure = 1.0
    cycles.shading_system = False


@contextmanager
def _look(attribute: str, gain: float, height: float) -> Iterator[tuple[bpy.types.Material, bpy.types.World]]:
    """A material that glows in the attribute's colour, or neutral on UNBAKED objects, and a dark world.

    It lifts faces by a ``height`` in Blender units.
    """
    material = bpy.data.materials.new("detp preview")
    world = bpy.data.worlds.new("detp preview")
    try:
        _light_up(material, attribute, gain, height)
        nodes = _emptied(world)
        background = nodes.new("ShaderNodeBackground")
        background.inputs["Color"].default_value = (BACKGROUND, BACKGROUND, BACKGROUND, 1)
        world.node_tree.links.new(background.outputs[0], nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
        yield material, world
    finally:
        bpy.data.materials.remove(material)
        bpy.data.worlds.remove(world)


def _light_up(material: bpy.types.Material, attribute: str, gain: float, height: float) -> None:
    nodes, links = _emptied(material), material.node_tree.links
    baked, neutral = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeEmission")
    baked.inputs["Strength"].default_value = gain
    neutral.inputs["Color"].default_value = (NEUTRAL, NEUTRAL, NEUTRAL, 1)
    colour = nodes.new("ShaderNodeAttribute")
    colour.attribute_name = attribute
    links.new(colour.outputs["Color"], baked.inputs["Color"])
    # A missing attribute reads as black, so it cannot be told from darkness by its value.
    unbaked = nodes.new("ShaderNodeMath")
    unbaked.operation = "COMPARE"
    links.new(nodes.new("ShaderNodeObjectInfo").outputs["Object Index"], unbaked.inputs[0])
    unbaked.inputs[1].default_value, unbaked.inputs[2].default_value = UNBAKED, 0.5
    mix = nodes.new("ShaderNodeMixShader")
    links.new(unbaked.outputs[0], mix.inputs[0])
    links.new(baked.outputs[0], mix.inputs[1])
    links.new(neutral.outputs[0], mix.inputs[2])
    output, lift = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeDisplacement")
    links.new(mix.outputs[0], output.inputs["Surface"])
    lift.space, lift.inputs["Midlevel"].default_value = "WORLD", 0.0
    lift.inputs["Height"].default_value, lift.inputs["Scale"].default_value = height, 1.0
    links.new(lift.outputs[0], output.inputs["Displacement"])
    material.displacement_method = "DISPLACEMENT"


def _emptied(block) -> bpy.types.Nodes:
    if bpy.app.version < (5, 0):  # from then on always so, and asking is deprecated
        block.use_nodes = True
    block.node_tree.nodes.clear()
    return block.node_tree.nodes


@contextmanager
def _sharp(camera: bpy.types.Object | None) -> Iterator[None]:
    """The ``camera``, if it is one, without depth of field."""
    lens = getattr(camera.data, "dof", None) if camera is not None else None
    before = lens is not None and lens.use_dof
    try:
        if before:
            lens.use_dof = False
        yield
    finally:
        if before:
            lens.use_dof = True


@contextmanager
def _unbaked_marked(attribute: str) -> Iterator[None]:
    """Mark the objects without the attribute by their pass index, which only the picture's material looks at."""
    before = {obj: obj.pass_index for obj in bpy.data.objects if not _has_colours(obj, attribute)}
    try:
        for obj in before:
            obj.pass_index = UNBAKED
        yield
    finally:
        for obj, index in before.items():
            obj.pass_index = index
