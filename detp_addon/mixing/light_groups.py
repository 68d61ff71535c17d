"""The groups of light sources that are baked apart: Blender's light groups, or else each lamp by itself."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from itertools import count

import bpy
import numpy as np

from ...core.scene import Scene
from ...core.sides import any_side
from ..reading.read_scene import WORLD, ExportedScene
from ..wording import counted
from ..writing.write_attributes import LONGEST_NAME

#: groups of a scene without light groups at most: beyond them the strongest lamps stay apart, and the rest is one
MOST_GROUPS = 16

#: what groups are called that no light group names
REST, WORLD_GROUP, EMISSION = "Rest", "World", "Emission"


@dataclass(frozen=True)
class LightGroup:
    """Light sources that are baked together.

    layer    the colour layer of their light
    lights   rows of the scene's lights
    shining  the light groups (by name, "" for none) of the objects whose emission belongs to it
    """

    name: str
    layer: str
    lights: tuple[int, ...]
    shining: frozenset[str]


def light_groups(
    view_layer: bpy.types.ViewLayer, export: ExportedScene, attribute: str
) -> tuple[list[LightGroup], list[str]]:
    """The groups that the light of ``attribute`` is made of, none without light, and notes on them.

    As in Cycles, what belongs to no light group of the view layer is the rest. Without light groups each lamp is one,
    and so are the world, and all that shines by its material together.
    """
    origins, known = export.origins, [group.name for group in view_layer.lightgroups]
    shining = _shining_groups(export)
    if known:
        keys = [group if group in known else REST for _, group in origins.lights]
        shines = {group: group if group in known else REST for group in shining}
        order, notes = list(dict.fromkeys((*known, REST))), []
    else:
        keys, notes = _by_lamp(export, bool(shining))
        shines, order = dict.fromkeys(shining, EMISSION), [*dict.fromkeys(keys), EMISSION]
        # A lamp's own name tells it apart from these.
        order.sort(key=lambda key: (WORLD_GROUP, EMISSION, REST).index(key) + 1 if isinstance(key, str) else 0)
    groups, names, layers = [], set(), set()
    for key in order:
        lights = tuple(row for row, other in enumerate(keys) if other == key)
        own = frozenset(group for group, other in shines.items() if other == key)
        if lights or own:
            name = _unlike(key if isinstance(key, str) else key[0], names)
            groups.append(LightGroup(name, _unlike(f"{attribute}:{name}", layers), lights, own))
    return groups, notes


def lit_by(export: ExportedScene, group: LightGroup) -> Scene:
    """The scene with the sources of one group alone."""
    scene, origins = export.scene, export.origins
    own = np.array([name in group.shining for name in origins.groups])[origins.emission]
    return replace(
        scene,
        lights=tuple(scene.lights[row] for row in group.lights),
        emission=np.where(own[:, None], scene.emission, 0.0),
    )


def likely_groups(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> int:
    """About how many groups a scene has, without looking at its materials."""
    lamps = [obj for obj in view_layer.objects if obj.type == "LIGHT" and not obj.hide_render]
    known = [group.name for group in view_layer.lightgroups]
    if not known:
        return max(1, min(len(lamps) + (scene.world is not None), MOST_GROUPS))
    sources = [*lamps, *([scene.world] if scene.world else [])]
    return max(1, len({each.lightgroup if each.lightgroup in known else REST for each in sources}))


def _shining_groups(export: ExportedScene) -> list[str]:
    """The light groups, "" for none, of the triangles that shine."""
    origins = export.origins
    return [origins.groups[row] for row in np.unique(origins.emission[any_side(export.scene.emission)])]


def _by_lamp(export: ExportedScene, shines: bool) -> tuple[list[Hashable], list[str]]:
    """What each light belongs to: its lamp as (name,), the world, or the rest; and a note where there is a rest."""
    lights, box = export.origins.lights, export.scene.bounds
    keys: list[Hashable] = [WORLD_GROUP if name is WORLD else (name,) for name, _ in lights]
    strength: dict[tuple, float] = {}
    for key, light in zip(keys, export.scene.lights, strict=True):
        if key != WORLD_GROUP:
            strength[key] = strength.get(key, 0.0) + float(np.abs(light.flux(box)).sum())
    room = MOST_GROUPS - (WORLD_GROUP in keys) - shines
    if len(strength) <= room:
        return keys, []
    apart = set(sorted(strength, key=strength.get, reverse=True)[: room - 1])
    note = (
        f"Of {counted(len(strength), 'lamp')} the {len(apart)} strongest have layers of their own, and the others "
        f"share one: sort them into light groups to choose."
    )
    return [key if key in apart or key == WORLD_GROUP else REST for key in keys], [note]


def _unlike(name: str, taken: set[str]) -> str:
    """The name as far as an attribute's may be long, with a number where it is ``taken``, to which it is added."""
    for number in count():
        end = f".{number:03d}" if number else ""
        found = name.encode()[: LONGEST_NAME - len(end)].decode(errors="ignore") + end
        if found not in taken:
            taken.add(found)
            return found
