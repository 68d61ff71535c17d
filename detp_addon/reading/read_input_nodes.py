"""Rules for nodes that bring values in: textures, attributes, coordinates, rays."""

from __future__ import annotations

import numpy as np

from .blackbody import blackbody
from .read_node_graph import feed_of, find_input
from .read_values import UNKNOWN, Values, constant

#: procedural patterns, which count as their mean
PATTERNS = ("Noise", "Voronoi", "Musgrave", "Wave", "Magic", "Gradient", "WhiteNoise", "Gabor", "Brick", "Checker")


def _set_value(values: Values, node, output, groups):
    return constant(node.outputs[0])


def _image(values: Values, node, output, groups):
    linked = feed_of(find_input(node, "Vector"), groups).node is not None
    coordinates = values.input(node, "Vector", groups) if linked else values.places.uv("")
    colour, alpha = values.places.image(node, coordinates)
    return alpha if output.identifier == "Alpha" else colour


def _uv_map(values: Values, node, output, groups):
    return values.places.uv(node.uv_map)


def _texture_coordinate(values: Values, node, output, groups):
    if output.identifier == "UV":
        return values.places.uv("")
    if output.identifier == "Generated" or (output.identifier == "Object" and node.object is None):
        return values.places.position(output.identifier)
    values.places.unknown(f"texture coordinates ({output.name})")
    return UNKNOWN


def _mapping(values: Values, node, output, groups):
    vector, location, rotation, scale = (
        values.input(node, name, groups) if find_input(node, name) else None
        for name in ("Vector", "Location", "Rotation", "Scale")
    )
    if len(rotation) > 1:
        return None
    turn = _rotation_matrix(*rotation[0])
    if node.vector_type == "POINT":
        return (vector * scale) @ turn.T + location
    if node.vector_type == "TEXTURE":
        return ((vector - location) @ turn) / np.where(scale == 0.0, 1.0, scale)
    if node.vector_type == "VECTOR":
        return (vector * scale) @ turn.T
    return None


def _rotation_matrix(x: float, y: float, z: float) -> np.ndarray:
    """Rotation about X, then Y, then Z by these angles in radians."""
    (cx, cy, cz), (sx, sy, sz) = np.cos((x, y, z)), np.sin((x, y, z))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def _vertex_colour(values: Values, node, output, groups):
    return _rgba_output(values.places.attribute(node.layer_name), output)


def _attribute(values: Values, node, output, groups):
    if node.attribute_type != "GEOMETRY":
        return None
    return _rgba_output(values.places.attribute(node.attribute_name), output)


def _rgba_output(rgba: np.ndarray, output) -> np.ndarray:
    if output.identifier == "Alpha":
        return rgba[:, 3:]
    return rgba[:, :3].mean(axis=1, keepdims=True) if output.identifier == "Fac" else rgba[:, :3]


def _pattern(values: Values, node, output, groups):
    values.places.unknown(f"{node.bl_label} (taken as its mean)")
    if node.bl_idname in ("ShaderNodeTexChecker", "ShaderNodeTexBrick") and output.identifier == "Color":
        return 0.5 * (values.input(node, "Color1", groups) + values.input(node, "Color2", groups))
    return np.full((1, 3 if output.type == "RGBA" else 1), 0.5)


def _light_path(values: Values, node, output, groups):
    seen = values.places.rays.get(output.identifier, 0.0)
    return None if seen is None else np.array([[seen]])


def _fresnel(values: Values, node, output, groups):
    values.places.unknown(f"{node.bl_label} (taken at normal incidence)")
    return _normal_reflectance(values.input(node, "IOR", groups))


def _layer_weight(values: Values, node, output, groups):
    values.places.unknown(f"{node.bl_label} (taken at normal incidence)")
    if output.identifier == "Facing":
        return np.zeros((1, 1))
    return _normal_reflectance(1.0 / np.maximum(1.0 - values.input(node, "Blend", groups), 1e-5))


def _normal_reflectance(ior: np.ndarray) -> np.ndarray:
    return ((ior - 1.0) / (ior + 1.0)) ** 2


def _geometry(values: Values, node, output, groups):
    return np.zeros((1, 1)) if output.identifier in ("Backfacing", "Random Per Island") else None


def _light_falloff(values: Values, node, output, groups):
    # "Quadratic" is the physical falloff, which a strength without this node has too.
    return values.input(node, "Strength", groups) if output.identifier == "Quadratic" else None


def _blackbody(values: Values, node, output, groups):
    return blackbody(values.input(node, "Temperature", groups))


def _occlusion(values: Values, node, output, groups):
    return values.input(node, "Color", groups) if output.identifier == "Color" else np.ones((1, 1))


INPUT_RULES = {
    "ShaderNodeRGB": _set_value,
    "ShaderNodeValue": _set_value,
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
    "ShaderNodeLightFalloff": _light_falloff,
    "ShaderNodeBlackbody": _blackbody,
    "ShaderNodeAmbientOcclusion": _occlusion,
    **{f"ShaderNodeTex{name}": _pattern for name in PATTERNS},
}
