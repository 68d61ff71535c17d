"""Rules for nodes that bring values in: textures, attributes, coordinates, rays."""

from __future__ import annotations

import numpy as np

from ...core.photons.specular import fresnel
from .arithmetic import unit
from .blackbody import blackbody
from .read_node_graph import chosen_item, find_input
from .read_values import UNKNOWN, Values, constant
from .working_space import from_rec709

#: procedural patterns, which count as their mean
PATTERNS = ("Noise", "Voronoi", "Musgrave", "Wave", "Magic", "WhiteNoise", "Gabor", "Brick")


#: what a texture node's own mapping takes for a coordinate
_AXES = {"NONE": np.zeros(3), **dict(zip("XYZ", np.eye(3), strict=True))}


def _set_value(values: Values, node, output, groups):
    return constant(node.outputs[0])


def _own_value(name: str):
    return lambda values, node, output, groups: np.array(getattr(node, name), float).reshape(1, -1)


def _menu_switch(values: Values, node, output, groups):
    item = chosen_item(node, groups)
    if item is None:
        return None
    return values.input(node, item, groups) if output == node.outputs[0] else np.full((1, 1), output.identifier == item)


def _image(values: Values, node, output, groups):
    linked = values.linked(node, "Vector", groups)
    coordinates = values.input(node, "Vector", groups) if linked else values.places.given("uv")
    return values.places.image(node, mapped(node, coordinates), output.identifier == "Alpha")


def mapped(node, coordinates: np.ndarray) -> np.ndarray:
    """The ``coordinates`` (m, 3) of a texture node after the mapping of its own, which scripts and old files set."""
    own = node.texture_mapping
    turned = np.stack([_AXES[axis] for axis in (own.mapping_x, own.mapping_y, own.mapping_z)])
    return _moved(own.vector_type, coordinates @ turned.T, own.translation, own.rotation, own.scale)


def _uv_map(values: Values, node, output, groups):
    if node.from_instancer:
        return values.places.given("instancer", "UV")
    return values.places.given("uv", node.uv_map)


def _texture_coordinate(values: Values, node, output, groups):
    if node.from_instancer and output.identifier in ("Generated", "UV"):
        return values.places.given("instancer", output.identifier)
    if output.identifier == "UV":
        return values.places.given("uv")
    if output.identifier == "Normal":
        return _sides(values) * values.places.given("normal", "Object")
    if output.identifier == "Object" and node.object is not None:
        return values.places.given("position in", node.object.name_full)
    if output.identifier in ("Generated", "Object"):
        return values.places.given("position", output.identifier)
    values.places.unknown(f"texture coordinates ({output.name})")
    return UNKNOWN


def _sides(values: Values) -> float:
    """By what normals are multiplied, which Cycles turns towards who looks at a surface."""
    return -1.0 if values.places.back else 1.0


def _mapping(values: Values, node, output, groups):
    vector, location, rotation, scale = (
        values.input(node, name, groups) if find_input(node, name) else None
        for name in ("Vector", "Location", "Rotation", "Scale")
    )
    return None if len(rotation) > 1 else _moved(node.vector_type, vector, location, rotation[0], scale)


def _moved(kind: str, vector, location, rotation, scale) -> np.ndarray:
    """``vector`` (m, 3) moved, turned and scaled as Blender's mapping of that ``kind`` says."""
    location, scale, turn = np.array(location), np.array(scale), _rotation_matrix(*rotation)
    shrunk = np.where(scale == 0.0, 0.0, 1.0 / np.where(scale == 0.0, 1.0, scale))
    if kind == "POINT":
        return (vector * scale) @ turn.T + location
    if kind == "TEXTURE":
        return ((vector - location) @ turn) * shrunk
    if kind == "VECTOR":
        return (vector * scale) @ turn.T
    return unit((vector * shrunk) @ turn.T)


