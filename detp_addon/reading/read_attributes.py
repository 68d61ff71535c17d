"""Reads mesh data that shaders ask for, as one row per face corner."""

from __future__ import annotations

import numpy as np

from ...core.group_sums import group_means
from ..writing.baked_layers import ColourLayers
from .findings import Findings
from .islands import island_numbers

#: kinds of values that go by the name of a layer, which a bake may have made
NAMED = ("colour layer", "attribute", "factor")

#: attribute type -> (property to read, numbers in it, their type)
_LAYOUTS = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
    "QUATERNION": ("value", 4, np.float32),
}


def corner_values(
    mesh, key: tuple[str, str], corner_vertices: np.ndarray, layers: ColourLayers, findings: Findings
) -> np.ndarray:
    """The values (corners, 1, 3 or 4) of ``key``, a pair of kind and name.

    ("uv", name) and ("colour layer", name) take the layer that renders when the name is ""; ("attribute", name) and, as
    one number, ("factor", name) do not; ("position", "Object" or "Generated") are coordinates, "normal" and "face
    normal" directions, "island" a number of the connected part. What the mesh does not have is zero, as in Cycles.
    Baked ``layers`` are looked through: to what rendered before the bake, or, by their names, to nothing.
    """
    kind, name = key
    if kind == "normal":
        return stored_normals(mesh)
    if kind == "face normal":
        return _face_normals(mesh)
    if kind == "island":
        return island_numbers(mesh)[corner_vertices][:, None]
    if kind == "position":
        return _positions(mesh, name)[corner_vertices]
    if kind == "uv" and not name:
        name = next((layer.name for layer in mesh.uv_layers if layer.active_render), "")
    if kind == "colour layer" and not name:
        name = _painted(mesh, layers, findings)
    elif kind in NAMED and name in layers.baked:
        findings.warn("light of earlier bakes counts as black where shaders ask for it: {}", "name", name)
        return np.zeros((len(corner_vertices), 1 if kind == "factor" else 4), np.float32)
    values = attribute_at_corners(mesh, name, corner_vertices)
    if values is None:
        if kind == "uv":
            findings.warn("images without their UV map show the colour of their corner all over, as in renders, on {}",
                          "mesh", f"{mesh.name}: {name}" if name else mesh.name)  # fmt: skip
        elif kind in NAMED:
            findings.warn("attributes that shaders ask for and meshes do not have count as black: {}", "name", name)
        # Without a layer even alpha is none; an attribute's is whole whatever it is.
        values = np.zeros((len(corner_vertices), 4 if kind == "colour layer" else 1), np.float32)
    if kind == "factor":
        # Of pairs Cycles takes the first.
        return values[:, :3].mean(axis=1, keepdims=True) if values.shape[1] > 2 else values[:, :1].astype(np.float32)
    return _padded(values, 3) if kind == "uv" else _as_rgba(values)


def _painted(mesh, layers: ColourLayers, findings: Findings) -> str:
    """The colour attribute that renders, or rendered before the first bake."""
    default = mesh.attributes.default_color_name
    if default in layers.baked:
        colours = (layer.name for layer in mesh.attributes if layer.data_type in ("FLOAT_COLOR", "BYTE_COLOR"))
        others = [name for name in colours if name not in layers.baked]
        paint = layers.paint if layers.paint in others else next(iter(others), "")
        findings.modelled("the colours of {} in place of baked light", "layer", paint or "none")
        return paint
    if layers.unsure:
        findings.warn("colours that render are taken for paint; if they are light of an old bake, let other ones "
                      "render: {}", "layer", default)  # fmt: skip
    return default


def attribute_at_corners(mesh, name: str, corner_vertices: np.ndarray) -> np.ndarray | None:
    """An attribute's values (corners, numbers in it), None when the mesh has none that can be read."""
    layer = mesh.attributes.get(name) if name else None
    values = None if layer is None else _stored(layer)
    if values is None:
        return None
    if layer.domain == "POINT":
        return values[corner_vertices]
    if layer.domain == "FACE":
        return np.repeat(values, face_sizes(mesh), axis=0)
    if layer.domain == "EDGE":
        return _means_of_edges(mesh, values)[corner_vertices]
    return values if layer.domain == "CORNER" else None


def _means_of_edges(mesh, values: np.ndarray) -> np.ndarray:
    """What a vertex (V, c) shows of the ``values`` (edges, c) of its edges: their mean, as in Cycles."""
    ends = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", ends)
    return group_means(np.repeat(values.astype(np.float64), 2, axis=0), ends, len(mesh.vertices))[0]


def colours_of_elements(geometry, name: str) -> np.ndarray | None:
    """An attribute of a ``geometry`` as RGBA rows, one for each of its elements; None when it has none to be read."""
    layer = geometry.attributes.get(name) if name else None
    values = None if layer is None else _stored(layer)
    return None if values is None else _as_rgba(values)


def _stored(layer) -> np.ndarray | None:
    """The values (elements, numbers in it) of an attribute, None of a type that shaders do not see."""
    if layer.data_type not in _LAYOUTS:
        return None
    prop, width, dtype = _LAYOUTS[layer.data_type]
    values = np.zeros(len(layer.data) * width, dtype)
    layer.data.foreach_get(prop, values)
    return values.reshape(-1, width)


def stored_normals(mesh) -> np.ndarray:
    """The normal (C, 3) that Blender gives each face corner, zero where it is not a number."""
    values = np.zeros(3 * len(mesh.loops), np.float32)
    custom = mesh.attributes.get("custom_normal")
    # Blender 4.5 aborts when it is asked for corners' normals that a script has stored on edges.
    if custom is None or custom.domain != "EDGE":
        mesh.corner_normals.foreach_get("vector", values)
    return np.where(np.isfinite(values), values, 0.0).astype(np.float64).reshape(-1, 3)


def _face_normals(mesh) -> np.ndarray:
    values = np.zeros(3 * len(mesh.polygons), np.float32)
    mesh.polygons.foreach_get("normal", values)
    return np.repeat(np.nan_to_num(values.reshape(-1, 3)), face_sizes(mesh), axis=0)


def face_sizes(mesh) -> np.ndarray:
    """Number of corners (faces,) of each face."""
    sizes = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", sizes)
    return sizes


def _positions(mesh, space: str) -> np.ndarray:
    values = np.empty(3 * len(mesh.vertices), np.float32)
    # Generated coordinates stay on a surface that is bent.
    mesh.vertices.foreach_get("co" if space == "Object" else "undeformed_co", values)
    values = values.reshape(-1, 3)
    if space == "Object":
        return values
    centre, half = np.array(mesh.texspace_location), np.array(mesh.texspace_size)
    return (values - centre + half) / np.where(half == 0.0, 1.0, 2.0 * half)


def _padded(values: np.ndarray, width: int) -> np.ndarray:
    padded = np.zeros((len(values), width), np.float32)
    padded[:, : values.shape[1]] = values[:, :width]
    return padded


def _as_rgba(values: np.ndarray) -> np.ndarray:
    """RGBA of one number (grey), two, three or four; alpha is 1 where there is none."""
    rgba = np.ones((len(values), 4), np.float32)
    width = values.shape[1]
    rgba[:, :3] = values if width == 1 else _padded(values, 3)
    if width == 4:
        rgba[:, 3] = values[:, 3]
    return rgba
