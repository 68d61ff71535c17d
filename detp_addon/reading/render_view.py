"""Shows a scene as a render sees it without making a picture: a render engine that only hands over its depsgraph."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

import bpy

from ...core.errors import SceneBusyError

Result = TypeVar("Result")

ENGINE = "DETP_SCENE_READER"


def view_as_render(
    scene, view_layer, visit: Callable[[bpy.types.Depsgraph], Result], frame: int | None = None
) -> Result:
    """Return ``visit(depsgraph)``, called where modifiers, visibility and instances are those of a render.

    Only ``view_layer`` of ``scene`` is evaluated, at a ``frame``, None for the scene's current one. Evaluated data must
    not be kept after the visit. Afterwards Blender's data, render results and handlers are as they were, whatever
    happened.

    Raises what ``visit`` raises, and SceneBusyError when Blender cannot render now.
    """
    visits = []
    with _registered(_engine(visit, visits)), temporary_scene(scene.copy()) as copy:
        _reduce_to(copy, view_layer.name)
        if frame is not None:
            copy.frame_current, copy.frame_subframe = frame, 0.0
        render(copy)
    if not visits:
        raise SceneBusyError("Blender could not evaluate the scene for rendering: try again when no render is running.")
    result, error = visits[0]
    if error is not None:
        raise error
    return result


@contextmanager
def temporary_scene(scene) -> Iterator[bpy.types.Scene]:
    """``scene`` with a camera to render through; the scene, camera and what rendering leaves behind are removed."""
    images = {image.name_full for image in bpy.data.images}
    camera_data = bpy.data.cameras.new("detp")
    camera = bpy.data.objects.new("detp", camera_data)
    try:
        # Geometry nodes may look at the active camera, so the scene's own is kept.
        scene.camera = scene.camera or camera
        yield scene
    finally:
        bpy.data.scenes.remove(scene)
        bpy.data.objects.remove(camera)
        bpy.data.cameras.remove(camera_data)
        for image in list(bpy.data.images):
            if image.type == "RENDER_RESULT" and image.name_full not in images:
                bpy.data.images.remove(image)


def render(scene, write: bool = False) -> None:
    """Render ``scene`` now, without the render handlers of other add-ons.

    Raises SceneBusyError when Blender refuses.
    """
    with _handlers_suspended():
        try:
            # The scene of the context would lend its frame.
            with bpy.context.temp_override(scene=scene):
                bpy.ops.render.render("EXEC_DEFAULT", scene=scene.name, write_still=write)
        except RuntimeError as error:
            raise SceneBusyError(f"Blender could not evaluate the scene for rendering: {error}") from error


def _engine(visit, visits: list):
    class DETP_scene_reader(bpy.types.RenderEngine):
        bl_idname = ENGINE
        bl_label = "DETP scene reader"
        bl_use_preview = False

        def render(self, depsgraph):
            # Blender would print an exception and go on, so it is carried out by hand.
            try:
                visits.append((visit(depsgraph), None))
            except BaseException as error:
                visits.append((None, error))

    return DETP_scene_reader


@contextmanager
def _registered(engine) -> Iterator[None]:
    # Blender 4.5 hangs at exit while a Python render engine is registered, so it lives for one render only.
    bpy.utils.register_class(engine)
    try:
        yield
    finally:
        bpy.utils.unregister_class(engine)


def _reduce_to(scene, layer_name: str) -> None:
    """Let rendering ``scene`` evaluate one view layer and do nothing else."""
    for layer in scene.view_layers:
        layer.use = layer.name == layer_name
        if hasattr(layer, "use_grease_pencil"):
            # It would be drawn afterwards, on a graphics card that a server may not have.
            layer.use_grease_pencil = False
    settings = scene.render
    settings.engine = ENGINE
    # Where films are made, Blender refuses anything smaller.
    settings.resolution_x = settings.resolution_y = 16
    settings.resolution_percentage = 100
    for name in ("border", "compositing", "sequencer", "freestyle", "multiview", "single_layer", "persistent_data"):
        setattr(settings, f"use_{name}", False)


@contextmanager
def _handlers_suspended() -> Iterator[None]:
    handlers = bpy.app.handlers
    lists = [getattr(handlers, name) for name in dir(handlers) if name.startswith(("render_", "composite_"))]
    kept = [list(functions) for functions in lists]
    for functions in lists:
        functions.clear()
    try:
        yield
    finally:
        for functions, entries in zip(lists, kept, strict=True):
            functions[:] = entries
