"""A fingerprint of everything in the open file, and what of it a bake has changed against its promise."""

from __future__ import annotations

import hashlib

import bpy
import numpy as np

#: attribute type -> (property to read, numbers in it, their type)
LAYOUTS = {
    "FLOAT": ("value", 1, np.float32), "INT": ("value", 1, np.int32), "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool), "FLOAT2": ("vector", 2, np.float32), "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32), "BYTE_COLOR": ("color", 4, np.float32),
    "QUATERNION": ("value", 4, np.float32),
}  # fmt: skip


def users(block) -> int | None:
    """How many users Blender says that the ``block`` has.

    None of objects and collections before Blender 4.3: they have one more after any scene was copied and removed.
    """
    miscounted = isinstance(block, (bpy.types.Object, bpy.types.Collection)) and bpy.app.version < (4, 3)
    return None if miscounted else block.users


def fingerprint() -> dict:
    """What is in the file: the names of all data-blocks, each object and its mesh, the state of the scene."""
    blocks = {}
    for name in dir(bpy.data):
        collection = getattr(bpy.data, name)
        if type(collection).__name__ == "bpy_prop_collection" and name != "all_ids":
            blocks[name] = {block.name_full: users(block) for block in collection}
    scene, layer = bpy.context.scene, bpy.context.view_layer
    selected = [obj.name for obj in layer.objects if obj.select_get()]
    state = (
        scene.name, scene.camera, scene.world, scene.frame_current, scene.render.engine, scene.render.resolution_x,
        layer.name, layer.objects.active, layer.material_override, selected,
        bpy.context.mode, [len(getattr(bpy.app.handlers, name)) for name in dir(bpy.app.handlers) if "_p" in name],
    )  # fmt: skip
    objects = {obj.name_full: _object(obj) for obj in bpy.data.objects}
    return {"blocks": blocks, "state": repr(state), "objects": objects}


def layers(mesh) -> dict:
    """Each attribute's type, domain and a hash of its values."""
    return {layer.name: (layer.data_type, layer.domain, _hashed(layer)) for layer in mesh.attributes}


def values(layer) -> np.ndarray:
    """The numbers in an attribute, one row for each element."""
    prop, width, dtype = LAYOUTS[layer.data_type]
    numbers = np.zeros(len(layer.data) * width, dtype)
    layer.data.foreach_get(prop, numbers)
    return numbers.reshape(-1, width)


def _hashed(layer) -> str:
    if layer.data_type not in LAYOUTS:
        return str(len(layer.data))
    return hashlib.sha1(values(layer).tobytes()).hexdigest()


def _object(obj) -> dict:
    found = {
        "matrix": repr([[*row] for row in obj.matrix_basis]),
        "parent": obj.parent and obj.parent.name_full,
        "modifiers": [(modifier.name, modifier.type) for modifier in obj.modifiers],
        "materials": [slot.material and slot.material.name_full for slot in obj.material_slots],
        "hidden": (obj.hide_render, obj.hide_viewport),
        "groups": [group.name for group in obj.vertex_groups],
        "data": obj.data and obj.data.name_full,
    }
    if obj.type == "MESH" and obj.mode != "EDIT":
        found["layers"] = layers(obj.data)
        found["shown"] = (obj.data.attributes.active_color_name, obj.data.attributes.default_color_name)
    return found


def baked_objects(before: dict, after: dict, attribute: str) -> list[str]:
    """The objects whose attribute of that name is another than before."""

    def layer(found, name):
        return found["objects"].get(name, {}).get("layers", {}).get(attribute)

    return [name for name in after["objects"] if layer(after, name) != layer(before, name)]


def broken_promises(before: dict, after: dict, attributes: tuple[str, ...], baked: list[str]) -> list[str]:
    """What changed that a bake into ``attributes`` of the objects ``baked`` leaves as it is."""
    found = []
    if before["state"] != after["state"]:
        found.append(f"the scene's state was {before['state']} and is {after['state']}")
    copies = {after["objects"][name]["data"] for name in baked} - {before["objects"][name]["data"] for name in baked}
    for kind, blocks in before["blocks"].items():
        new = set(after["blocks"][kind]) - set(blocks) - (copies if kind == "meshes" else set())
        # A copy of a mesh brings a copy of its shape keys.
        if (new and not (kind == "shape_keys" and copies)) or set(blocks) - set(after["blocks"][kind]):
            found.append(f"{kind} were {sorted(blocks)} and are {sorted(after['blocks'][kind])}")
        elif not copies and blocks != after["blocks"][kind]:
            found.append(f"users of {kind} were {blocks} and are {after['blocks'][kind]}")
    for name in set(before["objects"]) & set(after["objects"]):
        old, new = ({**side["objects"][name]} for side in (before, after))
        if name in baked:
            for side in (old, new):
                side.pop("shown")
                side.pop("data")
                side["layers"] = {key: value for key, value in side["layers"].items() if key not in attributes}
        found.extend(f"{key} of {name} was {old[key]} and is {new[key]}" for key in old if old[key] != new.get(key))
    return found