def _rotation_matrix(x: float, y: float, z: float) -> np.ndarray:
    """Rotation about X, then Y, then Z by these angles in radians."""
    (cx, cy, cz), (sx, sy, sz) = np.cos((x, y, z)), np.sin((x, y, z))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def _vertex_colour(values: Values, node, output, groups):
    return _rgba_output(values.places.given("colour layer", node.layer_name), output)


def _attribute(values: Values, node, output, groups):
    kind, name = node.attribute_type, node.attribute_name
    if kind != "GEOMETRY":
        return _rgba_output(values.places.given("property", f"{kind} {name}"), output)
    if output.identifier == "Fac":
        return values.places.given("factor", name)
    return _rgba_output(values.places.given("attribute", name), output)


def _rgba_output(rgba: np.ndarray, output) -> np.ndarray:
    if output.identifier == "Alpha":
        return rgba[:, 3:]
    return rgba[:, :3].mean(axis=1, keepdims=True) if output.identifier == "Fac" else rgba[:, :3]


def _pattern(values: Values, node, output, groups):
    values.places.unknown(f"{node.bl_label} (taken as its mean)")
    if node.bl_idname == "ShaderNodeTexBrick" and output.identifier == "Color":
        return 0.5 * (values.input(node, "Color1", groups) + values.input(node, "Color2", groups))
    return np.full((1, 3 if output.type == "RGBA" else 1), 0.5)


def _coordinates(values: Values, node, groups) -> np.ndarray:
    """Where (m, 3) a pattern is looked up: generated coordinates, unless others are linked."""
    linked = values.linked(node, "Vector", groups)
    return mapped(
        node, values.input(node, "Vector", groups) if linked else values.places.given("position", "Generated")
    )


def _gradient(values: Values, node, output, groups):
    places = _coordinates(values, node, groups)
    if np.isnan(places).any():
        return _pattern(values, node, output, groups)
    (x, y), length = places[:, :2].T, np.linalg.norm(places, axis=1)
    ball, ease = np.maximum(0.999999 - length, 0.0), np.clip(x, 0.0, 1.0)
    value = {
        "LINEAR": x,
        "QUADRATIC": np.maximum(x, 0.0) ** 2,
        "EASING": ease**2 * (3.0 - 2.0 * ease),
        "DIAGONAL": 0.5 * (x + y),
        "RADIAL": np.arctan2(y, x) / (2.0 * np.pi) + 0.5,
        "SPHERICAL": ball,
        "QUADRATIC_SPHERE": ball**2,
    }[node.gradient_type]
    return np.clip(value, 0.0, 1.0)[:, None]


def _checker(values: Values, node, output, groups):
    places = _coordinates(values, node, groups) * values.input(node, "Scale", groups)
    first, second = (values.input(node, name, groups) for name in ("Color1", "Color2"))
    with np.errstate(invalid="ignore"):
        # Cycles moves the borders a little, lest faces in the planes between checks flicker.
        odd = np.floor((places + 1e-6) * 0.999999) % 2 == 1
        share = ((odd[:, 0] == odd[:, 1]) == odd[:, 2]).astype(float)[:, None]
    # Places that lie farther apart than checks meet either as often by chance: half of each is the mean for certain.
    fine = np.isnan(places).any(axis=1, keepdims=True) | values.places.coarser_than(places, 1.0)
    share = np.where(fine, values.places.half, share)
    return share if output.identifier == "Fac" else share * first + (1.0 - share) * second


def _light_path(values: Values, node, output, groups):
    seen = values.places.ray(output.identifier)
    if seen is not None and output.identifier.endswith("Depth"):
        values.places.about(f"{node.bl_label} ({output.name}), taken as after one reflection,")
    return None if seen is None else np.array([[seen]])


def _fresnel(values: Values, node, output, groups):
    ior = np.maximum(values.input(node, "IOR", groups), 1e-5)
    return _reflected(values, node, groups, ior)


