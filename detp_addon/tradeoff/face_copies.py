"""Faces as a render sees them, and objects for Cycles to bake that hold them just inside their edges.

Cycles' own vertex bake samples exactly at the corner. Where two faces meet in a concave edge, or the corner lies on
another surface, it is then chance on which side of that surface the paths start. So faces are copied, taken apart,
drawn 2 % of the way towards their middles and lifted a little, with the corner normals of the original. No path meets
the copies.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix

from ...core.group_sums import group_means
from ..reading.read_attributes import face_sizes, stored_normals
from ..reading.read_meshes import corner_vertex_indices, vertex_positions
from ..reading.render_view import view_as_render

#: Share of the way from a corner to the middle of its face, and lift in shares of the scene's radius.
INWARD = 0.02
LEAST_LIFT, MOST_LIFT = 4e-6, 5e-5

#: the attribute that Cycles bakes into
LIGHT = "detp cycles light"

#: a scene further from the origin than this many of its radii is moved there: Cycles computes in single precision
FAR = 10.0


@dataclass(frozen=True)
class CopiedFaces:
    """Faces with C corners: corners (C, 3) metres and normals (C, 3) unit in world space, and each face's size (F,)."""

    corners: np.ndarray
    normals: np.ndarray
    sizes: np.ndarray

    @property
    def face(self) -> np.ndarray:
        """The face (C,) of each corner."""
        return np.repeat(np.arange(len(self.sizes)), self.sizes)

    @staticmethod
    def joined(parts: list[CopiedFaces]) -> CopiedFaces:
        """All faces one after the other."""
        return CopiedFaces(
            *(np.concatenate([getattr(p, name) for p in parts]) for name in ("corners", "normals", "sizes"))
        )

    def taken(self, faces: np.ndarray) -> CopiedFaces:
        """The faces of a mask (F,)."""
        corners = faces[self.face]
        return CopiedFaces(self.corners[corners], self.normals[corners], self.sizes[faces])

    def moved(self, way: np.ndarray) -> CopiedFaces:
        """The same elsewhere."""
        return CopiedFaces(self.corners + way, self.normals, self.sizes)

    def just_inside(self, radius: float) -> CopiedFaces:
        """The corners drawn into their faces and lifted, in a scene of that ``radius`` in metres."""
        face = self.face
        middles, _ = group_means(self.corners, face, len(self.sizes))
        inward = INWARD * (middles[face] - self.corners)
        lift = np.clip(0.25 * np.linalg.norm(inward, axis=1), LEAST_LIFT * radius, MOST_LIFT * radius)
        return CopiedFaces(self.corners + inward + lift[:, None] * self.normals, self.normals, self.sizes)


def render_faces(scene, view_layer, names: list[str]) -> dict[str, CopiedFaces]:
    """The faces of the mesh objects of these ``names`` as a render sees them, after their modifiers."""

    def visit(depsgraph) -> dict[str, CopiedFaces]:
        return {name: _faces(bpy.data.objects[name].evaluated_get(depsgraph)) for name in names}

    return view_as_render(scene, view_layer, visit)


def _faces(obj: bpy.types.Object) -> CopiedFaces:
    mesh, matrix = obj.data, np.array(obj.matrix_world)
    corners = vertex_positions(mesh)[corner_vertex_indices(mesh)] @ matrix[:3, :3].T + matrix[:3, 3]
    # What is broken in the mesh lies at the origin, where it is baked but never compared.
    corners = np.nan_to_num(corners, posinf=0, neginf=0)
    normals = stored_normals(mesh) @ np.linalg.pinv(matrix[:3, :3])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
    return CopiedFaces(corners, normals, face_sizes(mesh))


def centred(scene, faces: dict[str, CopiedFaces]) -> tuple[dict[str, CopiedFaces], float]:
    """Move a ``scene`` that is far away to the origin; returns the ``faces`` there and the radius around them."""
    corners = np.concatenate([part.corners for part in faces.values()])
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    # Matrices of Blender are of single precision: all must move by what they can hold.
    middle = ((lower + upper) / 2).astype(np.float32).astype(float)
    radius = float(np.linalg.norm(upper - lower) / 2)
    if np.linalg.norm(middle) <= FAR * radius:
        return faces, radius
    back = Matrix.Translation(-middle)
    for obj in scene.objects:
        if obj.parent is None:
            obj.matrix_world = back @ obj.matrix_world
    bpy.context.view_layer.update()
    return {name: part.moved(-middle) for name, part in faces.items()}, radius


@contextmanager
def copy_in(scene: bpy.types.Scene, faces: CopiedFaces) -> Iterator[bpy.types.Object]:
    """An object of these ``faces``, apart, in the scene, for Cycles to bake; no path meets it."""
    mesh = bpy.data.meshes.new("detp copy")
    material = bpy.data.materials.new("detp copy")
    copy = bpy.data.objects.new("detp copy", mesh)
    try:
        count = len(faces.corners)
        mesh.vertices.add(count)
        mesh.loops.add(count)
        mesh.polygons.add(len(faces.sizes))
        mesh.vertices.foreach_set("co", faces.corners.astype(np.float32).ravel())
        mesh.loops.foreach_set("vertex_index", np.arange(count, dtype=np.int32))
        mesh.polygons.foreach_set("loop_start", (np.cumsum(faces.sizes) - faces.sizes).astype(np.int32))
        mesh.update(calc_edges=True)
        mesh.normals_split_custom_set(faces.normals.tolist())
        _paint(material)
        mesh.materials.append(material)
        give_light_attribute(mesh)
        for kind in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
            setattr(copy, f"visible_{kind}", False)
        scene.collection.objects.link(copy)
        yield copy
    finally:
        bpy.data.objects.remove(copy)
        bpy.data.meshes.remove(mesh)
        bpy.data.materials.remove(material)


def _paint(material: bpy.types.Material) -> None:
    """Diffuse alone: of a surface that also shines Cycles would spend paths on what is not asked for."""
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    surface = nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]
    material.node_tree.links.new(nodes.new("ShaderNodeBsdfDiffuse").outputs[0], surface)


def give_light_attribute(mesh: bpy.types.Mesh) -> None:
    """An attribute that Cycles bakes into; shaders that read the mesh's default colour keep what they read."""
    default = mesh.attributes.default_color_name
    if LIGHT not in mesh.attributes:
        mesh.attributes.new(LIGHT, "FLOAT_COLOR", "CORNER")
    mesh.attributes.active_color_name = LIGHT
    mesh.attributes.default_color_name = default
