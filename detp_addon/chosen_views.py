"""Which scenes and view layers of a file are baked, and a word on those that are not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import bpy

from ..core.errors import InvalidSettingError, SceneNotFoundError
from .wording import alike, some

View = tuple[bpy.types.Scene, bpy.types.ViewLayer]


@dataclass(frozen=True)
class ViewChoice:
    """The names of a scene and a view layer, None for the active ones, or ``every`` scene as its own view layer has it.

    Raises InvalidSettingError when both are asked for.
    """

    scene: str | None = None
    view_layer: str | None = None
    every: bool = False

    def __post_init__(self):
        if self.every and (self.scene is not None or self.view_layer is not None):
            raise InvalidSettingError("Every scene is baked as its own view layer: name neither one with --all-scenes.")


def chosen_views(choice: ViewChoice) -> list[View]:
    """The scenes to bake, each with the view layer to bake it as. Raises SceneNotFoundError."""
    if choice.every:
        scenes = [scene for scene in bpy.data.scenes if scene.library is None and _has_meshes(_objects(scene))]
    elif choice.scene is not None:
        scenes = [_named("scene", choice.scene, bpy.data.scenes, "the file")]
    else:
        scenes = [bpy.context.scene]
    return [(scene, _layer(scene, choice.view_layer)) for scene in scenes or [bpy.context.scene]]


def _layer(scene: bpy.types.Scene, name: str | None) -> bpy.types.ViewLayer:
    if name is not None:
        return _named("view layer", name, scene.view_layers, f"the scene '{scene.name}'")
    if scene == bpy.context.scene:
        return bpy.context.view_layer
    return next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])


def _named(kind: str, name: str, found, where: str):
    if name in found:
        return found[name]
    raise SceneNotFoundError(f"No {kind} is named '{name}' in {where}: did you mean {alike(name, found.keys())}?")


def not_baked(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, scenes_too: Iterable = ()) -> list[str]:
    """A sentence on what else the file would render, when a view is baked; none on ``scenes_too``, baked as well.

    Nor on background sets of the scene, which are in the view.
    """
    known = {*_shown(scene), *scenes_too}
    scenes = [
        other.name
        for other in bpy.data.scenes
        if other not in known and other.library is None and _has_meshes(other.objects)
    ]
    layers = [
        layer.name for layer in scene.view_layers if layer != view_layer and layer.use and _has_meshes(layer.objects)
    ]
    others = [_listed(kind, names) for kind, names in (("scene", scenes), ("view layer", layers)) if names]
    if not others:
        return []
    return [f"The scene '{scene.name}' was baked as its view layer '{view_layer.name}' shows it, and not for "
            f"{' nor for '.join(others)}."]  # fmt: skip


def shared_objects(scenes: list[bpy.types.Scene]) -> list[str]:
    """A sentence on the meshes that are in several of the ``scenes`` baked one after the other."""
    uses = Counter(obj for scene in scenes for obj in _objects(scene) if obj.type == "MESH" and not obj.hide_render)
    names = [obj.name for obj, count in uses.items() if count > 1]
    return [f"Of {_listed('object', names)} each has the light of the last scene that it is in."] if names else []


def _shown(scene: bpy.types.Scene) -> list[bpy.types.Scene]:
    """The scene and its background sets."""
    shown = []
    while scene is not None and scene not in shown:
        shown.append(scene)
        scene = scene.background_set
    return shown


def _objects(scene: bpy.types.Scene) -> set[bpy.types.Object]:
    return {obj for each in _shown(scene) for obj in each.objects}


def _listed(kind: str, names: list[str]) -> str:
    return f"the {kind}{'s' * (len(names) > 1)} {some(names)}"


def _has_meshes(objects) -> bool:
    return any(obj.type == "MESH" and not obj.hide_render for obj in objects)