def _layer_weight(values: Values, node, output, groups):
    blend = np.minimum(values.input(node, "Blend", groups), 1 - 1e-5)
    if output.identifier == "Fresnel":
        return _reflected(values, node, groups, 1.0 / (1.0 - blend))
    _note_angle(values, node, groups)
    blend = np.maximum(blend, 0.0)
    # Cycles' way to weigh by angle.
    exponent = np.where(blend < 0.5, 2.0 * blend, 0.5 / (1.0 - blend))
    return 1.0 - values.places.cosine**exponent


def _reflected(values: Values, node, groups, ior: np.ndarray) -> np.ndarray:
    _note_angle(values, node, groups)
    return fresnel(values.places.cosine, 1.0 / ior if values.places.back else ior)[0]


def _note_angle(values: Values, node, groups) -> None:
    bent = ", bump and normal maps left out" if values.linked(node, "Normal", groups) else ""
    values.places.about(f"{node.bl_label} (taken at its mean over all angles{bent})")


def _geometry(values: Values, node, output, groups):
    places = values.places
    if output.identifier == "Backfacing":
        return np.array([[float(places.back)]])
    if output.identifier == "Random Per Island":
        return places.given("island")
    if output.identifier == "Position":
        return places.given("position", "World")
    if output.identifier in ("Normal", "True Normal"):
        kind = "normal" if output.identifier == "Normal" else "face normal"
        return _sides(values) * places.given(kind, "World")
    return None


def _object_info(values: Values, node, output, groups):
    if output.identifier == "Material Index":
        return np.array([[values.places.material_index]])
    kinds = {"Color": "colour", "Object Index": "index"}
    return values.places.given(f"object {kinds.get(output.identifier, output.identifier.lower())}")


def _nothing(values: Values, node, output, groups):
    # Meshes have no hair, points and volumes.
    return np.zeros((1, 3 if output.type == "VECTOR" else 1))


def _light_falloff(values: Values, node, output, groups):
    # "Quadratic" is the physical falloff, which a strength without this node has too, unless it is smoothed.
    if output.identifier != "Quadratic" or values.input(node, "Smooth", groups).any():
        return None
    return values.input(node, "Strength", groups)


def _blackbody(values: Values, node, output, groups):
    return np.maximum(from_rec709(blackbody(values.input(node, "Temperature", groups))), 0.0)


def _occlusion(values: Values, node, output, groups):
    values.places.about(f"{node.bl_label} (taken as unoccluded)")
    return values.input(node, "Color", groups) if output.identifier == "Color" else np.ones((1, 1))


INPUT_RULES = {
    "ShaderNodeRGB": _set_value,
    "ShaderNodeValue": _set_value,
    "FunctionNodeInputBool": _own_value("boolean"),
    "FunctionNodeInputInt": _own_value("integer"),
    "FunctionNodeInputVector": _own_value("vector"),
    "GeometryNodeMenuSwitch": _menu_switch,
    "ShaderNodeTexImage": _image,
    "ShaderNodeUVMap": _uv_map,
    "ShaderNodeTexCoord": _texture_coordinate,
    "ShaderNodeMapping": _mapping,
    "ShaderNodeVertexColor": _vertex_colour,
    "ShaderNodeAttribute": _attribute,
    "ShaderNodeLightPath": _light_path,
    "ShaderNodeFresnel": _fresnel,
    "ShaderNodeLayerWeight": _layer_weight,
    "ShaderNodeNewGeometry": _geometry,
    "ShaderNodeObjectInfo": _object_info,
    **{f"ShaderNode{kind}Info": _nothing for kind in ("Hair", "Point", "Volume")},
    "ShaderNodeLightFalloff": _light_falloff,
    "ShaderNodeBlackbody": _blackbody,
    "ShaderNodeAmbientOcclusion": _occlusion,
    "ShaderNodeTexGradient": _gradient,
    "ShaderNodeTexChecker": _checker,
    **{f"ShaderNodeTex{name}": _pattern for name in PATTERNS},
}
